#pragma once

namespace groundray {

/// What a surface z through missing samples has the least of:
///     (1 - tension) int |D2 z|^2 + tension / h^2 int |D z|^2 + smoothness h^2 int |D3 z|^2,
/// where Dk z are all derivatives of order k and h^2 is the area of a cell. Tension pulls towards a
/// soap film, which suits rough ground; smoothness has the curvature of the ground round about go
/// on, which suits smooth ground. Without both it is a thin plate. Quadratic surfaces are met
/// exactly without tension, planes always.
struct PlateForm {
  double tension = 0;     ///< 0 to below 1
  double smoothness = 0;  ///< 0 or more

  friend bool operator==(const PlateForm&, const PlateForm&) = default;
};

}  // namespace groundray
