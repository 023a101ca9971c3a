#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <vector>

#include "reconstruction/dem/plate_form.h"

// The equations of a plate laid through what was measured, private to this library.
namespace groundray {

/// What a sample is that has no place in the equations; those that have are numbered from 0 on.
constexpr std::int32_t plate_known = -1;   // it has a height
constexpr std::int32_t plate_absent = -2;  // it has none, and none is looked for

/// A raster as the plate sees it. The spans must outlive what is made of it.
struct PlateRaster {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};
  std::span<const float> heights_m;
  std::span<const std::int32_t> numbers;  ///< of each sample: plate_known, plate_absent or >= 0
};

/// Returns the sets of samples, ascending, that one system of equations has to hold: those that are
/// at most three steps along columns and rows apart.
/// @param is_wanted  of each sample of the raster: 0 or 1.
std::vector<std::vector<std::uint32_t>> coupled_samples(glm::ivec2 size,
                                                        std::span<const std::uint8_t> is_wanted);

/// Returns whether a sample of the set has a neighbour, of eight, with a height.
bool has_known_neighbour(glm::ivec2 size, std::span<const std::int32_t> numbers,
                         std::span<const std::uint32_t> set);

/// Heights below bounds.
struct BoundedPlate {
  std::vector<double> heights_m;
  std::size_t at_bound = 0;  ///< how many are held down
  bool is_best = true;       ///< else within all bounds, but maybe far from the least
};

/// The heights of some samples that have the least of what PlateForm tells where all other samples
/// keep theirs. Derivatives are differences over neighbours, mixed ones over blocks. Terms that
/// touch a sample without height, or reach over the edge, are left out: there the plate is free.
/// @see Terzopoulos, Regularization of inverse visual problems involving discontinuities, PAMI 8
///      (1986); Smith, Wessel, Gridding with continuous curvature splines in tension, Geophysics 55
///      (1990).
class PlateSystem {
 public:
  /// @param samples  of the raster, ascending: all that are numbered from 0 on, in that order, or
  ///                 those that nothing couples to the others. Each must be linked to a known one
  ///                 by neighbours, eight for each.
  PlateSystem(const PlateRaster& raster, std::vector<std::uint32_t> samples);
  ~PlateSystem();
  PlateSystem(const PlateSystem&) = delete;
  PlateSystem& operator=(const PlateSystem&) = delete;

  /// Returns the height of each sample. For one thread.
  std::vector<double> solve(const PlateForm& form);

  /// Returns the height of each sample, none above its bound: the least of the same under these
  /// bounds. What the call before returned serves as a start.
  /// @param most_m  of each sample; NaN for none.
  BoundedPlate solve_below(const PlateForm& form, std::span<const double> most_m);

 private:
  struct Equations;
  PlateRaster raster_;
  std::vector<std::uint32_t> samples_;
  std::unique_ptr<Equations> equations_;
};

}  // namespace groundray
