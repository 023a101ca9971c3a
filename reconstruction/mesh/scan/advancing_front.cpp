// This file uses parts of CGAL that are under GPL-3.0-or-later: see the licence section of README.
#include "reconstruction/mesh/scan/advancing_front.h"

#include "reconstruction/mesh/scan/ascending_memory.h"
// Makes CGAL's comparisons of addresses reproducible; must precede all headers of CGAL.
#define CGAL_ALLOCATOR(T) groundray::AscendingAllocator<T>

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {
namespace {

// Separate type of kernel, so that std::less can be specialised below.
struct Kernel : CGAL::Exact_predicates_inexact_constructions_kernel {};
using Point = Kernel::Point_3;
using Tetrahedra = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<
                CGAL::Advancing_front_surface_reconstruction_vertex_base_3<Kernel>,
                CGAL::Advancing_front_surface_reconstruction_cell_base_3<Kernel>>>;
using QueuedEdge = Tetrahedra::Vertex::Radius_ptr_type;  // criterion of its candidate, and address
constexpr std::size_t bytes_each = 2000;  // memory per point; 550 to 2200 for a lidar
constexpr std::size_t most_each = 8000;   // limit per point
using Triple = std::array<std::size_t, 3>;

// Numbers objects in the order of their first query, during its lifetime.
//
// CGAL's queue is a std::set with a default-constructed std::less. No object can carry the numbers
// to it, and the queued pointers refer to CGAL's own data. A comparison therefore finds the numbers
// by its thread. Nested runs on the same thread, called by the progress callback, have separate
// numbers.
class Arrivals {
 public:
  Arrivals() : outer_(current()) { current() = this; }
  ~Arrivals() { current() = outer_; }
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  static Arrivals*& current() noexcept {
    static thread_local Arrivals* arrivals = nullptr;
    return arrivals;
  }

  std::size_t number(const void* thing) {
    return numbers_.try_emplace(thing, numbers_.size()).first->second;
  }

 private:
  Arrivals* outer_;
  std::unordered_map<const void*, std::size_t> numbers_;
};

}  // namespace
}  // namespace groundray

// CGAL orders edges with equally good candidates by their addresses, so results would depend on
// earlier memory use. Here they are ordered by their first comparison.
template <>  // NOLINTNEXTLINE(bugprone-std-namespace-modification): of a type of our own
struct std::less<groundray::QueuedEdge> {
  bool operator()(const groundray::QueuedEdge& a, const groundray::QueuedEdge& b) const {
    if (a.first != b.first) return a.first < b.first;
    if (a.second == b.second) return false;
    groundray::Arrivals& arrivals = *groundray::Arrivals::current();
    const std::size_t number = arrivals.number(a.second);
    return number < arrivals.number(b.second);
  }
};

namespace groundray {
namespace {

bool is_finite(const glm::dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

bool is_before(const glm::dvec3& a, const glm::dvec3& b) {
  if (a.x != b.x) return a.x < b.x;
  return a.y != b.y ? a.y < b.y : a.z < b.z;
}

// Returns the points that take part, ascending: of equal ones the first.
std::vector<std::uint32_t> distinct_points(std::span<const glm::dvec3> points_m, FrontMesh& out) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < points_m.size(); ++i) {
    if (is_finite(points_m[i])) order.push_back(i);
  }
  out.not_finite = points_m.size() - order.size();
  std::ranges::stable_sort(order, is_before, [&](std::uint32_t i) { return points_m[i]; });
  const auto repeats = std::ranges::unique(order, {}, [&](std::uint32_t i) { return points_m[i]; });
  out.repeated = repeats.size();
  order.erase(repeats.begin(), repeats.end());
  std::ranges::sort(order);
  return order;
}

// Returns true if all points are on a line, except for rounding.
// @param rounding_m  of their coordinates.
bool are_on_a_line(const std::vector<Point>& points, double rounding_m) {
  constexpr double near_share = 1e-12;  // relative to the extent of the points
  if (points.size() < 3) return true;
  const Point& from = points.front();
  const Point& to = *std::ranges::max_element(
      points, {}, [&](const Point& p) { return CGAL::squared_distance(from, p); });
  const double reach_m = std::sqrt(CGAL::squared_distance(from, to));
  const double near_m = near_share * reach_m + rounding_m;
  return std::ranges::all_of(points, [&](const Point& p) {
    const double twice_area = std::sqrt(CGAL::cross_product(to - from, p - from).squared_length());
    return twice_area <= near_m * reach_m;
  });
}

// Priority of a triangle: the smaller the radius of its smallest empty sphere, the earlier it is
// added.
class Plausibility {
 public:
  Plausibility(double longest_perimeter_m, std::size_t points, const RunControl& work)
      : longest_m_(longest_perimeter_m), points_(static_cast<double>(points)), work_(&work) {}

  template <typename Front, typename Cell>
  double operator()(const Front& front, Cell& cell, int index) const {
    if (++seen_ % 65536 == 0)
      work_->report(std::min(1.0, front.number_of_facets() / (2 * points_)));
    const std::array<Point, 3> corners{cell->vertex((index + 1) % 4)->point(),
                                       cell->vertex((index + 2) % 4)->point(),
                                       cell->vertex((index + 3) % 4)->point()};
    double perimeter_m = 0;
    for (std::size_t k = 0; k < 3; ++k)
      perimeter_m += std::sqrt(CGAL::squared_distance(corners[k], corners[(k + 1) % 3]));
    if (!(perimeter_m <= longest_m_)) return front.infinity();
    return front.smallest_radius_delaunay_sphere(cell, index);
  }

 private:
  double longest_m_, points_;
  const RunControl* work_;
  mutable std::size_t seen_ = 0;
};

// Inserts points one by one in a spatially coherent order, as CGAL does.
void insert(const std::vector<Point>& points, const AscendingMemory& memory,
            Tetrahedra& tetrahedra) {
  using Places = CGAL::Pointer_property_map<Point>::const_type;
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_3<Kernel, Places>(
                         CGAL::make_property_map(points), Kernel()));
  Tetrahedra::Vertex_handle last;
  for (const std::size_t i : order) {
    last = tetrahedra.insert(points[i], last);
    last->info() = i;
    if (memory.is_used_up())
      throw Error(
          "surface between points: {} points make more tetrahedra than fit into {} MB, as points "
          "on few lines do; thin them along their lines, or link them as scans",
          points.size(), memory.bytes() / 1'000'000);
  }
}

std::vector<Triple> triangles_between(const std::vector<Point>& points, double longest_perimeter_m,
                                      const RunControl& work) {
  const Arrivals arrivals;
  const AscendingMemory memory(std::min(work.most_bytes, points.size() * most_each + 1'000'000));
  Tetrahedra tetrahedra;
  insert(points, memory, tetrahedra);
  CGAL::Advancing_front_surface_reconstruction<Tetrahedra, Plausibility> front(
      tetrahedra, Plausibility(longest_perimeter_m, points.size(), work));
  front.run();
  std::vector<Triple> triangles;
  CGAL::write_triple_indices(std::back_inserter(triangles), front);
  return triangles;
}

// Returns a positive value if a piece is wound correctly: facing the origins or, without them,
// outwards if it is closed and upwards if it is open.
double facing(const FrontMesh& front, std::span<const std::uint32_t> piece, bool is_closed,
              std::span<const glm::dvec3> origins_m) {
  const TriangleMesh& mesh = front.mesh;
  const glm::dvec3 amid_m = mesh.vertices_m[mesh.triangles[piece.front()].x];
  double sum = 0;
  for (const std::uint32_t triangle : piece) {
    const glm::uvec3& t = mesh.triangles[triangle];
    const glm::dvec3 normal = area_vector_m2(mesh, t);
    if (origins_m.empty()) {
      sum += is_closed ? glm::dot(normal, mesh.vertices_m[t.x] - amid_m) : normal.z;
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 to_origin_m = origins_m[front.sources[t[k]]] - mesh.vertices_m[t[k]];
      const double length_m = glm::length(to_origin_m);
      if (length_m > 0) sum += glm::dot(normal, to_origin_m) / length_m;
    }
  }
  return sum;
}

void wind(FrontMesh& front, std::span<const glm::dvec3> origins_m) {
  std::vector<glm::uvec3>& triangles = front.mesh.triangles;
  const SurfaceMesh surface = to_surface(front.mesh);
  const Buckets pieces = pieces_of(surface);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const std::span<const std::uint32_t> piece = pieces.at(i);
    const bool is_closed = std::ranges::none_of(piece, [&](std::uint32_t triangle) {
      return surface.is_boundary(surface.face_handle(triangle));
    });
    const double sum = facing(front, piece, is_closed, origins_m);
    const glm::uvec3& first = triangles[piece.front()];
    const bool is_right = sum != 0 ? sum > 0 : first.y < first.z;
    if (is_right) continue;
    for (const std::uint32_t t : piece) std::swap(triangles[t].y, triangles[t].z);
  }
}

// Keeps only points that a triangle uses.
void take_triangles(std::span<const glm::dvec3> points_m, const std::vector<std::uint32_t>& taken,
                    std::vector<Triple> triangles, FrontMesh& out) {
  for (Triple& t : triangles) std::ranges::rotate(t, std::ranges::min_element(t));
  std::ranges::sort(triangles, {}, [](const Triple& t) {  // CGAL's order depends on addresses
    return Triple{t[0], std::min(t[1], t[2]), std::max(t[1], t[2])};
  });
  std::vector<std::uint32_t> numbers(taken.size(), none);
  for (const Triple& t : triangles) {
    for (const std::size_t corner : t) numbers[corner] = 0;
  }
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (numbers[i] == none) continue;
    numbers[i] = static_cast<std::uint32_t>(out.sources.size());
    out.sources.push_back(taken[i]);
    out.mesh.vertices_m.push_back(points_m[taken[i]]);
  }
  for (const Triple& t : triangles)
    out.mesh.triangles.emplace_back(numbers[t[0]], numbers[t[1]], numbers[t[2]]);
}

void check(std::span<const glm::dvec3> points_m, double longest_perimeter_m,
           std::span<const glm::dvec3> origins_m, const RunControl& work) {
  constexpr double most_m = 1e15;
  const auto far = std::ranges::find_if(points_m, [](const glm::dvec3& p) {
    return is_finite(p) && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > most_m;
  });
  Violations broken("surface between points");
  broken.unless(longest_perimeter_m > 0, "longest_perimeter_m = {} must be positive",
                longest_perimeter_m);
  broken.unless(origins_m.empty() || origins_m.size() == points_m.size(),
                "there are {} origins for {} points: there must be one per point or none",
                origins_m.size(), points_m.size());
  broken.unless(far == points_m.end(),
                "point {} must be within {:.0e} m of zero along each axis: is it in metres?",
                far - points_m.begin(), most_m);
  broken.unless(points_m.size() <= work.most_bytes / bytes_each,
                "{} points take about {} MB, more than the {} MB allowed; allow more memory or use "
                "fewer points",
                points_m.size(), points_m.size() * bytes_each / 1'000'000,
                work.most_bytes / 1'000'000);
  broken.throw_if_any();
}

}  // namespace

FrontMesh advance_front(std::span<const glm::dvec3> points_m, double longest_perimeter_m,
                        std::span<const glm::dvec3> origins_m, const RunControl& work) {
  check(points_m, longest_perimeter_m, origins_m, work);
  FrontMesh out;
  const std::vector<std::uint32_t> taken = distinct_points(points_m, out);
  std::vector<Point> points;
  double farthest_m = 0;  // largest absolute coordinate
  for (const std::uint32_t i : taken) {
    const glm::dvec3 size_m = glm::abs(points_m[i]);
    farthest_m = std::max({farthest_m, size_m.x, size_m.y, size_m.z});
    const glm::dvec3 p = points_m[i] - glm::round(points_m[taken.front()]);
    points.emplace_back(p.x, p.y, p.z);
  }
  if (are_on_a_line(points, farthest_m * std::numeric_limits<double>::epsilon())) return out;
  take_triangles(points_m, taken, triangles_between(points, longest_perimeter_m, work), out);
  wind(out, origins_m);
  work.report(1);
  return out;
}

}  // namespace groundray
