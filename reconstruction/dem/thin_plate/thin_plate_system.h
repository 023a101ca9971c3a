#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <vector>

#include "reconstruction/dem/thin_plate/thin_plate_energy.h"

// Equations of a plate through measured samples, private to this library.
namespace groundray {

/// Numbers of samples that are no unknowns of the equations; unknowns are numbered from 0 on.
constexpr std::int32_t known_sample = -1;   // has a height
constexpr std::int32_t absent_sample = -2;  // has no height, and none is computed

/// Raster with the role of each sample. The spans must outlive everything made from it.
struct ThinPlateRaster {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};
  std::span<const float> heights_m;
  std::span<const std::int32_t> numbers;  ///< of each sample: known_sample, absent_sample or >= 0

  std::size_t index(glm::ivec2 at) const noexcept {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(at.x);
  }
  glm::ivec2 place(std::uint32_t sample) const noexcept {
    return {static_cast<int>(sample) % size.x, static_cast<int>(sample) / size.x};
  }
  bool contains(glm::ivec2 at) const noexcept {
    return at.x >= 0 && at.y >= 0 && at.x < size.x && at.y < size.y;
  }
  bool is_known(glm::ivec2 at) const noexcept {
    return contains(at) && numbers[index(at)] == known_sample;
  }
};

/// Returns the sets of wanted samples that are connected through neighbours, eight for each:
/// numbers of samples, ascending; sets in the order of their first samples.
/// @param is_wanted  0 or 1 for each sample of the raster.
std::vector<std::vector<std::uint32_t>> linked_samples(glm::ivec2 size,
                                                       std::span<const std::uint8_t> is_wanted);

/// Returns likewise the sets that one system of equations must contain: samples at most three steps
/// along columns and rows apart.
std::vector<std::vector<std::uint32_t>> coupled_samples(glm::ivec2 size,
                                                        std::span<const std::uint8_t> is_wanted);

/// Returns whether any sample of the set has a known height among its eight neighbours.
bool has_known_neighbour(glm::ivec2 size, std::span<const std::int32_t> numbers,
                         std::span<const std::uint32_t> set);

/// Heights below bounds.
struct BoundedThinPlate {
  std::vector<double> heights_m;
  std::size_t at_bound = 0;  ///< number of heights at their bounds
  bool is_best = true;       ///< false: within all bounds, but possibly far from the minimum
};

/// System of equations for the heights of some samples that minimise the energy of ThinPlateEnergy
/// while all other samples keep theirs. Derivatives are differences over neighbours, mixed ones
/// over blocks. Terms that involve a sample without height, or reach over the edge, are omitted:
/// there the plate is free.
/// @see Terzopoulos, Regularization of inverse visual problems involving discontinuities, PAMI 8
///      (1986); Smith, Wessel, Gridding with continuous curvature splines in tension, Geophysics 55
///      (1990).
class ThinPlateSystem {
 public:
  /// @param samples  of the raster, ascending: all that are numbered from 0 on, in that order, or a
  ///        subset that is not coupled to the others. Each must be connected to a known sample
  ///        through neighbours, eight for each.
  ThinPlateSystem(const ThinPlateRaster& raster, std::vector<std::uint32_t> samples);
  ~ThinPlateSystem();
  ThinPlateSystem(const ThinPlateSystem&) = delete;
  ThinPlateSystem& operator=(const ThinPlateSystem&) = delete;

  /// Returns the height of each sample. Not thread-safe.
  std::vector<double> solve(const ThinPlateEnergy& form);

  /// Returns the height of each sample, none above its bound: the minimum of the same energy under
  /// these bounds. The result of the previous call serves as the start.
  /// @param most_m  bound of each sample; NaN for none.
  BoundedThinPlate solve_below(const ThinPlateEnergy& form, std::span<const double> most_m);

 private:
  struct Equations;
  ThinPlateRaster raster_;
  std::vector<std::uint32_t> samples_;
  std::unique_ptr<Equations> equations_;
};

}  // namespace groundray
