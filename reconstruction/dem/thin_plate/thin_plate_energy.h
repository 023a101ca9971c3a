#pragma once

namespace groundray {

/// Form of a fill: the surface z through missing samples minimises the energy
///     (1 - tension) int |D2 z|^2 + tension / h^2 int |D z|^2 + smoothness h^2 int |D3 z|^2,
/// where Dk z are all derivatives of order k and h^2 is the area of a cell. Tension pulls towards a
/// membrane (soap film), which suits rough ground; smoothness continues the curvature of the
/// surrounding ground, which suits smooth ground. Without both it is a thin plate. Quadratic
/// surfaces are reproduced exactly without tension, planes always.
struct ThinPlateEnergy {
  double tension = 0;     ///< 0 to below 1
  double smoothness = 0;  ///< 0 or more

  friend bool operator==(const ThinPlateEnergy&, const ThinPlateEnergy&) = default;
};

}  // namespace groundray
