#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <experimental/simd>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace groundray {

/// Four numbers that are computed at once, one in each lane. Function templates over `Real`,
/// which is double or Pack, compute the same bits for one number as for each lane; they choose by
/// `select` instead of branches.
using Pack = std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, 4>>;
/// Number of lanes.
inline constexpr std::size_t pack_size = Pack::size();
/// A word of 32 bits in each lane.
using PackOfWords = std::experimental::rebind_simd_t<std::uint32_t, Pack>;

/// A pair of numbers, or of packs.
template <typename Real>
using Vec2 = glm::vec<2, Real>;
/// A vector of numbers, or of packs.
template <typename Real>
using Vec3 = glm::vec<3, Real>;

/// Returns the pack of numbers that `get` returns for the lanes 0, 1, ...
template <typename Get>
Pack pack_of(const Get& get) {
  return Pack([&](auto lane) { return static_cast<double>(get(std::size_t{lane})); });
}
/// Returns the vectors that `get` returns for the lanes.
template <typename Get>
Vec3<Pack> vectors_of(const Get& get) {
  return {pack_of([&](std::size_t i) { return get(i).x; }),
          pack_of([&](std::size_t i) { return get(i).y; }),
          pack_of([&](std::size_t i) { return get(i).z; })};
}
/// Returns the vector of a lane.
inline glm::dvec3 vector_at(const Vec3<Pack>& all, std::size_t lane) {
  return {all.x[lane], all.y[lane], all.z[lane]};
}
/// Sets the vector of a lane.
inline void set_vector(Vec3<Pack>& all, std::size_t lane, const glm::dvec3& one) {
  all.x[lane] = one.x;
  all.y[lane] = one.y;
  all.z[lane] = one.z;
}

/// Returns `a` where the condition holds, else `b`.
inline double select(bool condition, double a, double b) noexcept { return condition ? a : b; }
/// Returns the same for each lane.
inline Pack select(const Pack::mask_type& condition, const Pack& a, Pack b) noexcept {
  where(condition, b) = a;
  return b;
}
/// Returns the same for vectors.
template <typename Condition, typename Real>
Vec3<Real> select(const Condition& condition, const Vec3<Real>& a, const Vec3<Real>& b) noexcept {
  return {select(condition, a.x, b.x), select(condition, a.y, b.y), select(condition, a.z, b.z)};
}

// What follows glm has for vectors of double, float and int alone. The operations are glm's, in its
// order.

/// Returns the dot product.
template <typename Real>
Real dot_of(const Vec3<Real>& a, const Vec3<Real>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// Returns the cross product.
template <typename Real>
Vec3<Real> cross_of(const Vec3<Real>& a, const Vec3<Real>& b) noexcept {
  return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}
/// Returns the vector of length 1 in the same direction.
template <typename Real>
Vec3<Real> unit_of(const Vec3<Real>& v) noexcept {
  using std::sqrt;
  return v * (Real(1.0) / sqrt(dot_of(v, v)));
}
/// Returns the largest component.
template <typename Real>
Real largest_of(const Vec3<Real>& v) noexcept {
  using std::max;
  return max(max(v.x, v.y), v.z);
}

}  // namespace groundray
