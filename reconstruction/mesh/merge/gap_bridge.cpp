#define BOOST_ALLOW_DEPRECATED_HEADERS  // by Boost.Geometry itself

#include <algorithm>
#include <array>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/geometry/strategies/strategies.hpp>
#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "core/math.h"
#include "reconstruction/mesh/merge/open_border.h"
#include "reconstruction/mesh/merge/zippering.h"

namespace groundray {
namespace {

namespace geometry = boost::geometry;

constexpr double least_cosine = 0.8660254;  // cos 30 degrees, between normals
constexpr double least_height = 1e-3;       // of a triangle, relative to its longest edge
constexpr double full_turn = 2 * std::numbers::pi;
constexpr double edge_rad = 1e-9;         // rounding of a zero angle
constexpr std::size_t steps_each = 4096;  // per call of progress

/// Returns for each vertex the longest edge of its triangles.
std::vector<double> sizes_at_vertices(const StitchedMesh& stitched) {
  std::vector<double> sizes_m(stitched.vertices.size());
  for (const glm::uvec3& t : stitched.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k], to = t[(k + 1) % 3];
      const double length_m = glm::distance(stitched.vertices[from].p, stitched.vertices[to].p);
      for (int corner = 0; corner < 3; ++corner)
        sizes_m[t[corner]] = std::max(sizes_m[t[corner]], length_m);
    }
  }
  return sizes_m;
}

/// Search tree for the vertices near a position.
class VertexTree {
 public:
  VertexTree(const StitchedMesh& stitched, const std::vector<std::uint32_t>& vertices)
      : tree_(entries(stitched, vertices)) {}

  /// Returns the vertices that are at most `within_m` away, in the tree's order.
  std::vector<std::uint32_t> near(const glm::dvec3& place_m, double within_m) const {
    std::vector<std::uint32_t> found;
    const glm::dvec3 low = place_m - within_m, high = place_m + within_m;
    const auto look_at = [&](const Entry& entry) {
      const glm::dvec3 p_m(entry.first.get<0>(), entry.first.get<1>(), entry.first.get<2>());
      if (glm::distance(p_m, place_m) <= within_m) found.push_back(entry.second);
    };
    tree_.query(geometry::index::intersects(
                    geometry::model::box<Point>({low.x, low.y, low.z}, {high.x, high.y, high.z})),
                boost::make_function_output_iterator(look_at));
    return found;
  }

 private:
  using Point = geometry::model::point<double, 3, geometry::cs::cartesian>;
  using Entry = std::pair<Point, std::uint32_t>;

  static std::vector<Entry> entries(const StitchedMesh& stitched,
                                    const std::vector<std::uint32_t>& vertices) {
    std::vector<Entry> entries;
    entries.reserve(vertices.size());
    for (const std::uint32_t vertex : vertices) {
      const glm::dvec3& p_m = stitched.vertices[vertex].p;
      entries.emplace_back(Point(p_m.x, p_m.y, p_m.z), vertex);
    }
    return entries;
  }

  geometry::index::rtree<Entry, geometry::index::rstar<8>> tree_;
};

/// Projection of nearby positions onto a plane.
class View {
 public:
  View(const glm::dvec3& origin, const glm::dvec3& normal) : origin_(origin), normal_(normal) {
    const glm::dvec3 other = std::abs(normal.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    right_ = glm::normalize(glm::cross(other, normal));
    up_ = glm::cross(normal, right_);
  }

  glm::dvec2 of(const glm::dvec3& p) const {
    return {glm::dot(p - origin_, right_), glm::dot(p - origin_, up_)};
  }
  double height_m(const glm::dvec3& p) const { return glm::dot(p - origin_, normal_); }

 private:
  glm::dvec3 origin_, normal_, right_{0}, up_{0};
};

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

bool cross_each_other(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c,
                      const glm::dvec2& d) {
  const double ac = cross(b - a, c - a), ad = cross(b - a, d - a);
  const double ca = cross(d - c, a - c), cb = cross(d - c, b - c);
  return ((ac > 0) != (ad > 0)) && ((ca > 0) != (cb > 0));
}

bool is_within(const glm::dvec2& p, const std::array<glm::dvec2, 3>& t) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(cross(t[(k + 1) % 3] - t[k], p - t[k]) > 0)) return false;
  }
  return true;
}

/// Triangle that may be added at a boundary edge, which is its first edge reversed.
struct Bridge {
  double size_m = 0;
  glm::uvec3 t{0};

  bool operator<(const Bridge& b) const {  // inverted, so that the queue yields the smallest first
    return std::tie(b.size_m, b.t.x, b.t.y, b.t.z) < std::tie(size_m, t.x, t.y, t.z);
  }
};

class Bridging {
 public:
  Bridging(const StitchedMesh& stitched, const RunControl& work)
      : quilt_(stitched),
        work_(work),
        border_(stitched),
        sizes_m_(sizes_at_vertices(stitched)),
        tree_(stitched, border_.vertices()) {}

  /// Returns the triangles to add.
  std::vector<glm::uvec3> run() {
    const std::size_t count = border_.vertices().size();
    for (std::size_t i = 0; i < count; ++i) {
      if (i % steps_each == 0)
        work_.report(0.5 * static_cast<double>(i) / static_cast<double>(count));
      const std::uint32_t from = border_.vertices()[i];
      for (const std::uint32_t to : border_.after(from)) look_beside(from, to);
    }
    std::vector<glm::uvec3> added;
    for (std::size_t step = 0; !queue_.empty(); ++step) {
      if (step % steps_each == 0) work_.report(0.5);  // the remaining number of steps is unknown
      const glm::uvec3 t = queue_.top().t;
      queue_.pop();
      if (!border_.has(t.y, t.x)) continue;
      if (!is_possible(t) || !is_open(t)) {
        look_beside(t.y, t.x);
        continue;
      }
      border_.add(t);
      added.push_back(t);
      if (border_.has(t.y, t.z)) look_beside(t.y, t.z);
      if (border_.has(t.z, t.x)) look_beside(t.z, t.x);
    }
    return added;
  }

 private:
  const glm::dvec3& p(std::uint32_t vertex) const { return quilt_.vertices[vertex].p; }

  bool are_near(std::uint32_t a, std::uint32_t b) const {
    return glm::distance(p(a), p(b)) <= std::min(sizes_m_[a], sizes_m_[b]);
  }

  /// Returns true if a triangle meets all conditions, overlap excepted.
  bool is_possible(const glm::uvec3& t) const {
    if (!border_.has(t.z) || !border_.is_free(t.y, t.z) || !border_.is_free(t.z, t.x)) return false;
    const StitchedVertex &x = quilt_.vertices[t.x], &y = quilt_.vertices[t.y],
                         &z = quilt_.vertices[t.z];
    if (!are_near(t.y, t.z) || !are_near(t.z, t.x)) return false;
    const glm::dvec3 normal = glm::cross(y.p - x.p, z.p - x.p);
    const double length = glm::length(normal);
    const double longest_m =
        std::max({glm::distance(x.p, y.p), glm::distance(y.p, z.p), glm::distance(z.p, x.p)});
    if (!(length > least_height * longest_m * longest_m)) return false;
    return std::ranges::all_of(std::array{x.normal, y.normal, z.normal}, [&](const glm::vec3& n) {
      return glm::dot(normal, glm::dvec3(n)) >= least_cosine * length;
    });
  }

  /// Queues the triangle at a boundary edge whose new corner sees the edge at the largest angle, so
  /// that no other corner lies in its circumscribed circle.
  void look_beside(std::uint32_t from, std::uint32_t to) {
    const double within_m = std::min(sizes_m_[from], sizes_m_[to]);
    const glm::dvec3 along = p(to) - p(from);
    const glm::dvec3 aside = glm::cross(along, glm::dvec3(quilt_.vertices[from].normal));
    std::vector<std::pair<double, std::uint32_t>> found;  // cosine of the angle, and corner
    for (const std::uint32_t corner : tree_.near(p(from), within_m)) {
      const glm::dvec3 a = p(from) - p(corner), b = p(to) - p(corner);
      if (!(glm::dot(a, aside) < 0) || !border_.has(corner)) continue;
      const double lengths_m2 = glm::length(a) * glm::length(b);
      if (lengths_m2 > 0) found.emplace_back(glm::dot(a, b) / lengths_m2, corner);
    }
    std::ranges::make_heap(found, std::greater());
    while (!found.empty()) {
      std::ranges::pop_heap(found, std::greater());
      const auto [cosine, corner] = found.back();
      found.pop_back();
      const glm::uvec3 t(to, from, corner);
      if (!is_possible(t) || !is_open(t)) continue;
      const double sine = std::sqrt(std::max(1 - cosine * cosine, 1e-12));
      queue_.push({glm::length(along) / sine, t});
      return;
    }
  }

  /// Returns true if a triangle overlaps nothing.
  bool is_open(const glm::uvec3& t) const {
    const glm::dvec3 normal = glm::normalize(glm::cross(p(t.y) - p(t.x), p(t.z) - p(t.x)));
    const View view(p(t.x), normal);
    for (int k = 0; k < 3; ++k) {
      if (!is_open_at(view, t[k], t[(k + 1) % 3], t[(k + 2) % 3])) return false;
    }
    const std::array<glm::dvec2, 3> corners{view.of(p(t.x)), view.of(p(t.y)), view.of(p(t.z))};
    const double longest_m = std::max({glm::distance(p(t.x), p(t.y)), glm::distance(p(t.y), p(t.z)),
                                       glm::distance(p(t.z), p(t.x))});
    const glm::dvec3 middle = (p(t.x) + p(t.y) + p(t.z)) / 3.0;
    for (const std::uint32_t from : tree_.near(middle, 1.5 * longest_m)) {
      if (!border_.has(from) || std::abs(view.height_m(p(from))) > longest_m) continue;
      const glm::dvec2 begin = view.of(p(from));
      const bool is_corner = from == t.x || from == t.y || from == t.z;
      if (!is_corner && is_within(begin, corners)) return false;
      for (const std::uint32_t to : border_.after(from)) {
        if (crosses(begin, view.of(p(to)), from, to, t, corners)) return false;
      }
    }
    return true;
  }

  static bool crosses(const glm::dvec2& begin, const glm::dvec2& end, std::uint32_t from,
                      std::uint32_t to, const glm::uvec3& t,
                      const std::array<glm::dvec2, 3>& corners) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a == from || a == to || b == from || b == to) continue;
      if (cross_each_other(begin, end, corners[static_cast<std::size_t>(k)],
                           corners[static_cast<std::size_t>((k + 1) % 3)]))
        return true;
    }
    return false;
  }

  /// Returns true if no triangle at a corner lies between the directions to two others, the second
  /// counter-clockwise from the first.
  bool is_open_at(const View& view, std::uint32_t corner, std::uint32_t first,
                  std::uint32_t second) const {
    const glm::dvec2 at = view.of(p(corner));
    const auto angle_to = [&](std::uint32_t v) {
      const glm::dvec2 along = view.of(p(v)) - at;
      return math::atan2(along.y, along.x);
    };
    const double begin = angle_to(first);
    const auto turned_to = [&](std::uint32_t v) {
      const double turn = angle_to(v) - begin;
      return turn < 0 ? turn + full_turn : turn;
    };
    const double end = turned_to(second);
    double next = 2 * full_turn;  // angle of the first boundary edge after the second direction
    bool is_next_leaving = true;
    const auto look = [&](std::uint32_t v, bool is_leaving) {
      double turn = v == first ? 0 : v == second ? end : turned_to(v);
      if (turn > edge_rad && turn < end - edge_rad) return false;
      if (turn <= edge_rad) turn = full_turn;
      if (turn < next) {
        next = turn;
        is_next_leaving = is_leaving;
      }
      return true;
    };
    for (const std::uint32_t v : border_.after(corner)) {
      if (!look(v, true)) return false;
    }
    for (const std::uint32_t v : border_.before(corner)) {
      if (!look(v, false)) return false;
    }
    return is_next_leaving;
  }

  const StitchedMesh& quilt_;
  const RunControl& work_;
  OpenBorder border_;
  std::vector<double> sizes_m_;
  VertexTree tree_;
  std::priority_queue<Bridge> queue_;
};

}  // namespace

std::size_t bridge_gaps(StitchedMesh& stitched, std::span<const BeamSurface> scans,
                        const CoverTolerance& tolerance, double interpolation,
                        const RunControl& work) {
  const std::vector<glm::uvec3> bridges = Bridging(stitched, work).run();
  if (bridges.empty()) return 0;
  TriangleMesh mesh = mesh_of(stitched);
  mesh.triangles = bridges;
  const std::vector<char> is_passed =
      find_passed(mesh, sds_of(stitched), scans, tolerance, interpolation, {});
  std::size_t added = 0;
  for (std::size_t i = 0; i < bridges.size(); ++i) {
    if (is_passed[i] != 0) continue;
    stitched.triangles.push_back(bridges[i]);
    ++added;
  }
  return added - make_manifold(stitched);
}

}  // namespace groundray
