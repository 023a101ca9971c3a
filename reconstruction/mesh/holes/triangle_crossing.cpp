// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
#include "reconstruction/mesh/holes/triangle_crossing.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <ranges>

namespace groundray {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Corners = std::array<glm::dvec3, 3>;

// Bounding box of a triangle, as CGAL requires.
struct Box : CGAL::Box_intersection_d::Box_d<double, 3, CGAL::Box_intersection_d::ID_NONE> {
  std::uint32_t triangle;

  Box(const Corners& at, std::uint32_t number)
      : Box_d(CGAL::Bbox_3(least(at).x, least(at).y, least(at).z, most(at).x, most(at).y,
                           most(at).z)),
        triangle(number) {}
  std::uint32_t id() const { return triangle; }

 private:
  static glm::dvec3 least(const Corners& at) { return glm::min(at[0], glm::min(at[1], at[2])); }
  static glm::dvec3 most(const Corners& at) { return glm::max(at[0], glm::max(at[1], at[2])); }
};

Point to_cgal(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

Kernel::Triangle_3 triangle_of(const Corners& at) {
  return {to_cgal(at[0]), to_cgal(at[1]), to_cgal(at[2])};
}

bool is_needle(const Corners& at) {
  return CGAL::collinear(to_cgal(at[0]), to_cgal(at[1]), to_cgal(at[2]));
}

// Moves the corners that both share to the front, in the same order, and returns their number.
std::size_t align(Corners& a, Corners& b) {
  std::size_t shared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = std::find(b.begin() + static_cast<std::ptrdiff_t>(shared), b.end(), a[i]);
    if (found == b.end()) continue;
    std::iter_swap(found, b.begin() + static_cast<std::ptrdiff_t>(shared));
    std::swap(a[i], a[shared]);
    ++shared;
  }
  return shared;
}

bool reaches(const Corners& triangle, const Corners& far) {
  return CGAL::do_intersect(triangle_of(triangle),
                            Kernel::Segment_3(to_cgal(far[1]), to_cgal(far[2])));
}

bool do_cross(Corners a, Corners b) {
  if (is_needle(a) || is_needle(b)) return false;
  switch (align(a, b)) {
    case 0:
      return CGAL::do_intersect(triangle_of(a), triangle_of(b));
    case 1:  // the edge opposite to the shared corner must not touch the other triangle
      return reaches(a, b) || reaches(b, a);
    case 2: {
      const Point p = to_cgal(a[0]), q = to_cgal(a[1]), r = to_cgal(a[2]), s = to_cgal(b[2]);
      return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
    }
    default:
      return true;
  }
}

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(const TriangleMesh& mesh,
                                                               std::uint32_t first) {
  const auto corners = [&](std::uint32_t t) {
    const glm::uvec3& v = mesh.triangles[t];
    return Corners{mesh.vertices_m[v.x], mesh.vertices_m[v.y], mesh.vertices_m[v.z]};
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  const auto look = [&](const Box& last, const Box& any) {
    if (any.triangle >= last.triangle) return;
    if (do_cross(corners(any.triangle), corners(last.triangle)))
      found.emplace_back(any.triangle, last.triangle);
  };
  const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<Box> last, some;
  for (std::uint32_t t = first; t < triangles; ++t) last.emplace_back(corners(t), t);
  constexpr std::uint32_t at_once = 1'000'000;  // limits memory
  for (std::uint32_t begin = 0; begin < triangles && !last.empty(); begin += at_once) {
    some.clear();
    for (std::uint32_t t = begin; t < std::min(triangles, begin + at_once); ++t)
      some.emplace_back(corners(t), t);
    CGAL::box_intersection_d(last.begin(), last.end(), some.begin(), some.end(), look);
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace groundray
