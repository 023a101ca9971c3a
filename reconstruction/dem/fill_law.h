#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

// How far off filled heights are, private to this library.
namespace groundray {

/// A filled height where the true one is known.
struct FillError {
  float error_m = 0;
  float distance_cells = 0;  ///< to the nearest data
  float roughness_m = 0;     ///< of the ground about
  std::uint32_t trial = 0;
};

/// What ln(sd^2) of a filled height is made of: factors of 1, ln(distance to data in cells) and
/// ln(roughness of the ground about in m).
struct FillLaw {
  std::array<double, 3> factors{};

  double sd_m(double distance_cells, double roughness_m) const;
};

/// How well a law holds; NaN where nothing tells.
struct FillCover {
  double within_1sd = std::numeric_limits<double>::quiet_NaN();  ///< shares of errors
  double within_2sd = std::numeric_limits<double>::quiet_NaN();
  double rms_sds = std::numeric_limits<double>::quiet_NaN();  ///< root mean square of error / sd
};

/// Returns the law under which these errors are the likeliest, as normal ones of its sd; nothing
/// for fewer than 30. Distance and roughness raise sd, if anything. Ten errors' worth of belief
/// holds their powers near 3/2 and 2 of sd^2: the sum of ln(sd^2) + error^2 / sd^2 over all errors,
/// and of 5 (power - usual power)^2 over both, is least.
/// @see McCullagh, Nelder, Generalized linear models, 2nd ed. (1989), chapter 8: squared normal
///      errors are gamma variables.
std::optional<FillLaw> fit_law(std::span<const FillError> errors);

/// Returns how errors stand to a law; NaN without errors.
FillCover cover_of(std::span<const FillError> errors, const FillLaw& law);

}  // namespace groundray
