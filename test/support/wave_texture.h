#pragma once

#include <array>
#include <cmath>
#include <glm/vec2.hpp>
#include <numbers>

#include "core/image/image.h"
#include "core/random.h"

namespace groundray::testing {

/// Grey values from a sum of waves in all directions, with mean 0.5 and a range of 0 to 1 except
/// for rare peaks: defined at any position, and without repetition.
class WaveTexture {
 public:
  /// @param shortest_px  shortest wavelength; the longest is 12 times that.
  explicit WaveTexture(double shortest_px, Seed seed = {5}) {
    for (std::size_t i = 0; i < waves_.size(); ++i) {
      const RandomKey key{.seed = seed, .pulse = static_cast<std::uint32_t>(i)};
      const glm::dvec2 direction = random_uniform(key);
      const double share = static_cast<double>(i) / static_cast<double>(waves_.size() - 1);
      const double wavelength_px = shortest_px * std::pow(12, share);
      const double angle_rad = 2 * std::numbers::pi * direction.x;
      const double per_px = 2 * std::numbers::pi / wavelength_px;
      waves_[i] = {per_px * glm::dvec2(std::cos(angle_rad), std::sin(angle_rad)),
                   2 * std::numbers::pi * direction.y};
    }
  }

  double at(glm::dvec2 place) const {
    double sum = 0;
    for (const Wave& wave : waves_)
      sum += std::cos(wave.per_px.x * place.x + wave.per_px.y * place.y + wave.phase);
    return 0.5 + 0.04 * sum;
  }

  /// An image whose pixels show the texture at the position that `place_of` returns.
  template <typename PlaceOf>
  ImageF image(glm::ivec2 size_px, PlaceOf&& place_of) const {
    ImageF result(size_px.x, size_px.y, 1);
    for (int y = 0; y < size_px.y; ++y) {
      for (int x = 0; x < size_px.x; ++x)
        result.at(x, y)[0] = static_cast<float>(at(place_of(glm::dvec2(x, y))));
    }
    return result;
  }

 private:
  struct Wave {
    glm::dvec2 per_px{0};
    double phase = 0;
  };
  std::array<Wave, 24> waves_;
};

/// Adds independent noise to an image's values.
inline void add_noise(ImageF& image, double sd, Seed seed) {
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    const RandomKey key{.seed = seed, .pulse = static_cast<std::uint32_t>(i)};
    image.values()[i] += static_cast<float>(sd * random_normal(key).x);
  }
}

}  // namespace groundray::testing
