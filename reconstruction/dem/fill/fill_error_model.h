#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

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
std::optional<FillErrorModel> fit_law(std::span<const FillError> errors);

/// Returns the agreement of errors with a model; NaN without errors.
FillCover cover_of(std::span<const FillError> errors, const FillErrorModel& law);

}  // namespace groundray
