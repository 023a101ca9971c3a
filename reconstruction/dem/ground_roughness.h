#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

// How rough ground is round about, private to this library.
namespace groundray {

/// Root mean squares of second differences between samples that have heights, over any box.
class GroundRoughness {
 public:
  /// @param heights_m  of size.x * size.y samples, row by row; NaN for none.
  GroundRoughness(glm::ivec2 size, std::span<const float> heights_m);

  /// Returns the root mean square within `cells` columns and rows of a sample, metres: of all that
  /// there are, and some more of `usual_m` lest it hang on a few.
  double at_m(glm::ivec2 sample, int cells, double usual_m) const noexcept;

  /// Returns that of the whole raster, metres; 0 without any.
  double usual_m() const noexcept;

 private:
  struct Sum {
    double squares_m2 = 0;
    double count = 0;
  };
  Sum sum_in(glm::ivec2 low, glm::ivec2 high) const noexcept;

  glm::ivec2 size_;
  std::vector<Sum> sums_;  // of all samples before, in columns and rows
};

}  // namespace groundray
