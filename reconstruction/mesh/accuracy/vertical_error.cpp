#include "reconstruction/mesh/accuracy/vertical_error.h"

#define BOOST_ALLOW_DEPRECATED_HEADERS  // by Boost.Geometry itself

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/geometry/strategies/strategies.hpp>
#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <utility>

#include "core/model/model.h"
#include "core/tracing/closest_point.h"

namespace groundray {
namespace {

namespace geometry = boost::geometry;
using PlanPoint = geometry::model::d2::point_xy<double>;
using PlanBox = geometry::model::box<PlanPoint>;
using PlanTree =
    geometry::index::rtree<std::pair<PlanBox, std::uint32_t>, geometry::index::rstar<8>>;

// Returns the triangles of a mesh by their bounding boxes in plan view.
PlanTree plan_tree(const TriangleMesh& mesh) {
  std::vector<PlanTree::value_type> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y],
                     &c = mesh.vertices_m[t.z];
    const glm::dvec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    boxes.emplace_back(PlanBox({low.x, low.y}, {high.x, high.y}), boxes.size());
  }
  return PlanTree(boxes);
}

// Returns the height of the triangle's plane at a position.
double height_m(const TriangleMesh& mesh, std::uint32_t triangle, const glm::dvec3& place_m) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3 &a = mesh.vertices_m[t.x], b = mesh.vertices_m[t.y] - a,
                   c = mesh.vertices_m[t.z] - a, p = place_m - a;
  const double to_b = p.x * c.y - p.y * c.x, to_c = b.x * p.y - b.y * p.x;
  return a.z + (to_b * b.z + to_c * c.z) / (b.x * c.y - b.y * c.x);
}

}  // namespace

std::vector<VerticalDistance> vertical_distances(const std::vector<glm::dvec3>& places_m,
                                                 const TriangleMesh& surface) {
  TriangleMesh flat = surface;
  for (glm::dvec3& p_m : flat.vertices_m) p_m.z = 0;
  const ClosestPoint plan(std::move(flat));
  const PlanTree tree = plan_tree(surface);
  const ModelBounds bounds = bounds_of(surface);
  const double rounding_m = 1e-14 * glm::length(bounds.high_m - bounds.low_m);
  std::vector<VerticalDistance> distances(places_m.size());
  const auto measure = [&](const tbb::blocked_range<std::size_t>& range) {
    std::uint32_t near = 0;  // consecutive vertices are often close in space
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const glm::dvec3& p_m = places_m[i];
      const glm::dvec3 place_m(p_m.x, p_m.y, 0);
      const NearestPoint nearest = plan.nearest(place_m, near);
      near = nearest.triangle;
      const double reach_m = nearest.distance_m + 4 * rounding_m;
      double above_m = std::abs(p_m.z - height_m(surface, near, nearest.point));
      const auto look_at = [&](const PlanTree::value_type& entry) {
        const glm::uvec3& t = surface.triangles[entry.second];
        const std::vector<glm::dvec3>& corners_m = plan.mesh().vertices_m;
        const glm::dvec3 to_m =
            vector_to_triangle(place_m, corners_m[t.x], corners_m[t.y], corners_m[t.z]);
        if (!(glm::length(to_m) <= reach_m)) return;
        above_m =
            std::min(above_m, std::abs(p_m.z - height_m(surface, entry.second, place_m + to_m)));
      };
      const double wide_m = reach_m + rounding_m;
      tree.query(geometry::index::intersects(
                     PlanBox({p_m.x - wide_m, p_m.y - wide_m}, {p_m.x + wide_m, p_m.y + wide_m})),
                 boost::make_function_output_iterator(look_at));
      distances[i] = {above_m, nearest.distance_m <= rounding_m ? 0 : nearest.distance_m};
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, distances.size(), 256), measure);
  return distances;
}

VerticalError sum_up(const std::vector<VerticalDistance>& distances) {
  VerticalError error;
  const auto count = static_cast<double>(distances.size());
  for (const VerticalDistance& one : distances) {
    error.largest_m = std::max(error.largest_m, one.above_m);
    error.aside_m = std::max(error.aside_m, one.aside_m);
    error.mean_m += one.above_m / count;
    error.rms_m += one.above_m * one.above_m / count;
  }
  error.rms_m = std::sqrt(error.rms_m);
  return error;
}

VerticalError vertical_error(const std::vector<glm::dvec3>& places_m, const TriangleMesh& surface) {
  return sum_up(vertical_distances(places_m, surface));
}

}  // namespace groundray
