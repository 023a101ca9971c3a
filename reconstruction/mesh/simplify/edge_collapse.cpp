#include "reconstruction/mesh/simplify/edge_collapse.h"

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <limits>

namespace groundray {
namespace {

// Vertices with more neighbours than bits can only move onto the first ones.
constexpr std::size_t most_targets = 64;

}  // namespace

EdgeCollapse::EdgeCollapse(DecimationState& piece, CollapseRules& rules, double line_weight)
    : piece_(piece),
      rules_(rules),
      quadrics_(piece.samples.size()),
      refused_(piece.samples.size()),
      targets_(piece.samples.size()),
      queue_(piece.samples.size()) {
  add_triangles();
  if (line_weight > 0) add_lines(line_weight);
  own_.reserve(quadrics_.size());
  for (const Quadric& quadric : quadrics_) own_.push_back({0, quadric.weight()});
  for (std::uint32_t vertex = 0; vertex < piece.samples.size(); ++vertex) enter(vertex);
  most_queued_ = queue_.size();
}

void EdgeCollapse::add_triangles() {
  for (std::uint32_t i = 0; i < piece_.mesh.numbers(); ++i) {
    const glm::uvec3 t = piece_.mesh.corners(i);
    const glm::dvec3& a = piece_.samples[t.x].p_m;
    const glm::dvec3 cross = glm::cross(piece_.samples[t.y].p_m - a, piece_.samples[t.z].p_m - a);
    const double size = glm::length(cross);
    if (!(size > 0)) continue;
    for (int k = 0; k < 3; ++k) quadrics_[t[k]].add_plane(cross / size, 0.5 * size);
  }
}

void EdgeCollapse::add_lines(double weight) {
  for (std::uint32_t i = 0; i < piece_.mesh.numbers(); ++i) {
    for (HalfEdge h = 3 * i; h < 3 * i + 3; ++h) {
      if (!piece_.lines.has(h)) continue;
      const std::uint32_t from = piece_.mesh.from(h), to = piece_.mesh.to(h);
      const glm::dvec3& a = piece_.samples[from].p_m;
      const glm::dvec3 edge = piece_.samples[to].p_m - a;
      const glm::dvec3 apex = piece_.samples[piece_.mesh.to(next_of(h))].p_m - a;
      const glm::dvec3 upright = glm::cross(edge, glm::cross(edge, apex));
      if (!(glm::length(upright) > 0)) continue;
      for (const std::uint32_t end : {from, to})
        quadrics_[end].add_plane(glm::normalize(upright), weight * glm::dot(edge, edge));
    }
  }
}

void EdgeCollapse::enter(std::uint32_t vertex) {
  piece_.mesh.gather(vertex, other_);
  enter(other_, piece_.lines.crossing(other_));
}

// Queues the centre with its cheapest target, if there is any.
void EdgeCollapse::enter(const Star& star, const FeatureLines::Crossing& crossing) {
  const std::uint32_t vertex = star.centre;
  const Quadric& quadric = quadrics_[vertex];
  const glm::dvec3& centre_m = piece_.samples[vertex].p_m;
  double least = std::numeric_limits<double>::infinity();
  if (crossing.edges == 0 || crossing.edges == 2) {
    const std::size_t count = std::min(star.ring.size(), most_targets);
    for (std::size_t i = 0; i < count; ++i) {
      if ((refused_[vertex] >> i & 1) != 0 || !piece_.lines.may_leave(star, crossing, i)) continue;
      const Own& other = own_[star.ring[i]];
      const glm::dvec3 there_m = piece_.samples[star.ring[i]].p_m - centre_m;
      const double squares = std::max(0.0, quadric.at(there_m)) + other.squares;
      const double cost = squares * (own_[vertex].weight + other.weight);
      if (!(cost < least)) continue;
      least = cost;
      targets_[vertex] = static_cast<std::uint8_t>(i);
    }
  }
  if (std::isfinite(least)) {
    queue_.set(vertex, least);
  } else {
    queue_.remove(vertex);
  }
}

// Adds one vertex's quadric to another's.
void EdgeCollapse::inherit(std::uint32_t vertex, std::uint32_t from) {
  const glm::dvec3 there_m = piece_.samples[vertex].p_m - piece_.samples[from].p_m;
  quadrics_[vertex] += quadrics_[from].seen_from(there_m);
  own_[vertex] = {std::max(0.0, quadrics_[vertex].one), quadrics_[vertex].weight()};
}

bool EdgeCollapse::step() {
  FeatureLines::Crossing crossing;
  for (std::uint32_t vertex = none; !queue_.empty();) {
    if (vertex != queue_.top()) {  // otherwise its next target is still the cheapest
      vertex = queue_.top();
      piece_.mesh.gather(vertex, star_);
      crossing = piece_.lines.crossing(star_);
    }
    const std::size_t to = targets_[vertex];
    if (!rules_.allow(star_, crossing, to)) {
      refused_[vertex] |= std::uint64_t{1} << to;
      enter(star_, crossing);
      continue;
    }
    cost_ = queue_.top_cost();
    weight_ = own_[vertex].weight + own_[star_.ring[to]].weight;
    queue_.remove(vertex);
    rules_.collapse(star_, crossing, to);
    piece_.lines.collapse(piece_.mesh, star_, crossing, to);
    piece_.mesh.collapse(star_, to);
    inherit(star_.ring[to], vertex);
    for (const std::uint32_t neighbour : star_.ring) {
      refused_[neighbour] = 0;
      enter(neighbour);
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
    curve.emplace_back(std::log(left), std::log(so_far));
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
