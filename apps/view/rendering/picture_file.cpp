#include "apps/view/rendering/picture_file.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "apps/view/rendering/colour_table.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/image/srgb.h"
#include "core/io/file_io.h"
#include "core/math.h"
#include "core/quantile.h"
#include "terrain/dem/band_file.h"

namespace groundray {
namespace {

// Returns the 99 % quantile of the positive values of the colours.
double white_level(const ImageF& light) {
  const auto colours = static_cast<std::size_t>(std::min(light.channels(), 3));
  std::vector<double> values;
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      for (const float value : light.at(x, y).first(colours)) {
        if (std::isfinite(value) && value > 0) values.push_back(static_cast<double>(value));
      }
    }
  }
  return values.empty() ? 1 : quantile(values, 0.99);
}

std::uint8_t encoded(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * srgb_of_linear(std::clamp(linear, 0.0, 1.0))));
}

std::vector<float> floats_of(const ExrChannel& channel) {
  return std::visit(
      [](const auto& image) {
        std::vector<float> values;
        for (const auto value : image.values()) values.push_back(static_cast<float>(value));
        return values;
      },
      channel.image);
}

PictureFile shown_light(ImageF light, const char* kind) {
  const double white = white_level(light);
  for (float& value : light.values())
    value = static_cast<float>(static_cast<double>(value) / white);
  Image8 picture = expose(light, 0);
  return {.picture = std::move(picture),
          .notes = {fmt::format("{}, exposed so that 1 % of its values exceed white", kind)},
          .light = std::move(light)};
}

PictureFile exr_colours(const ExrFile& file, const std::array<const ExrChannel*, 3>& rgb) {
  ImageF light(file.width, file.height, 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<float> values = floats_of(*rgb[k]);
    for (std::size_t i = 0; i < values.size(); ++i) light.values()[3 * i + k] = values[i];
  }
  return shown_light(std::move(light), "radiance");
}

PictureFile exr_numbers(const ExrFile& file, const ExrChannel& channel) {
  const std::vector<float> values = floats_of(channel);
  const glm::dvec2 range = colour_range(values, ColourScale::Even);
  PictureFile shown{
      .picture = Image8(file.width, file.height, 3), .notes = {}, .has_exposure = false};
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
  PictureFile shown{.picture = Image8(bands.samples.x, bands.samples.y, 3), .notes = {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<float>& values = bands.bands[k].values;
    for (std::size_t i = 0; i < values.size(); ++i)
      shown.picture.values()[3 * i + k] = static_cast<std::uint8_t>(
          std::isfinite(values[i]) ? std::clamp(values[i], 0.0f, 255.0f) : 0.0f);
  }
  if (bands.step > 1) shown.notes.push_back(fmt::format("shown with every {}. pixel", bands.step));
  return shown;
}

// Returns a texture of an image's first channels; grey images have equal colours.
vtkSmartPointer<vtkTexture> texture_of(const Image8& image, int components) {
  const int channels = image.channels();
  const auto pixels =
      static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  const auto bytes = make_array<vtkUnsignedCharArray>("colours", pixels, components);
  auto* to = bytes->GetPointer(0);
  for (int y = image.height() - 1; y >= 0; --y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto pixel = image.at(x, y);
      for (std::size_t k = 0; k < static_cast<std::size_t>(components); ++k)
        *to++ = pixel[channels >= 3 ? k : 0];
    }
  }
  auto content = vtkSmartPointer<vtkImageData>::New();
  content->SetDimensions(image.width(), image.height(), 1);
  content->GetPointData()->SetScalars(bytes);
  auto texture = vtkSmartPointer<vtkTexture>::New();
  texture->SetInputData(content);
  texture->SetColorModeToDirectScalars();
  texture->SetWrap(vtkTexture::ClampToEdge);
  return texture;
}

}  // namespace

PictureFile read_picture(const std::filesystem::path& path) {
  const std::string end = file_ending(path);
  if (end == ".exr") return read_exr_picture(path);
  if (end == ".hdr") return shown_light(read_image_f(path), "light");
  if (end == ".png" || end == ".jpg" || end == ".jpeg")
    return {.picture = read_image8(path), .notes = {}};
  return read_raster_picture(path);
}

Image8 expose(const ImageF& light, double exposure_ev) {
  const double gain = math::exp2(exposure_ev);
  Image8 picture(light.width(), light.height(), light.channels() >= 3 ? 3 : 1);
  tbb::parallel_for(0, light.height(), [&](int y) {
    for (int x = 0; x < light.width(); ++x) {
      const auto from = light.at(x, y);
      const auto to = picture.at(x, y);
      for (std::size_t k = 0; k < to.size(); ++k) {
        const double value = gain * static_cast<double>(from[k]);
        to[k] = std::isfinite(value) ? encoded(value) : std::uint8_t{0};
      }
    }
  });
  return picture;
}

Image8 expose(const Image8& picture, double exposure_ev) {
  if (exposure_ev == 0) return picture;
  const double gain = math::exp2(exposure_ev);
  std::array<std::uint8_t, 256> exposed{};
  for (std::size_t i = 0; i < exposed.size(); ++i)
    exposed[i] = encoded(gain * linear_of_srgb(static_cast<double>(i) / 255));
  Image8 result = picture;
  const auto channels = static_cast<std::size_t>(picture.channels());
  const auto alpha = channels == 2 || channels == 4 ? channels - 1 : channels;
  for (std::size_t i = 0; i < result.values().size(); ++i) {
    if (i % channels != alpha) result.values()[i] = exposed[result.values()[i]];
  }
  return result;
}

vtkSmartPointer<vtkTexture> make_texture(const Image8& image) {
  const auto texture = texture_of(image, 3);
  texture->InterpolateOn();
  texture->MipmapOn();
  return texture;
}

vtkSmartPointer<vtkTexture> make_mask(const Image8& image) {
  const auto texture = texture_of(image, 4);
  texture->InterpolateOff();
  return texture;
}

void set_texture_coordinates(vtkPolyData& data, std::span<const glm::vec2> places) {
  const auto array = make_array<vtkFloatArray>("texture places", places.size(), 2);
  for (std::size_t i = 0; i < places.size(); ++i)
    array->SetTuple2(static_cast<vtkIdType>(i), static_cast<double>(places[i].x),
                     static_cast<double>(places[i].y));
  data.GetPointData()->SetTCoords(array);
}

Layer picture_layer(const std::string& name, const std::shared_ptr<const PictureFile>& file) {
  const Image8& picture = file->picture;
  Layer layer{.name = name, .kind = LayerKind::Picture, .data = make_points(4)};
  const auto width = static_cast<float>(picture.width());
  const auto height = static_cast<float>(picture.height());
  const std::array<float, 12> corner = {0, 0, 0, width, 0, 0, width, height, 0, 0, height, 0};
  std::ranges::copy(corner, coordinates(*layer.data).begin());
  constexpr std::array<glm::uvec3, 2> halves = {glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3)};
  set_triangles(*layer.data, halves);
  constexpr std::array<glm::vec2, 4> places = {glm::vec2(0, 0), {1, 0}, {1, 1}, {0, 1}};
  set_texture_coordinates(*layer.data, places);
  layer.texture = make_texture(picture);
  if (file->has_exposure) {
    layer.exposed = [file](double exposure_ev) {
      const bool is_light = !file->light.values().empty();
      return make_texture(is_light ? expose(file->light, exposure_ev)
                                   : expose(file->picture, exposure_ev));
    };
  }
  layer.facts.push_back(fmt::format("{} x {} px, {} channels", picture.width(), picture.height(),
                                    picture.channels()));
  return layer;
}

}  // namespace groundray
