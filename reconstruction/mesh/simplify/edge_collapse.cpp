#include "reconstruction/mesh/simplify/edge_collapse.h"

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <limits>

#include "core/math.h"

namespace groundray {
namespace {

// Vertices with more neighbours than bits can only move onto the first ones.
constexpr std::size_t most_targets = 64;

using Quadric = OpenMesh::Geometry::Quadricd;

// Returns the sum of the weights of a quadric's planes.
double weight_of(const Quadric& quadric) { return quadric.xx() + quadric.yy() + quadric.zz(); }

// Returns the same quadric for positions relative to `origin_m`: OpenMesh's quadrics stay where
// they are, and squares of large coordinates would lose the digits of small errors.
Quadric seen_from(const glm::dvec3& origin_m, const Quadric& q) {
  const double &x = origin_m.x, &y = origin_m.y, &z = origin_m.z;
  return {q.xx(),
          q.xy(),
          q.xz(),
          q.xw() + q.xx() * x + q.xy() * y + q.xz() * z,
          q.yy(),
          q.yz(),
          q.yw() + q.xy() * x + q.yy() * y + q.yz() * z,
          q.zz(),
          q.zw() + q.xz() * x + q.yz() * y + q.zz() * z,
          q(origin_m)};
}

}  // namespace

EdgeCollapse::EdgeCollapse(DecimationState& piece, CollapseRules& rules, double line_weight)
    : piece_(piece),
      rules_(rules),
      quadrics_(piece.samples.size()),
      refused_(piece.samples.size()),
      targets_(piece.samples.size()),
      is_outdated_(piece.samples.size()),
      queue_(CollapseCosts(piece.samples.size())) {
  add_triangles();
  if (line_weight > 0) add_lines(line_weight);
  own_.reserve(quadrics_.size());
  for (std::size_t i = 0; i < quadrics_.size(); ++i)
    own_.push_back({piece.samples[i].p_m, 0, weight_of(quadrics_[i])});
  queue_.reserve(quadrics_.size());
  for (std::uint32_t vertex = 0; vertex < piece.samples.size(); ++vertex) enter(vertex);
  most_queued_ = queue_.size();
}

// Adds the weighted square of the distance from a plane through a vertex.
void EdgeCollapse::add_plane(std::uint32_t vertex, const glm::dvec3& normal, double weight) {
  quadrics_[vertex] += Quadric(normal.x, normal.y, normal.z, 0) * weight;
}

void EdgeCollapse::add_triangles() {
  for (std::uint32_t i = 0; i < piece_.triangles; ++i) {
    const glm::uvec3 t = corners_of(piece_.mesh, i);
    const glm::dvec3& a = piece_.samples[t.x].p_m;
    const glm::dvec3 cross = glm::cross(piece_.samples[t.y].p_m - a, piece_.samples[t.z].p_m - a);
    const double size = glm::length(cross);
    if (!(size > 0)) continue;
    for (int k = 0; k < 3; ++k) add_plane(t[k], cross / size, 0.5 * size);
  }
}

void EdgeCollapse::add_lines(double weight) {
  for (const auto h : piece_.mesh.halfedges()) {
    if (!piece_.lines.has(h) || piece_.mesh.is_boundary(h)) continue;
    const auto from = piece_.mesh.from_vertex_handle(h), to = piece_.mesh.to_vertex_handle(h);
    const auto far = piece_.mesh.to_vertex_handle(piece_.mesh.next_halfedge_handle(h));
    const glm::dvec3& a = piece_.mesh.point(from);
    const glm::dvec3 edge = piece_.mesh.point(to) - a, apex = piece_.mesh.point(far) - a;
    const glm::dvec3 upright = glm::cross(edge, glm::cross(edge, apex));
    if (!(glm::length(upright) > 0)) continue;
    for (const auto end : {from, to})
      add_plane(number_of(end), glm::normalize(upright), weight * glm::dot(edge, edge));
  }
}

void EdgeCollapse::enter(std::uint32_t vertex) {
  gather(piece_.mesh, vertex, other_);
  enter(other_, piece_.lines.crossing(other_));
}

// Queues the centre with its cheapest target, if there is any.
void EdgeCollapse::enter(const Star& star, const FeatureLines::Crossing& crossing) {
  const std::uint32_t vertex = star.centre;
  const Quadric& quadric = quadrics_[vertex];
  const Own& own = own_[vertex];
  double least = std::numeric_limits<double>::infinity();
  if (crossing.edges == 0 || crossing.edges == 2) {
    const std::size_t count = std::min(star.ring.size(), most_targets);
    for (std::size_t i = 0; i < count; ++i) {
      if ((refused_[vertex] >> i & 1) != 0 || !piece_.lines.may_leave(star, crossing, i)) continue;
      const Own& other = own_[star.ring[i]];
      const double squares = std::max(0.0, quadric(other.p_m - own.p_m)) + other.squares;
      const double cost = squares * (own.weight + other.weight);
      if (!(cost < least)) continue;
      least = cost;
      targets_[vertex] = static_cast<std::uint8_t>(i);
    }
  }
  queue(vertex, least);
}

// Queues a vertex, or removes it if its cost is infinite.
void EdgeCollapse::queue(std::uint32_t vertex, double cost) {
  const bool is_queued = queue_.is_stored(vertex);
  if (!std::isfinite(cost)) {
    if (is_queued) queue_.remove(vertex);
    return;
  }
  queue_.getInterface()[vertex] = cost;
  if (is_queued) {
    queue_.update(vertex);
  } else {
    queue_.insert(vertex);
  }
}

// Adds one vertex's quadric to another's.
void EdgeCollapse::inherit(std::uint32_t vertex, std::uint32_t from) {
  Quadric& quadric = quadrics_[vertex];
  Own& own = own_[vertex];
  quadric += seen_from(own.p_m - own_[from].p_m, quadrics_[from]);
  own.squares = std::max(0.0, quadric.ww());
  own.weight = weight_of(quadric);
}

bool EdgeCollapse::step() {
  FeatureLines::Crossing crossing;
  for (std::uint32_t vertex = none; !queue_.empty();) {
    if (vertex != queue_.front()) {  // otherwise its next target is still the cheapest
      vertex = queue_.front();
      gather(piece_.mesh, vertex, star_);
      crossing = piece_.lines.crossing(star_);
      if (is_outdated_[vertex]) {
        is_outdated_[vertex] = false;
        enter(star_, crossing);
        continue;
      }
    }
    const std::size_t to = targets_[vertex];
    if (!rules_.allow(star_, crossing, to)) {
      refused_[vertex] |= std::uint64_t{1} << to;
      enter(star_, crossing);
      continue;
    }
    cost_ = queue_.getInterface()[vertex];
    weight_ = own_[vertex].weight + own_[star_.ring[to]].weight;
    queue_.pop_front();
    rules_.collapse(star_, crossing, to);
    piece_.lines.collapse(star_, crossing, to);
    piece_.triangles -= star_.is_open() ? 1 : 2;
    collapse(piece_.mesh, star_, to);
    inherit(star_.ring[to], vertex);
    for (const std::uint32_t neighbour : star_.ring) {
      refused_[neighbour] = 0;
      if (queue_.is_stored(neighbour)) {
        is_outdated_[neighbour] = true;
      } else {
        enter(neighbour);
      }
    }
    return true;
  }
  return false;
}

double EdgeCollapse::share() const noexcept {
  if (most_queued_ == 0) return 1;
  return 1 - static_cast<double>(std::min(queue_.size(), most_queued_)) /
                 static_cast<double>(most_queued_);
}

std::size_t find_knee(const std::vector<CostStep>& steps) {
  const std::size_t all = steps.front().triangles;
  double so_far = 0;
  std::size_t knee = all;         // the last without cost, if there is no curve
  std::vector<glm::dvec2> curve;  // logarithms of triangles and cost
  std::vector<std::size_t> triangles;
  for (const CostStep& step : steps) {
    so_far = std::max(so_far, step.cost);
    if (!(so_far > 0)) knee = step.triangles;
    if (!(so_far > 0) || 2 * step.triangles > all || 1000 * step.triangles < all) continue;
    const auto left = static_cast<double>(std::max<std::size_t>(step.triangles, 1));
    curve.emplace_back(math::log(left), math::log(so_far));
    triangles.push_back(step.triangles);
  }
  if (curve.size() < 3) return knee;
  const glm::dvec2 first = curve.front();
  const double width = curve.back().x - first.x, height = curve.back().y - first.y;
  double farthest = -1;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double away = std::abs(first.y + height * (curve[i].x - first.x) / width - curve[i].y);
    if (away <= farthest) continue;
    farthest = away;
    knee = triangles[i];
  }
  return knee;
}

}  // namespace groundray
