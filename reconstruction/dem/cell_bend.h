#pragma once

// Private to the library: the shape of ground between samples.

namespace groundray {

/// Returns by which part of its second difference between cells ground rises above its tangent at a
/// sample, `places` cells away: between that of smooth ground, which is places² / 2, and that of
/// ground with a crease at the sample, |places| / 2.
template <typename Number>
Number cell_bend(const Number& places) noexcept {
  const Number size = places < Number{} ? -places : places;
  return 0.25F * size * (1 + size);
}

}  // namespace groundray
