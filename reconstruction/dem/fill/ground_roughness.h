#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

// Roughness of the surrounding ground, private to this library.
namespace groundray {

/// Root mean square of second differences between samples with heights, over any box.
class GroundRoughness {
 public:
  /// @param heights_m  size.x * size.y heights in row order; NaN for none.
  GroundRoughness(glm::ivec2 size, std::span<const float> heights_m);

  /// Returns the root mean square within `cells` columns and rows of a sample, metres. Some terms
  /// of `usual_m` are added, so that it does not depend on a few differences.
  double at_m(glm::ivec2 sample, int cells, double usual_m) const noexcept;

  /// Returns the root mean square of the whole raster, metres; 0 without differences.
  double usual_m() const noexcept;

 private:
  struct Sum {
    double squares_m2 = 0;
    double count = 0;
  };
  Sum sum_in(glm::ivec2 low, glm::ivec2 high) const noexcept;

  glm::ivec2 size_;
  std::vector<Sum> sums_;  // summed-area table
};

}  // namespace groundray
