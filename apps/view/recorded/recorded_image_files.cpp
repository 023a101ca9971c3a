#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "apps/view/recorded/echo_pixels.h"
#include "apps/view/recorded/recorded_image.h"
#include "apps/view/rendering/picture_file.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Kind = ImageChannel::Kind;

// Layer of an EXR file, as defined in docs/reference/formats.md.
struct KnownLayer {
  std::string_view prefix;  // prefix of the channels' names; for a single channel, its full name
  const char* name;
  const char* unit;
  Kind kind;
  double full = 0;  // ImageChannel::full, or 0 for none
};
constexpr std::array known_layers{
    KnownLayer{"", "light", "W/(m² sr)", Kind::Light},
    KnownLayer{"Z", "depth", "m", Kind::Distance},
    KnownLayer{"Distance", "distance", "m", Kind::Distance},
    KnownLayer{"Label", "label", "", Kind::Categories},
    KnownLayer{"Instance", "instance", "", Kind::Categories},
    KnownLayer{"Material", "material", "", Kind::Categories},
    KnownLayer{"N", "normal", "", Kind::Vector, 1},
    KnownLayer{"Ns", "shading normal", "", Kind::Vector, 1},
    KnownLayer{"FlowForward", "flow to the next image", "px", Kind::Flow},
    KnownLayer{"FlowBackward", "flow to the image before", "px", Kind::Flow},
    KnownLayer{"Albedo", "albedo", "", Kind::Light, 1},
    KnownLayer{"Incidence", "incidence", "rad", Kind::Number},
    KnownLayer{"Velocity", "velocity", "m/s", Kind::Vector},
    KnownLayer{"P", "position", "m", Kind::Number},
    KnownLayer{"Bound", "bound", "m", Kind::Distance},
    KnownLayer{"StdError", "standard error", "W/(m² sr)", Kind::Light},
    KnownLayer{"Samples", "samples", "", Kind::Number},
    KnownLayer{"Valid", "valid", "", Kind::Categories},
};

constexpr std::string_view coverage_prefix = "Coverage.";

// Set of suffixes of channels that form one layer.
struct Components {
  std::array<std::string_view, 3> words;
  std::size_t least;  // number of leading suffixes that are required
  Kind kind;
};
constexpr std::array known_components{Components{{"R", "G", "B"}, 3, Kind::Light},
                                      Components{{"X", "Y", "Z"}, 3, Kind::Vector},
                                      Components{{"u", "v", "seen"}, 2, Kind::Flow}};

std::pair<std::string, std::string> split(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) return {"", name};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

ImageF woven(const std::vector<const ExrChannel*>& parts) {
  const auto [width, height] =
      std::visit([](const auto& image) { return std::pair(image.width(), image.height()); },
                 parts.front()->image);
  const auto count = parts.size();
  ImageF all(width, height, static_cast<int>(count));
  for (std::size_t k = 0; k < count; ++k) {
    std::visit(
        [&](const auto& image) {
          const auto values = image.values();
          for (std::size_t i = 0; i < values.size(); ++i)
            all.values()[i * count + k] = static_cast<float>(values[i]);
        },
        parts[k]->image);
  }
  return all;
}

// Returns an EXR layer's name, unit and kind, without values.
ImageChannel layer_named(const std::string& prefix, Kind kind) {
  const auto known = std::ranges::find(known_layers, prefix, &KnownLayer::prefix);
  if (known != known_layers.end() && (kind == known->kind || kind != Kind::Light)) {
    ImageChannel channel{.name = known->name, .unit = known->unit, .kind = known->kind};
    if (known->full > 0) channel.full = known->full;
    return channel;
  }
  if (prefix.starts_with(coverage_prefix)) {
    return {.name = "coverage " + prefix.substr(coverage_prefix.size()),
            .kind = Kind::Number,
            .full = 1};
  }
  return {.name = prefix.empty() ? "light" : prefix, .kind = kind};
}

// Combines channels that form a layer, and clears their flags in `left`.
void take_woven(const ExrFile& file, std::vector<bool>& left, std::vector<ImageChannel>& channels) {
  std::map<std::string, std::map<std::string, std::size_t>> by_prefix;
  for (std::size_t i = 0; i < file.channels.size(); ++i) {
    auto [prefix, word] = split(file.channels[i].name);
    by_prefix[prefix][word] = i;
  }
  for (const auto& [prefix, words] : by_prefix) {
    for (const Components& set : known_components) {
      if (prefix.empty() && set.kind != Kind::Light) continue;
      std::vector<const ExrChannel*> parts;
      std::vector<std::size_t> taken;
      for (const std::string_view word : set.words) {
        const auto found = words.find(std::string(word));
        if (found == words.end()) break;
        parts.push_back(&file.channels[found->second]);
        taken.push_back(found->second);
      }
      if (parts.size() < set.least) continue;
      for (const std::size_t i : taken) left[i] = false;
      channels.push_back(layer_named(prefix, set.kind));
      channels.back().values = woven(parts);
    }
  }
}

std::vector<ImageChannel> exr_channels(const fs::path& path) {
  ExrFile file = read_exr(path);
  std::vector<ImageChannel> channels;
  std::vector<bool> left(file.channels.size(), true);
  take_woven(file, left, channels);
  for (std::size_t i = 0; i < file.channels.size(); ++i) {
    if (!left[i]) continue;
    ExrChannel& channel = file.channels[i];
    const bool is_whole = std::holds_alternative<Image32>(channel.image);
    channels.push_back(layer_named(channel.name, is_whole ? Kind::Categories : Kind::Number));
    std::visit([&](auto& image) { channels.back().values = std::move(image); }, channel.image);
  }
  const auto place = [](const ImageChannel& channel) {
    return std::ranges::find(known_layers, channel.name, &KnownLayer::name) - known_layers.begin();
  };
  std::ranges::stable_sort(channels, {}, place);
  return channels;
}

bool has_16_bits(std::string_view bytes) {
  constexpr std::size_t depth_at = 24;  // offset of the bit depth in the header chunk, the first
  return bytes.size() > depth_at && bytes.starts_with("\x89PNG") && bytes[depth_at] == 16;
}

ImageChannel picture_channel(const fs::path& path) {
  const std::string bytes = read_text(path);
  ImageChannel channel{.name = "picture", .kind = Kind::AsStored};
  if (has_16_bits(bytes))
    channel.values = parse_heights(bytes, path.string());
  else
    channel.values = parse_image8(bytes, path.string());
  return channel;
}

ImageChannel raw_channel(const fs::path& path) {
  ImageChannel channel = picture_channel(path);
  channel.name = "raw";
  channel.kind = Kind::Number;
  if (auto* values = std::get_if<ImageF>(&channel.values)) {
    for (float& value : values->values()) value = std::round(value * 65535);
  }
  return channel;
}

// KITTI's flow format: docs/reference/formats.md.
ImageChannel kitti_channel(const fs::path& path) {
  const ImageF stored = read_heights(path);
  if (stored.channels() != 3)
    throw Error("{}: KITTI's flow has 3 channels, but this picture has {}", path.string(),
                stored.channels());
  ImageF flow_px(stored.width(), stored.height(), 2);
  for (std::size_t i = 0; 2 * i < flow_px.values().size(); ++i) {
    const float* from = &stored.values()[3 * i];
    const bool is_known = from[2] > 0;
    for (std::size_t k = 0; k < 2; ++k) {
      flow_px.values()[2 * i + k] = is_known ? (std::round(from[k] * 65535) - 32768) / 64
                                             : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return {.name = "flow (KITTI)", .unit = "px", .kind = Kind::Flow, .values = std::move(flow_px)};
}

// Middlebury's flow format.
ImageChannel flo_channel(const fs::path& path) {
  static_assert(std::endian::native == std::endian::little);
  const std::string bytes = read_text(path);
  std::array<std::int32_t, 2> size_px{};
  constexpr std::size_t head = 12;
  if (bytes.size() >= head) std::memcpy(size_px.data(), bytes.data() + 4, 8);
  const auto pixels = static_cast<std::uint64_t>(std::max(size_px[0], 0)) *
                      static_cast<std::uint64_t>(std::max(size_px[1], 0));
  if (!bytes.starts_with("PIEH") || pixels == 0 || bytes.size() != head + pixels * 8)
    throw Error(
        "{}: it is not a complete .flo file: PIEH, width, height and 8 bytes for each pixel",
        path.string());
  ImageF flow_px(size_px[0], size_px[1], 2);
  std::memcpy(flow_px.values().data(), bytes.data() + head, pixels * 8);
  for (float& value : flow_px.values()) {
    if (!(std::abs(value) <= 1e9f)) value = std::numeric_limits<float>::quiet_NaN();
  }
  return {.name = "flow (.flo)", .unit = "px", .kind = Kind::Flow, .values = std::move(flow_px)};
}

ImageChannel stage_channel(const fs::path& path, const char* name, const char* unit, Kind kind) {
  ImageF values = read_image_f(path, PictureOf::Heights);
  return {.name = name, .unit = unit, .kind = kind, .values = std::move(values)};
}

// Paints a dot of 3 x 3 px wherever it is nearer than the present value.
void paint_dot(ImageF& image, double u_px, double v_px, double depth_m) {
  if (!(std::abs(u_px) < 1e6 && std::abs(v_px) < 1e6)) return;
  const glm::ivec2 middle(static_cast<int>(std::lround(u_px)), static_cast<int>(std::lround(v_px)));
  for (int k = 0; k < 9; ++k) {
    const glm::ivec2 pixel = middle + glm::ivec2(k % 3 - 1, k / 3 - 1);
    if (pixel.x < 0 || pixel.y < 0 || pixel.x >= image.width() || pixel.y >= image.height())
      continue;
    float& value = image.at(pixel.x, pixel.y)[0];
    if (!(value <= depth_m)) value = static_cast<float>(depth_m);
  }
}

// Returns a channel that shows a lidar's echoes as dots of their depth, the nearest on top.
ImageChannel echoes_channel(const fs::path& path, const std::string& lidar, glm::ivec2 size_px) {
  ImageF shown(size_px.x, size_px.y, 1);
  std::ranges::fill(shown.values(), std::numeric_limits<float>::quiet_NaN());
  for (const EchoPixel& echo : read_echo_pixels(path))
    paint_dot(shown, echo.pixel.x, echo.pixel.y, echo.depth_m);
  return {.name = "echoes of " + lidar,
          .unit = "m",
          .kind = Kind::Distance,
          .file = path.filename().string(),
          .values = std::move(shown)};
}

// Adds the channels of all lidars that have a file of echoes, sorted by name.
void add_echoes(const fs::path& stem, std::vector<ImageChannel>& channels) {
  for (const auto& [lidar, path] : echo_files(stem))
    channels.push_back(echoes_channel(path, lidar, size_of(channels.front().values)));
}

}  // namespace

std::vector<ImageChannel> read_frame_channels(const fs::path& stem) {
  std::vector<ImageChannel> channels;
  const auto add = [&](const char* ending, const auto& read) {
    const fs::path path = stem.string() + ending;
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) return;
    std::vector<ImageChannel> more;
    if constexpr (std::is_same_v<decltype(read(path)), ImageChannel>)
      more.push_back(read(path));
    else
      more = read(path);
    for (ImageChannel& channel : more) {
      channel.file = path.filename().string();
      channels.push_back(std::move(channel));
    }
  };
  add(".png", picture_channel);
  add(".exr", exr_channels);
  add(".flo", flo_channel);
  add("_flow.png", kitti_channel);
  const auto stage = [](const char* name, const char* unit, Kind kind) {
    return [=](const fs::path& path) { return stage_channel(path, name, unit, kind); };
  };
  add("_irradiance.exr", stage("irradiance", "W/m²", Kind::Light));
  add("_photons.exr", stage("photons", "", Kind::Number));
  add("_electrons.exr", stage("electrons", "e⁻", Kind::Number));
  add("_raw.png", raw_channel);
  if (channels.empty()) {
    throw Error("{}: there is no image of this frame, neither .png nor .exr: was it removed?",
                stem.string());
  }
  add_echoes(stem, channels);
  return channels;
}

std::vector<ImageChannel> read_file_channels(const fs::path& file) {
  const std::string ending = file_ending(file);
  std::vector<ImageChannel> channels;
  if (ending == ".exr")
    channels = exr_channels(file);
  else if (ending == ".hdr")
    channels.push_back(stage_channel(file, "light", "", Kind::Light));
  else if (ending == ".flo")
    channels.push_back(flo_channel(file));
  else if (ending == ".png" || ending == ".jpg" || ending == ".jpeg")
    channels.push_back(picture_channel(file));
  else  // other rasters, such as GeoTIFF
    channels.push_back(
        {.name = "picture", .kind = Kind::AsStored, .values = read_picture(file).picture});
  for (ImageChannel& channel : channels) channel.file = file.filename().string();
  return channels;
}

}  // namespace groundray
