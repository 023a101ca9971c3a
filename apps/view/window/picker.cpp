#include "apps/view/window/picker.h"

#include <fmt/format.h>

#include <cmath>

#include "apps/view/layers/cloud_layer.h"
#include "apps/view/layers/line_layer.h"
#include "core/io/ply_io.h"

namespace groundray {
namespace {

constexpr glm::u8vec3 beam_rgb{255, 77, 64}, footprint_rgb{255, 217, 51}, mark_rgb{255, 255, 255};
const std::string beam_name = "picked/beam";
const std::string footprint_name = "picked/footprint";
const std::string mark_name = "picked/place";

void add_place(FactTable::Facts& facts, const glm::dvec3& p_w_m) {
  facts.emplace_back("east", fmt::format("{:.3f} m", p_w_m.x));
  facts.emplace_back("north", fmt::format("{:.3f} m", p_w_m.y));
  facts.emplace_back("up", fmt::format("{:.3f} m", p_w_m.z));
}

std::string value_text(const Layer& layer, const LayerColumn& column, vtkIdType row) {
  const double value = layer.value(column, row);
  if (column.is_rgb) return "";
  if (!std::isfinite(value)) return std::isnan(value) ? "none" : "infinite";
  const auto kind = column.categories.find(static_cast<int>(value));
  if (kind != column.categories.end()) return fmt::format("{} ({})", value, kind->second);
  return column.unit.empty() ? fmt::format("{:.7g}", value)
                             : fmt::format("{:.7g} {}", value, column.unit);
}

void add_beam(FactTable::Facts& facts, const EchoBeam& beam) {
  facts.emplace_back(
      "beam from",
      fmt::format("{:.3f}, {:.3f}, {:.3f} m{}", beam.origin_m.x, beam.origin_m.y, beam.origin_m.z,
                  beam.is_origin_exact ? "" : " (the sensor's origin)"));
  facts.emplace_back("footprint",
                     fmt::format("{:.4g} x {:.4g} m across", 2 * beam.horizontal_radius_m,
                                 2 * beam.vertical_radius_m));
}

// Returns a beam as lines: from the sensor to the echo, its edge at both ends, and its footprint on
// the surface.
std::vector<Layer> beam_layers(const EchoBeam& beam, const glm::dvec3& origin_w_m) {
  LineDrawing along, rings;
  along.add({beam.origin_m, beam.origin_m + beam.range_m * beam.direction}, beam_rgb);
  // Four lines along the edge.
  const std::size_t quarter = beam.across_m.size() / 4;
  for (std::size_t i = 0; quarter > 0 && i < 4; ++i)
    along.add({beam.waist_m[i * quarter], beam.across_m[i * quarter]}, beam_rgb);
  for (const auto& ring : {beam.waist_m, beam.across_m, beam.surface_m}) {
    if (ring.size() > 1) rings.add(ring, footprint_rgb);
  }
  std::vector<Layer> layers{line_layer(beam_name, LayerKind::Sensors, origin_w_m, along, 1.5)};
  if (!rings.runs.empty())
    layers.push_back(line_layer(footprint_name, LayerKind::Sensors, origin_w_m, rings, 2.5));
  return layers;
}

}  // namespace

Picker::Picker(View& view, Hooks hooks) : view_(view), hooks_(std::move(hooks)) {}

void Picker::clear() {
  job_.abandon();
  for (const std::string& name : {beam_name, footprint_name, mark_name}) view_.remove(name);
  if (hooks_.facts) hooks_.facts("", {});
  if (hooks_.changed) hooks_.changed();
}

void Picker::pick(const Picked& picked, const ShownScan* scan) {
  const Layer* layer = view_.find(picked.layer);
  if (layer == nullptr) return;
  job_.abandon();  // an echo clicked earlier must not be shown any more
  for (const std::string& name : {beam_name, footprint_name}) view_.remove(name);
  if (scan != nullptr && picked.of == LayerColumn::Of::Points) {
    show_echo(*layer, picked, *scan);
  } else {
    show_row(*layer, picked);
  }
  mark(picked.p_w_m);
  if (hooks_.changed) hooks_.changed();
}

// Marks a point by a cross, whose arms are 1.2 % of the point's distance from the eye.
void Picker::mark(const glm::dvec3& p_w_m) {
  const double half_m = 0.012 * glm::distance(view_.current_look().from_w_m, p_w_m);
  LineDrawing cross;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    glm::dvec3 arm(0);
    arm[axis] = half_m;
    cross.add({-arm, arm}, mark_rgb);
  }
  view_.add(line_layer(mark_name, LayerKind::Sensors, p_w_m, cross));
}

void Picker::show_row(const Layer& layer, const Picked& picked) {
  FactTable::Facts facts;
  add_place(facts, picked.p_w_m);
  for (const LayerColumn& column : layer.columns) {
    const std::string text =
        column.of == picked.of ? value_text(layer, column, picked.row) : std::string();
    if (!text.empty()) facts.emplace_back(column.name, text);
  }
  const bool is_point = picked.of == LayerColumn::Of::Points;
  if (hooks_.facts) {
    hooks_.facts(fmt::format("{}: {} {}", layer.name, is_point ? "point" : "triangle", picked.row),
                 facts);
  }
}

void Picker::show_echo(const Layer& layer, const Picked& picked, const ShownScan& scan) {
  const std::size_t row = table_row(layer, picked.row);
  const std::string title = fmt::format("{}: echo {}", layer.name, row);
  const auto known = scan.cloud != nullptr      ? scan.cloud
                     : file_ == scan.frame.file ? cloud_
                                                : nullptr;
  const auto work = [scan, row, known, p_w_m = picked.p_w_m](const auto&, const auto&) {
    Echo echo;
    echo.cloud = known != nullptr
                     ? known
                     : std::make_shared<const PointCloud>(read_ply(scan.frame.file).cloud);
    add_place(echo.facts, p_w_m);
    for (EchoValue& value : echo_values(*echo.cloud, row, scan.names)) {
      echo.facts.emplace_back(std::move(value.column), std::move(value.text));
    }
    echo.beam = echo_beam(*scan.sensor, scan.frame, *echo.cloud, row);
    add_beam(echo.facts, echo.beam);
    return echo;
  };
  const auto done = [this, title, file = scan.frame.file,
                     origin_w_m = scan.origin_w_m](const Echo& echo) {
    file_ = file;
    cloud_ = echo.cloud;
    for (Layer& each : beam_layers(echo.beam, origin_w_m)) view_.add(std::move(each));
    if (hooks_.facts) hooks_.facts(title, echo.facts);
    if (hooks_.beam) hooks_.beam(echo.beam, origin_w_m);
    if (hooks_.changed) hooks_.changed();
  };
  job_.start(work, done, {.failed = hooks_.failed});
}

}  // namespace groundray
