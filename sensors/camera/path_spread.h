#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "core/image/image.h"

namespace groundray {

/// Sums over the paths of a pixel, which are two independently scrambled Sobol nets. Each net is
/// split into up to four consecutive parts, which are nets too.
class PathSums {
 public:
  static constexpr std::uint32_t nets = 2, most_parts = 4;

  /// Position of a path among those of its pixel.
  struct Place {
    std::uint32_t net;    ///< 0 or 1
    std::uint32_t index;  ///< in its net
    std::uint32_t slot;   ///< net and part, for `add`
  };
  /// Returns the position of path `i` of `count`, a power of two. A single path is in the first
  /// net.
  static Place place(std::uint32_t i, std::uint32_t count) noexcept;

  void add(std::uint32_t slot, const glm::dvec3& radiance) noexcept {
    sums_[slot].radiance += radiance;
    sums_[slot].count += 1;
  }
  double count() const noexcept { return total().count; }
  glm::dvec3 mean() const noexcept { return total().mean(); }
  /// Returns the unbiased estimate of the variance of the mean, of one degree of freedom: a quarter
  /// of the squared difference of the nets, if both have equally many paths.
  glm::dvec3 between_nets() const noexcept;
  /// Returns the variance that the mean would have if the parts of each net were independent.
  /// Parts of one net complement each other, so it is too large.
  glm::dvec3 within_nets() const noexcept;

 private:
  struct Sum {
    glm::dvec3 radiance{0};
    double count = 0;
    glm::dvec3 mean() const noexcept { return count > 0 ? radiance / count : glm::dvec3(0); }
    glm::dvec3 square_off(const glm::dvec3& from) const noexcept {
      const glm::dvec3 off = radiance - count * from;
      return off * off;
    }
  };
  Sum of_net(std::uint32_t net) const noexcept;
  Sum total() const noexcept;

  std::array<Sum, std::size_t{nets} * most_parts> sums_;
};

/// Spreads of the paths of each pixel.
struct PathSpreads {
  ImageF paths;    ///< number of paths, 0 for pixels without any
  ImageF between;  ///< PathSums::between_nets, three channels
  ImageF within;   ///< PathSums::within_nets, likewise
};

/// Returns the standard errors of the pixels' means, three channels: 0 without a path, infinite for
/// a single one. A pixel's variance is a weighted mean of three estimates: its own difference of
/// nets; its spread within nets, scaled by the ratio of both over the pixels around; and the mean
/// difference of nets over the pixels around. See docs/theory/camera_light.md, standard error.
ImageF standard_errors(const PathSpreads& spreads);

}  // namespace groundray
