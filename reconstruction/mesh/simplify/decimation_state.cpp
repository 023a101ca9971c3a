#include "reconstruction/mesh/simplify/decimation_state.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace groundray {
namespace {

// Angle between the normals of two triangles, and the smaller of the distances from the far corner
// of one to the plane of the other.
struct Fold {
  double angle_rad = 0;
  double depth_m = 0;

  Fold(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& left, const glm::dvec3& right) {
    const glm::dvec3 n = glm::cross(b - a, left - a), m = glm::cross(right - a, b - a);
    angle_rad = std::atan2(glm::length(glm::cross(n, m)), glm::dot(n, m));
    const double of_left = std::abs(glm::dot(left - a, m)) / glm::length(m);
    const double of_right = std::abs(glm::dot(right - a, n)) / glm::length(n);
    depth_m = std::min(of_left, of_right);
  }
};

constexpr double least_cosine = 0.5;  // between the normals before and after
constexpr double least_shape = 0.03;  // 0.58 for an equilateral triangle

/// Normal of a triangle, twice its area long, and the sum of the squares of its sides.
struct Facing {
  glm::dvec3 normal;
  double squares = 0;

  Facing(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c)
      : normal(glm::cross(b - a, c - a)),
        squares(glm::dot(b - a, b - a) + glm::dot(c - b, c - b) + glm::dot(a - c, a - c)) {}
  double shape() const { return squares > 0 ? 2 * glm::length(normal) / squares : 0; }
};

}  // namespace

FeatureLines::FeatureLines(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m,
                           const std::vector<std::uint16_t>& labels, double angle_rad,
                           const std::vector<float>& deep_m)
    : edges_(3 * mesh.numbers(), none),
      next_(mesh.vertices(), none),
      is_on_(mesh.vertices()),
      is_left_(mesh.vertices()),
      labels_(labels) {
  const auto half_edges = static_cast<HalfEdge>(edges_.size());
  for (HalfEdge h = 0; h < half_edges; ++h) {
    const HalfEdge twin = mesh.twin(h);
    const std::uint32_t a = mesh.from(h), b = mesh.to(h);
    if (twin == none) mark(mesh, h, LineKind::Border);
    if (!labels.empty() && labels[a] == labels[b] && labels[mesh.to(next_of(h))] != labels[a])
      mark(mesh, h, LineKind::Labels);
    if (twin == none || twin < h || !(angle_rad < std::numbers::pi)) continue;
    const std::uint32_t left = mesh.to(next_of(h)), right = mesh.to(next_of(twin));
    const Fold fold(places_m[a], places_m[b], places_m[left], places_m[right]);
    const double deep = deep_m.empty() ? 0 : std::max(deep_m[left], deep_m[right]);
    if (fold.angle_rad > angle_rad && fold.depth_m > deep) mark(mesh, h, LineKind::Crease);
  }
}

void FeatureLines::mark(const CollapsibleMesh& mesh, HalfEdge h, LineKind kind) {
  if (edges_[h] != none) return;
  edges_[h] = static_cast<std::uint32_t>(lines_.size());
  if (mesh.twin(h) != none) edges_[mesh.twin(h)] = edges_[h];
  is_on_[mesh.from(h)] = is_on_[mesh.to(h)] = 1;
  lines_.push_back({.kind = kind});
}

FeatureLines::Crossing FeatureLines::crossing(const Star& star) const noexcept {
  Crossing crossing;
  if (is_on_[star.centre] == 0) return crossing;
  for (std::size_t i = 0; i < star.ring.size(); ++i) {
    if (edges_[spoke(star, i)] == none) continue;
    if (crossing.edges < 2) crossing.spokes[crossing.edges] = i;
    ++crossing.edges;
  }
  return crossing;
}

bool FeatureLines::may_leave_along(const Star& star, const Crossing& crossing,
                                   std::size_t to) const noexcept {
  const auto& [a, b] = crossing.spokes;
  if (to != a && to != b) return false;
  // The two edges become one, which must not coincide with an existing edge.
  const std::size_t other = to == a ? b : a, ring = star.ring.size();
  if (other == (to + 1) % ring && to < star.spokes.size() && has(next_of(star.spokes[to])))
    return false;
  if (to == (other + 1) % ring && other < star.spokes.size() && has(next_of(star.spokes[other])))
    return false;
  // A line ends where its kind changes.
  return lines_[edges_[spoke(star, a)]].kind == lines_[edges_[spoke(star, b)]].kind;
}

void FeatureLines::gather(const Star& star, const Crossing& crossing, std::size_t to,
                          Merged& merged) const {
  const auto& [a, b] = crossing.spokes;
  merged.onto = star.ring[to];
  merged.other_end = star.ring[to == a ? b : a];
  merged.kind = lines_[edges_[spoke(star, a)]].kind;
  merged.vertices.clear();
  for (const std::size_t i : {a, b}) {
    for (std::uint32_t v = lines_[edges_[spoke(star, i)]].first; v != none; v = next_[v])
      merged.vertices.push_back(v);
  }
  merged.vertices.push_back(star.centre);
}

void FeatureLines::append(Edge& edge, std::uint32_t first, std::uint32_t last) noexcept {
  if (first == none) return;
  (edge.first == none ? edge.first : next_[edge.last]) = first;
  edge.last = last;
}

void FeatureLines::add(HalfEdge edge, std::uint32_t vertex) {
  next_[vertex] = none;
  is_left_[vertex] = true;
  append(lines_[edges_[edge]], vertex, vertex);
}

void FeatureLines::collapse(const CollapsibleMesh& mesh, const Star& star, const Crossing& crossing,
                            std::size_t to) {
  if (crossing.edges == 2) {
    const auto& [a, b] = crossing.spokes;
    const HalfEdge along = spoke(star, to), stays = spoke(star, to == a ? b : a);
    const Edge gone = std::exchange(lines_[edges_[along]], {});
    append(lines_[edges_[stays]], gone.first, gone.last);
    add(stays, star.centre);
  }
  // In each vanishing triangle, two edges become one.
  const auto merge = [&](HalfEdge one, HalfEdge other) {
    const std::uint32_t edge = edges_[one] != none ? edges_[one] : edges_[other];
    for (const HalfEdge h : {mesh.twin(one), mesh.twin(other)}) {
      if (h != none) edges_[h] = edge;
    }
  };
  const std::size_t count = star.spokes.size();
  if (to < count) {
    const HalfEdge h = star.spokes[to];
    merge(before(h), next_of(h));
  }
  if (to > 0 || !star.is_open()) {
    const HalfEdge h = star.spokes[to == 0 ? count - 1 : to - 1];
    merge(h, next_of(h));
  }
}

// Returns true if a triangle is neither flipped nor a sliver; slivers are allowed where they
// replace worse ones.
bool ShapeRules::is_sound(const Star& star, std::size_t i) const {
  const Facing after(tip_m_, rim_m_[i], rim_m_[i + 1]);
  const glm::dvec3& centre_m = piece_.samples[star.centre].p_m;
  const Facing before(centre_m, rim_m_[i], rim_m_[i + 1]);
  const double least = std::min(least_shape, before.shape());
  const double shape = after.shape();
  if (!(shape > 1e-6) || shape < least) return false;
  const double sizes = glm::length(after.normal) * glm::length(before.normal);
  if (sizes > 0 && glm::dot(after.normal, before.normal) < least_cosine * sizes) return false;
  return overhang_ == Overhang::Allow || after.normal.z > 0;
}

bool ShapeRules::allow(const Star& star, const FeatureLines::Crossing&, std::size_t to) {
  fan_ = Fan(star, to);
  tip_m_ = piece_.samples[star.ring[to]].p_m;
  rim_m_.clear();
  for (std::size_t i = 0; i <= fan_.triangles; ++i) {
    rim_m_.push_back(piece_.samples[star.ring[(fan_.first + i) % star.ring.size()]].p_m);
    if (i > 0 && !is_sound(star, i - 1)) return false;
  }
  return piece_.mesh.may_collapse(star, to);
}

}  // namespace groundray
