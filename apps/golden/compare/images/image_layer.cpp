#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include "apps/golden/compare/images/image_file.h"

namespace groundray::golden {
namespace {

struct LayerName {
  std::string_view name;
  LayerKind kind;
  std::string_view components;  // one letter per channel; empty for a single one
  std::string_view spellings;   // lower case, without _ and -, each between blanks
};

constexpr std::array layer_names{
    LayerName{"Z", LayerKind::Depth, "", " z depth zdepth depthmap "},
    LayerName{"Distance", LayerKind::Depth, "", " distance range t "},
    LayerName{"N", LayerKind::Normal, "xyz", " n normal normals geonormal geometricnormal "},
    LayerName{"Ns", LayerKind::Normal, "xyz", " ns shnormal shadingnormal "},
    LayerName{"P", LayerKind::Number, "xyz", " p position worldposition "},
    LayerName{"Velocity", LayerKind::Number, "xyz", " velocity "},
    LayerName{"RGB", LayerKind::Colour, "rgb",
              " rgb rgba color colour beauty combined radiance image "},
    LayerName{"Albedo", LayerKind::Colour, "rgb", " albedo "},
    LayerName{"StdError", LayerKind::Number, "rgb", " stderror "},
    LayerName{"Picture", LayerKind::Colour, "rgb", " picture "},
    LayerName{"Y", LayerKind::Colour, "", " y luminance "},
    LayerName{"FlowForward", LayerKind::Flow, "uv", " flowforward flow forwardflow opticalflow "},
    LayerName{"FlowBackward", LayerKind::Flow, "uv", " flowbackward backwardflow "},
    LayerName{"Label", LayerKind::Label, "",
              " label labels semantic semantics class segmentation "},
    LayerName{"Instance", LayerKind::Label, "", " instance instanceid object objectid indexob "},
    LayerName{"Material", LayerKind::Label, "", " material materialid indexma "},
    LayerName{"Valid", LayerKind::Label, "", " valid isvalid mask "}};

// Alternative component letters of other programs.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> also{
    {{"xyz", "rgb"}, {"uv", "xy"}}};

/// Returns a channel's name split at dots, slashes and colons, in lower case, without underscores,
/// dashes and blanks.
std::vector<std::string> parts_of(std::string_view name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    if (c == '.' || c == '/' || c == ':') {
      parts.emplace_back();
    } else if (c != '_' && c != '-' && c != ' ') {
      parts.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return parts;
}

const LayerName* layer_called(const std::string& word) {
  const auto found = std::ranges::find_if(layer_names, [&](const LayerName& layer) {
    return !word.empty() && layer.spellings.find(" " + word + " ") != std::string_view::npos;
  });
  return found == layer_names.end() ? nullptr : &*found;
}

std::optional<std::size_t> component(const LayerName& layer, char letter) {
  if (layer.components.empty()) return 0;
  std::size_t place = layer.components.find(letter);
  for (const auto& other : also) {
    if (place == std::string_view::npos && other.first == layer.components)
      place = other.second.find(letter);
  }
  return place == std::string_view::npos ? std::nullopt : std::optional(place);
}

struct Meaning {
  const LayerName* layer = nullptr;
  std::size_t component = 0;
};

Meaning meaning_of(const std::string& name) {
  const std::vector<std::string> parts = parts_of(name);
  const std::string& last = parts.back();
  if (parts.size() == 1) {
    if (const LayerName* layer = layer_called(last); layer != nullptr && layer->components.empty())
      return {layer, 0};
    const std::size_t of_light = last.size() == 1 ? std::string_view("rgb").find(last) : 3;
    return of_light < 3 ? Meaning{layer_called("rgb"), of_light} : Meaning{};
  }
  // Mitsuba appends "T" to a user-defined name for the distance along a ray.
  if (last == "t") return {layer_called(last), 0};
  if (last.size() == 1) {
    if (const LayerName* layer = layer_called(parts[parts.size() - 2])) {
      if (const auto place = component(*layer, last[0])) return {layer, *place};
    }
    return {};
  }
  const LayerName* layer = layer_called(last);
  return layer != nullptr && layer->components.empty() ? Meaning{layer, 0} : Meaning{};
}

std::size_t channels_of(const LayerName& layer) {
  return std::max<std::size_t>(layer.components.size(), 1);
}

ImageLayer together(const LayerName& layer, const std::vector<const NamedChannel*>& channels) {
  const Image<double>& first = channels.front()->values;
  ImageLayer result{.name = std::string(layer.name),
                    .kind = layer.kind,
                    .channels = {},
                    .values = {first.width(), first.height(), static_cast<int>(channels.size())}};
  for (std::size_t k = 0; k < channels.size(); ++k) {
    result.channels.push_back(channels[k]->name);
    const auto from = channels[k]->values.values();
    for (std::size_t i = 0; i < from.size(); ++i)
      result.values.values()[i * channels.size() + k] = from[i];
  }
  return result;
}

}  // namespace

std::vector<ImageLayer> layers_of(std::vector<NamedChannel> channels) {
  std::vector<ImageLayer> layers;
  std::vector<bool> is_used(channels.size());
  for (const LayerName& layer : layer_names) {
    std::vector<std::optional<std::size_t>> found(channels_of(layer));
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const Meaning meaning = meaning_of(channels[i].name);
      if (meaning.layer == &layer && !found[meaning.component]) found[meaning.component] = i;
    }
    if (!std::ranges::all_of(found, [](const auto& index) { return index.has_value(); })) continue;
    std::vector<const NamedChannel*> parts;
    for (const auto& index : found) {
      parts.push_back(&channels[*index]);
      is_used[*index] = true;
    }
    layers.push_back(together(layer, parts));
  }
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (is_used[i]) continue;
    const std::string name = channels[i].name;
    // Flow visibility: 1 if the point lies in the other image and is not occluded, else 0.
    const LayerKind kind = parts_of(name).back() == "seen" ? LayerKind::Label : LayerKind::Number;
    layers.push_back({name, kind, {name}, std::move(channels[i].values)});
  }
  return layers;
}

}  // namespace groundray::golden
