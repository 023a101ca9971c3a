#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

// Error model of filled heights, private to this library.
namespace groundray {

/// Error of a filled height where the true one is known.
struct FillError {
  float error_m = 0;
  float distance_cells = 0;  ///< distance to the nearest data
  float roughness_m = 0;     ///< roughness of the surrounding ground
  std::uint32_t trial = 0;
};

/// Fill error model: ln(sd^2) of a filled height is the sum of `factors` times 1, ln(distance to
/// data in cells) and ln(roughness of the surrounding ground in m).
struct FillErrorModel {
  std::array<double, 3> factors{};

  double sd_m(double distance_cells, double roughness_m) const;
};

/// Agreement of errors with a model; NaN if unknown.
struct FillCover {
  double within_1sd = std::numeric_limits<double>::quiet_NaN();  ///< fractions of errors
  double within_2sd = std::numeric_limits<double>::quiet_NaN();
  double rms_sds = std::numeric_limits<double>::quiet_NaN();  ///< root mean square of error / sd
};

/// Returns the model with the maximum likelihood for the errors, which are taken as normal; nothing
/// for fewer than 30 errors. Sd never decreases with distance or roughness. A prior with the weight
/// of ten errors keeps the exponents of these in sd^2 near 3/2 and 2: minimises the sum of ln(sd^2)
/// + error^2 / sd^2 over all errors, and of 5 (exponent - usual exponent)^2 over both exponents.
/// @see McCullagh, Nelder, Generalized linear models, 2nd ed. (1989), chapter 8: squared normal
///      errors are gamma variables.
std::optional<FillErrorModel> fit_error_model(std::span<const FillError> errors);

/// Returns the agreement of errors with a model; NaN without errors.
FillCover cover_of(std::span<const FillError> errors, const FillErrorModel& model);

/// Returns the number of columns and rows around a sample, at a distance from data, over which its
/// roughness is averaged.
int roughness_reach(double distance_cells) noexcept;

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
