#pragma once

// Private to the library: the profile of the ground between samples.

namespace groundray {

/// Returns the height of the ground above its tangent at a sample, `places` cells away, per unit of
/// its second difference between cells: halfway between smooth ground, places² / 2, and a crease at
/// the sample, |places| / 2.
template <typename Number>
Number curvature_profile(const Number& places) noexcept {
  const Number size = places < Number{} ? -places : places;
  return 0.25F * size * (1 + size);
}

}  // namespace groundray
