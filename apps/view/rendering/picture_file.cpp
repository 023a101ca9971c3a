#include "apps/view/rendering/picture_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "apps/view/layers/picture_layer.h"
#include "apps/view/rendering/colour_table.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "terrain/dem/band_file.h"

namespace groundray {
namespace {

std::vector<float> floats_of(const ExrChannel& channel) {
  return std::visit(
      [](const auto& image) {
        std::vector<float> values;
        for (const auto value : image.values()) values.push_back(static_cast<float>(value));
        return values;
      },
      channel.image);
}

PictureFile exr_colours(const ExrFile& file, const std::array<const ExrChannel*, 3>& rgb) {
  ImageF light(file.width, file.height, 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<float> values = floats_of(*rgb[k]);
    for (std::size_t i = 0; i < values.size(); ++i) light.values()[3 * i + k] = values[i];
  }
  return {expose(light), {"radiance, exposed so that the brightest parts are white"}};
}

PictureFile exr_numbers(const ExrFile& file, const ExrChannel& channel) {
  const std::vector<float> values = floats_of(channel);
  const glm::dvec2 range = colour_range(values, ColourScale::Even);
  PictureFile shown{Image8(file.width, file.height, 3), {}};
  for (std::size_t i = 0; i < values.size(); ++i) {
    // If all values are equal, they are drawn as the middle of the scale.
    const double share =
        range.y > range.x ? (static_cast<double>(values[i]) - range.x) / (range.y - range.x) : 0.5;
    const glm::dvec3 colour =
        std::isfinite(values[i]) ? colour_on(ColourScale::Even, share) : glm::dvec3(0.45);
    for (std::size_t k = 0; k < 3; ++k)
      shown.picture.values()[3 * i + k] =
          static_cast<std::uint8_t>(std::lround(255 * colour[static_cast<glm::length_t>(k)]));
  }
  shown.notes.push_back(
      fmt::format("channel {}, from {:.4g} to {:.4g}", channel.name, range.x, range.y));
  return shown;
}

PictureFile read_exr_picture(const std::filesystem::path& path) {
  const ExrFile file = read_exr(path);
  const std::array<const ExrChannel*, 3> rgb = {file.find("R"), file.find("G"), file.find("B")};
  if (std::ranges::find(rgb, nullptr) == rgb.end()) return exr_colours(file, rgb);
  for (const char* const name : {"Y", "Z", "Distance"}) {
    if (const ExrChannel* const channel = file.find(name)) return exr_numbers(file, *channel);
  }
  if (file.channels.empty()) throw Error("{}: it has no channel", path.string());
  return exr_numbers(file, file.channels.front());
}

PictureFile read_raster_picture(const std::filesystem::path& path) {
  const RasterKind kind = inspect_raster(path);
  if (std::int64_t{kind.samples.x} * kind.samples.y > most_image_pixels)
    throw Error("{}: {} x {} px, more than the {} that can be shown", path.string(), kind.samples.x,
                kind.samples.y, most_image_pixels);
  constexpr std::size_t most_pixels = std::size_t{1} << 24U;
  const RasterBands bands = read_bands(path, most_pixels, 3);
  PictureFile shown{Image8(bands.samples.x, bands.samples.y, 3), {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<float>& values = bands.bands[k].values;
    for (std::size_t i = 0; i < values.size(); ++i)
      shown.picture.values()[3 * i + k] = static_cast<std::uint8_t>(
          std::isfinite(values[i]) ? std::clamp(values[i], 0.0f, 255.0f) : 0.0f);
  }
  if (bands.step > 1) shown.notes.push_back(fmt::format("shown with every {}. pixel", bands.step));
  return shown;
}

}  // namespace

PictureFile read_picture(const std::filesystem::path& path) {
  const std::string end = file_ending(path);
  if (end == ".exr") return read_exr_picture(path);
  if (end == ".hdr")
    return {expose(read_image_f(path)), {"light, exposed so that its brightest parts are white"}};
  if (end == ".png" || end == ".jpg" || end == ".jpeg") return {read_image8(path), {}};
  return read_raster_picture(path);
}

}  // namespace groundray
