#include "reconstruction/dem/fill/ground_roughness.h"

#include <cmath>
#include <cstddef>
#include <glm/common.hpp>

namespace groundray {
namespace {

constexpr double usual_terms = 8;

}  // namespace

GroundRoughness::GroundRoughness(glm::ivec2 size, std::span<const float> heights_m)
    : size_(size),
      sums_(static_cast<std::size_t>(size.x + 1) * static_cast<std::size_t>(size.y + 1)) {
  const std::ptrdiff_t wide = size.x;
  for (int row = 0; row < size.y; ++row) {
    Sum line;
    for (int column = 0; column < size.x; ++column) {
      const float* z = heights_m.data() + row * wide + column;
      const auto add = [&line](double difference_m) {
        if (std::isnan(difference_m)) return;
        line.squares_m2 += difference_m * difference_m;
        line.count += 1;
      };
      if (column > 0 && column + 1 < size.x) add(double(z[-1]) - 2 * double(z[0]) + double(z[1]));
      if (row > 0 && row + 1 < size.y) add(double(z[-wide]) - 2 * double(z[0]) + double(z[wide]));
      const auto above = static_cast<std::size_t>(row * (wide + 1) + column + 1);
      const Sum& before = sums_[above];
      sums_[above + static_cast<std::size_t>(wide) + 1] = {before.squares_m2 + line.squares_m2,
                                                           before.count + line.count};
    }
  }
}

GroundRoughness::Sum GroundRoughness::sum_in(glm::ivec2 low, glm::ivec2 high) const noexcept {
  const auto at = [this](int column, int row) -> const Sum& {
    return sums_[static_cast<std::size_t>(row) * static_cast<std::size_t>(size_.x + 1) +
                 static_cast<std::size_t>(column)];
  };
  const Sum &a = at(low.x, low.y), &b = at(high.x, low.y), &c = at(low.x, high.y),
            &d = at(high.x, high.y);
  return {d.squares_m2 - b.squares_m2 - c.squares_m2 + a.squares_m2,
          d.count - b.count - c.count + a.count};
}

double GroundRoughness::at_m(glm::ivec2 sample, int cells, double usual_m) const noexcept {
  const Sum sum =
      sum_in(glm::max(sample - cells, glm::ivec2(0)), glm::min(sample + cells + 1, size_));
  const double squares_m2 = std::fmax(sum.squares_m2, 0) + usual_terms * usual_m * usual_m;
  return std::sqrt(squares_m2 / (sum.count + usual_terms));
}

double GroundRoughness::usual_m() const noexcept {
  const Sum sum = sum_in(glm::ivec2(0), size_);
  return sum.count > 0 ? std::sqrt(std::fmax(sum.squares_m2, 0) / sum.count) : 0;
}

}  // namespace groundray
