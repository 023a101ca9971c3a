#include "terrain/scatter/adsorption.h"

#include <numbers>

namespace groundray {
namespace {

using std::numbers::pi;
using std::numbers::sqrt3;

// Jamming limit: the coverage at which adsorption ends. Feder (1980), Hinrichsen et al. (1986) and
// the review by Evans, Random and cooperative sequential adsorption (1993), agree on these digits.
constexpr double jammed = 0.547;

// With x = coverage / jammed, the free fraction is (1 + a1 x + a2 x^2 + ...) (1 - x)^3. It vanishes
// at x = 1 as Pomeau (1980) and Swendsen (1981) showed. Its expansion to third order is exact if it
// equals 1 - 4 jammed x + s2 x^2 + s3 x^3 (Schaaf and Talbot's equation 31), which determines a1 to
// a3.
constexpr double s2 = 6 * sqrt3 / pi * jammed * jammed;
constexpr double s3 = (40 / (sqrt3 * pi) - 176 / (3 * pi * pi)) * jammed * jammed * jammed;
constexpr double a1 = 3 - 4 * jammed;
constexpr double a2 = s2 - 3 + 3 * a1;
constexpr double a3 = s3 + 1 - 3 * a1 + 3 * a2;

// With a4 = a5 = a6 = 0, as Schaaf and Talbot propose, coverages are up to 1.7 % too high. Our a4
// to a6 are fitted to the coverage of 120 squares of 1000 x 1000 diameters
// (docs/reference/scatter.md).
constexpr double a4 = -0.19349882;
constexpr double a5 = -0.05172045;
constexpr double a6 = -1.26902944;

}  // namespace

double free_share(double coverage) noexcept {
  const double x = coverage / jammed;
  const double room = 1 - x;
  return (1 + x * (a1 + x * (a2 + x * (a3 + x * (a4 + x * (a5 + x * a6)))))) * room * room * room;
}

double thrown_for(double coverage) noexcept {
  // Simpson's rule; its error is below 1e-9 here.
  constexpr int steps = 256;
  const double step = coverage / steps;
  double sum = 1 / free_share(0) + 1 / free_share(coverage);
  for (int i = 1; i < steps; ++i) sum += (i % 2 == 1 ? 4 : 2) / free_share(i * step);
  return sum * step / 3;
}

}  // namespace groundray
