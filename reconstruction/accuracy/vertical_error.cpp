#include "reconstruction/accuracy/vertical_error.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <utility>

#include "core/closest_point.h"
#include "core/model.h"

namespace groundray {
namespace {

// The height of the triangle's plane at a place.
double height_m(const TriangleMesh& mesh, std::uint32_t triangle, const glm::dvec3& place_m) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3 &a = mesh.vertices_m[t.x], b = mesh.vertices_m[t.y] - a,
                   c = mesh.vertices_m[t.z] - a, p = place_m - a;
  const double to_b = p.x * c.y - p.y * c.x, to_c = b.x * p.y - b.y * p.x;
  return a.z + (to_b * b.z + to_c * c.z) / (b.x * c.y - b.y * c.x);
}

}  // namespace

VerticalError vertical_error(const std::vector<glm::dvec3>& places_m, const TriangleMesh& surface) {
  TriangleMesh flat = surface;
  for (glm::dvec3& p_m : flat.vertices_m) p_m.z = 0;
  const ClosestPoint plan(std::move(flat));
  struct Apart {
    double above_m = 0, aside_m = 0;
  };
  std::vector<Apart> apart(places_m.size());
  const auto measure = [&](const tbb::blocked_range<std::size_t>& range) {
    std::uint32_t near = 0;  // neighbours in a mesh's order are often neighbours in space
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const glm::dvec3& p_m = places_m[i];
      const NearestPoint nearest = plan.nearest({p_m.x, p_m.y, 0}, near);
      near = nearest.triangle;
      apart[i] = {std::abs(p_m.z - height_m(surface, near, nearest.point)), nearest.distance_m};
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, apart.size(), 256), measure);
  VerticalError error;
  for (const Apart& one : apart) {
    error.largest_m = std::max(error.largest_m, one.above_m);
    error.aside_m = std::max(error.aside_m, one.aside_m);
    error.mean_m += one.above_m / static_cast<double>(apart.size());
    error.rms_m += one.above_m * one.above_m / static_cast<double>(apart.size());
  }
  error.rms_m = std::sqrt(error.rms_m);
  const ModelBounds bounds = bounds_of(surface);
  if (error.aside_m <= 1e-14 * glm::length(bounds.high_m - bounds.low_m)) error.aside_m = 0;
  return error;
}

}  // namespace groundray
