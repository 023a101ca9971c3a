#define BOOST_ALLOW_DEPRECATED_HEADERS  // by Boost.Geometry itself

#include "apps/golden/compare/scans/scan_scope.h"

#include <algorithm>
#include <boost/geometry/core/cs.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/geometry/strategies/strategies.hpp>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

namespace groundray::golden {
namespace {

using TreePoint = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
using TreeBox = boost::geometry::model::box<TreePoint>;
using PointTree = boost::geometry::index::rtree<TreePoint, boost::geometry::index::rstar<16>>;

TreePoint tree_point(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

/// Returns whether any point of the tree is within a distance of p.
bool has_near(const PointTree& tree, const glm::dvec3& p, double distance_m) {
  const TreeBox box(tree_point(p - distance_m), tree_point(p + distance_m));
  const auto end = tree.qend();
  return std::any_of(tree.qbegin(boost::geometry::index::intersects(box)), end,
                     [&](const TreePoint& each) {
                       const glm::dvec3 q(each.get<0>(), each.get<1>(), each.get<2>());
                       return glm::distance(q, p) <= distance_m;
                     });
}

/// Returns, for each return of a scan, whether one of another scan is within a distance.
std::vector<bool> near_ones(const Scan& scan, const Scan& other, const Scope& scope) {
  std::vector<bool> is_near(scan.p_S.size(), true);
  if (!scope.ignores()) return is_near;
  std::vector<TreePoint> points;
  points.reserve(other.p_S.size());
  for (const glm::dvec3& p : other.p_S) points.push_back(tree_point(p));
  const PointTree tree(points);
  for (std::size_t i = 0; i < scan.p_S.size(); ++i)
    is_near[i] = has_near(tree, scan.p_S[i], scope.ignore_beyond_m);
  return is_near;
}

}  // namespace

LeftOut leave_out(const Scan& reference, const Scan& other, const Scope& scope, Pairs& pairs) {
  LeftOut left;
  if (!scope.has_box() && !scope.ignores()) return left;
  const std::vector<bool> near_other = near_ones(reference, other, scope);
  const std::vector<bool> near_reference = near_ones(other, reference, scope);
  const auto is_in = [&](const glm::dvec3& p_S) { return scope.contains(reference.X_WS * p_S); };
  std::erase_if(pairs.returns, [&](const std::pair<std::uint32_t, std::uint32_t>& pair) {
    const bool is_outside = !is_in(reference.p_S[pair.first]);
    const bool is_far = !near_other[pair.first] || !near_reference[pair.second];
    (is_outside ? left.outside_reference : left.ignored_reference) += is_outside || is_far ? 1 : 0;
    (is_outside ? left.outside_other : left.ignored_other) += is_outside || is_far ? 1 : 0;
    return is_outside || is_far;
  });
  const auto drop = [&](const Scan& scan, const std::vector<bool>& is_near, std::size_t& outside,
                        std::size_t& ignored, std::vector<std::uint32_t>& unpaired) {
    std::erase_if(unpaired, [&](std::uint32_t i) {
      const bool is_outside = !is_in(scan.p_S[i]);
      (is_outside ? outside : ignored) += is_outside || !is_near[i] ? 1 : 0;
      return is_outside || !is_near[i];
    });
  };
  drop(reference, near_other, left.outside_reference, left.ignored_reference, pairs.missing);
  drop(other, near_reference, left.outside_other, left.ignored_other, pairs.extra);
  return left;
}

}  // namespace groundray::golden
