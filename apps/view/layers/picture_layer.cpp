#include "apps/view/layers/picture_layer.h"

#include <fmt/format.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/image/srgb.h"

namespace groundray {
namespace {

// Returns the 99.5 % quantile of the pixels' brightest channels.
float white_level(const ImageF& light) {
  std::vector<float> brightest;
  const auto channels = static_cast<std::size_t>(std::min(light.channels(), 3));
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      const float most = *std::ranges::max_element(light.at(x, y).first(channels));
      if (std::isfinite(most)) brightest.push_back(most);
    }
  }
  if (brightest.empty()) return 1;
  const auto rank = static_cast<std::ptrdiff_t>(brightest.size() - 1 - brightest.size() / 200);
  std::ranges::nth_element(brightest, brightest.begin() + rank);
  return std::max(brightest[static_cast<std::size_t>(rank)], 1e-20f);
}

}  // namespace

vtkSmartPointer<vtkTexture> make_texture(const Image8& image) {
  const int channels = image.channels();
  auto bytes = vtkSmartPointer<vtkUnsignedCharArray>::New();
  bytes->SetNumberOfComponents(3);
  bytes->SetNumberOfTuples(vtkIdType{image.width()} * image.height());
  auto* to = bytes->GetPointer(0);
  for (int y = image.height() - 1; y >= 0; --y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto pixel = image.at(x, y);
      for (std::size_t k = 0; k < 3; ++k) *to++ = pixel[channels >= 3 ? k : 0];
    }
  }
  auto content = vtkSmartPointer<vtkImageData>::New();
  content->SetDimensions(image.width(), image.height(), 1);
  content->GetPointData()->SetScalars(bytes);
  auto texture = vtkSmartPointer<vtkTexture>::New();
  texture->SetInputData(content);
  texture->SetColorModeToDirectScalars();
  texture->InterpolateOn();
  texture->MipmapOn();
  texture->SetWrap(vtkTexture::ClampToEdge);
  return texture;
}

void set_texture_places(vtkPolyData& data, std::span<const glm::vec2> places) {
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName("texture places");
  array->SetNumberOfComponents(2);
  array->SetNumberOfTuples(static_cast<vtkIdType>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i)
    array->SetTuple2(static_cast<vtkIdType>(i), static_cast<double>(places[i].x),
                     static_cast<double>(places[i].y));
  data.GetPointData()->SetTCoords(array);
}

Layer picture_layer(const std::string& name, const Image8& picture) {
  Layer layer{.name = name, .kind = LayerKind::Picture, .data = make_points(4)};
  const auto width = static_cast<float>(picture.width());
  const auto height = static_cast<float>(picture.height());
  const std::array<float, 12> corner = {0, 0, 0, width, 0, 0, width, height, 0, 0, height, 0};
  std::ranges::copy(corner, coordinates(*layer.data).begin());
  constexpr std::array<glm::uvec3, 2> halves = {glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3)};
  set_triangles(*layer.data, halves);
  constexpr std::array<glm::vec2, 4> places = {glm::vec2(0, 0), {1, 0}, {1, 1}, {0, 1}};
  set_texture_places(*layer.data, places);
  layer.texture = make_texture(picture);
  layer.facts.push_back(fmt::format("{} x {} px, {} channels", picture.width(), picture.height(),
                                    picture.channels()));
  return layer;
}

Image8 expose(const ImageF& light) {
  const float white = white_level(light);
  Image8 picture(light.width(), light.height(), light.channels() >= 3 ? 3 : 1);
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      const auto from = light.at(x, y);
      const auto to = picture.at(x, y);
      for (std::size_t k = 0; k < to.size(); ++k) {
        const double share = static_cast<double>(from[k]) / static_cast<double>(white);
        to[k] = std::isfinite(share) ? static_cast<std::uint8_t>(std::lround(
                                           255 * srgb_of_linear(std::clamp(share, 0.0, 1.0))))
                                     : std::uint8_t{0};
      }
    }
  }
  return picture;
}

}  // namespace groundray
