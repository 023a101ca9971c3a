#include "apps/view/rendering/offscreen_render.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vector_relational.hpp>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/image/png_io.h"
#include "core/math.h"

namespace groundray {
namespace {

std::vector<std::string> names_of(const View& view) {
  std::vector<std::string> names;
  for (const Layer* const layer : view.layers()) names.push_back(layer->name);
  return names;
}

// Parses numbers with a separator between them; returns std::nullopt for any other text.
template <typename T, std::size_t count>
std::optional<std::array<T, count>> parse_numbers(std::string_view text, char between) {
  std::array<T, count> numbers{};
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) {
      if (at == end || *at != between) return std::nullopt;
      ++at;
    }
    const auto [stop, fault] = std::from_chars(at, end, numbers[i]);
    if (fault != std::errc()) return std::nullopt;
    at = stop;
  }
  if (at != end) return std::nullopt;
  return numbers;
}

void colour(View& view, const std::string& request) {
  const auto equals = request.rfind('=');
  if (equals != std::string::npos) {
    view.colour_by(request.substr(0, equals), request.substr(equals + 1));
    return;
  }
  bool is_done = false;
  std::string columns;
  for (const Layer* const layer : view.layers()) {
    for (const LayerColumn& column : layer->columns)
      columns += fmt::format("{}{}={}", columns.empty() ? "" : ", ", layer->name, column.name);
    if (layer->find(request) == nullptr) continue;
    view.colour_by(layer->name, request);
    is_done = true;
  }
  if (!is_done)
    throw Error("--colour-by {}: no layer has that column; there are {}", request, columns);
}

// Sets the range of a column's colours wherever it is displayed. @return true if any layer displays
// it.
bool span_colours(View& view, const std::string& request, const glm::dvec2& range) {
  const auto equals = request.rfind('=');
  const std::string name = equals == std::string::npos ? request : request.substr(equals + 1);
  bool is_shown = false;
  for (const Layer* const layer : view.layers()) {
    const LayerColumn* const column = layer->find(name);
    if (layer->coloured_by != name || column == nullptr || column->is_rgb) continue;
    view.set_range(layer->name, name, range);
    is_shown = true;
  }
  return is_shown;
}

void hide(View& view, const std::string& request) {
  bool is_done = false;
  for (const std::string& name : names_of(view)) {
    if (name != request && !name.starts_with(request + "/")) continue;
    view.set_visible(name, false);
    is_done = true;
  }
  if (!is_done)
    throw Error("--hide {}: no layer has that name; there are {}", request,
                fmt::join(names_of(view), ", "));
}

std::string unique_name(const View& view, const std::string& wanted) {
  std::string name = wanted;
  for (int i = 2; view.find(name) != nullptr; ++i) name = fmt::format("{} ({})", wanted, i);
  return name;
}

void look(View& view, const std::vector<Opened>& inputs, const StillSpec& spec) {
  const auto wanted =
      std::ranges::find_if(inputs, [](const Opened& opened) { return opened.look.has_value(); });
  if (wanted != inputs.end()) {
    view.look(*wanted->look);
  } else {
    view.fit();
  }
  if (!spec.view.from_w_m && !spec.view.at_w_m) return;
  const Look look = requested_look(view.current_look(), spec.view);
  if (!(glm::length(look.at_w_m - look.from_w_m) > 0))
    throw Error("--look-from and --look-at are the same point: they must differ");
  view.look(look);
}

}  // namespace

Look requested_look(Look look, const ViewOptions& options) {
  if (!options.from_w_m && !options.at_w_m) return look;
  look.from_w_m = options.from_w_m.value_or(look.from_w_m);
  look.at_w_m = options.at_w_m.value_or(look.at_w_m);
  const glm::dvec3 ahead = look.at_w_m - look.from_w_m;
  const bool is_plumb = math::hypot(ahead.x, ahead.y) < 1e-6 * std::abs(ahead.z);
  look.up = is_plumb ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  return look;
}

void place_inputs(std::vector<Opened>& inputs, const std::vector<FrameOrigin>& origins) {
  for (const FrameOrigin& origin : origins) {
    bool is_used = false;
    for (Opened& opened : inputs) is_used = place_input(opened, origin) || is_used;
    if (!is_used)
      throw Error("--origin {}: no input is a mesh or cloud {}", origin.text,
                  origin.input.empty() ? "whose file states no origin; name one: INPUT=X,Y,Z"
                                       : "of that path or file name");
  }
}

void arrange(View& view, std::vector<Opened>& inputs, const StillSpec& spec) {
  for (Opened& opened : inputs) {
    for (const Layer& layer : opened.layers) {
      Layer shown = layer;
      shown.name = unique_name(view, layer.name);
      if (spec.view.point_size_px) shown.point_size_px = *spec.view.point_size_px;
      view.add(std::move(shown));
    }
  }
  look(view, inputs, spec);
  if (spec.follow_w_m && (inputs.empty() || !inputs.front().follower))
    throw Error(
        "--follow: the first input has no terrain that follows a viewpoint: give a scene or a DEM");
  for (Opened& opened : inputs) {
    // Names are made unique, so only the first terrain has the name that its follower uses.
    const bool is_first = &opened == &inputs.front();
    if (opened.follower && is_first)
      view.add(
          opened.follower->follow(spec.follow_w_m.value_or(view.current_look().from_w_m)).layer);
  }
  for (const std::string& request : spec.view.hide) hide(view, request);
  for (const std::string& request : spec.view.colour_by) colour(view, request);
  if (spec.range) {
    bool is_shown = span_colours(view, "deviation", *spec.range);
    for (const std::string& request : spec.view.colour_by)
      is_shown = span_colours(view, request, *spec.range) || is_shown;
    if (!is_shown) {
      throw Error(
          "--range: no layer is coloured by a numeric column; give one with --colour-by, or a "
          "truth with --compare-with");
    }
  }
  if (spec.view.is_wireframe) {
    for (const Layer* const layer : view.layers()) {
      if (layer->kind == LayerKind::Terrain || layer->kind == LayerKind::Mesh)
        view.set_wireframe(layer->name, true);
    }
  }
  view.set_legend_visible(spec.view.has_legend);
  view.set_eye_dome(spec.view.has_eye_dome);
  view.set_exposure(spec.view.exposure_ev);
  view.set_clip(spec.view.clip);
}

void write_still(View& view, const std::filesystem::path& file, glm::ivec2 size_px) {
  write_png(file, view.picture(size_px));
}

void write_turntable(View& view, const std::filesystem::path& folder, int pictures,
                     glm::ivec2 size_px) {
  if (pictures < 2 || pictures > 9999)
    throw Error("--turntable {}: it must be 2 to 9999 pictures", pictures);
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (fault) throw Error("{}: the folder cannot be created: {}", folder.string(), fault.message());
  const Look begin = view.current_look();
  const glm::dvec3 out = begin.from_w_m - begin.at_w_m;
  for (int i = 0; i < pictures; ++i) {
    const double turn = glm::radians(360.0 * i / pictures);
    Look now = begin;
    now.from_w_m =
        begin.at_w_m + glm::dvec3(out.x * math::cos(turn) - out.y * math::sin(turn),
                                  out.x * math::sin(turn) + out.y * math::cos(turn), out.z);
    view.look(now);
    write_still(view, folder / fmt::format("{:04}.png", i), size_px);
  }
  view.look(begin);
}

glm::ivec2 parse_size(const std::string& text) {
  const auto numbers = parse_numbers<int, 2>(text, 'x');
  if (!numbers || (*numbers)[0] < 1 || (*numbers)[1] < 1)
    throw Error("--size {}: it must be WIDTHxHEIGHT in pixels, such as 1280x720", text);
  return {(*numbers)[0], (*numbers)[1]};
}

glm::dvec2 parse_range(const std::string& text) {
  const auto numbers = parse_numbers<double, 2>(text, ',');
  if (!numbers || !std::isfinite((*numbers)[0]) || !std::isfinite((*numbers)[1]) ||
      !((*numbers)[0] < (*numbers)[1]))
    throw Error("--range {}: it must be LOW,HIGH with LOW less than HIGH", text);
  return {(*numbers)[0], (*numbers)[1]};
}

FrameOrigin parse_origin(const std::string& text) {
  const auto equals = text.rfind('=');
  const bool has_name = equals != std::string::npos;
  return {.text = text,
          .input = has_name ? text.substr(0, equals) : "",
          .origin_w_m = parse_place(has_name ? text.substr(equals + 1) : text, "--origin")};
}

ClipBox parse_box(const std::string& text) {
  const auto n = parse_numbers<double, 6>(text, ',');
  if (!n || !std::ranges::all_of(*n, [](double number) { return std::isfinite(number); }))
    throw Error("--clip {}: it must be X0,Y0,Z0,X1,Y1,Z1 in metres, in map coordinates", text);
  const ClipBox box{{(*n)[0], (*n)[1], (*n)[2]}, {(*n)[3], (*n)[4], (*n)[5]}};
  if (!glm::all(glm::lessThan(box.low_w_m, box.high_w_m)))
    throw Error("--clip {}: the box is empty: X0, Y0, Z0 must be less than X1, Y1, Z1", text);
  return box;
}

glm::dvec3 parse_place(const std::string& text, const std::string& option) {
  const auto numbers = parse_numbers<double, 3>(text, ',');
  if (!numbers || !std::ranges::all_of(*numbers, [](double n) { return std::isfinite(n); }))
    throw Error("{} {}: it must be X,Y,Z in metres, in map coordinates", option, text);
  return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

}  // namespace groundray
