// The angle is approximated by Cephes' atan, which the compiler vectorises, to 1e-15 of itself. So
// is std::atan2; they could therefore round to different floats only where the approximation is
// that near to the middle between two floats: there std::atan2 itself decides.
#include "apps/python/incidence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace groundray::python {
namespace {

constexpr double error = 4e-15;  // of an angle, relative; several times that of both functions

// Returns the angle in [0, pi / 2]; NaN if both are 0.
double angle_rad(double sine, double cosine) noexcept {
  constexpr double turned = 0.41421356237309503;  // tan(pi / 8)
  const double less = std::min(sine, cosine), more = std::max(sine, cosine);
  const bool turns = less > turned * more;  // by pi / 4, so that x is small
  const double x = (turns ? less - more : less) / (turns ? less + more : more);
  const double z = x * x;
  const double p = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z -
                     7.500855792314704667340e1) *
                        z -
                    1.228866684490136173410e2) *
                       z -
                   6.485021904942025371773e1;
  const double q = ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z +
                     4.328810604912902668951e2) *
                        z +
                    4.853903996359136964868e2) *
                       z +
                   1.945506571482613964425e2;
  const double angle = (turns ? std::numbers::pi / 4 : 0.0) + (x + x * (z * p / q));
  return sine > cosine ? std::numbers::pi / 2 - angle : angle;
}

}  // namespace

void write_angles(std::span<const double> sines, std::span<const double> cosines,
                  std::span<float> angles_rad) noexcept {
  const std::size_t count = angles_rad.size();
  bool all_certain = true;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = angle_rad(sines[i], cosines[i]);
    const auto low = static_cast<float>(angle * (1 - error));
    angles_rad[i] = low;
    all_certain &= low == static_cast<float>(angle * (1 + error));
  }
  if (all_certain) return;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = angle_rad(sines[i], cosines[i]);
    if (!(angles_rad[i] == static_cast<float>(angle * (1 + error))))
      angles_rad[i] = static_cast<float>(std::atan2(sines[i], cosines[i]));
  }
}

}  // namespace groundray::python
