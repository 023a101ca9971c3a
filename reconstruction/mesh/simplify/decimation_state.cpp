#include "reconstruction/mesh/simplify/decimation_state.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

// Angle between the normals of two triangles, and the smaller of the distances from the far corner
// of one to the plane of the other.
struct Fold {
  double angle_rad = 0;
  double depth_m = 0;

  Fold(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& left, const glm::dvec3& right) {
    const glm::dvec3 n = glm::cross(b - a, left - a), m = glm::cross(right - a, b - a);
    angle_rad = math::atan2(glm::length(glm::cross(n, m)), glm::dot(n, m));
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

FeatureLines::FeatureLines(const SurfaceMesh& mesh, const std::vector<std::uint16_t>& labels,
                           double angle_rad, const std::vector<float>& deep_m)
    : edges_(mesh.n_edges(), none),
      next_(mesh.n_vertices(), none),
      is_on_(mesh.n_vertices()),
      is_left_(mesh.n_vertices()),
      labels_(labels) {
  const auto apex_of = [&](auto h) { return mesh.to_vertex_handle(mesh.next_halfedge_handle(h)); };
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const auto edge = mesh.edge_handle(static_cast<unsigned>(i));
    const auto h = mesh.halfedge_handle(edge, 0), twin = mesh.halfedge_handle(edge, 1);
    const auto a = mesh.from_vertex_handle(h), b = mesh.to_vertex_handle(h);
    const bool is_border = mesh.is_boundary(edge);
    if (is_border) mark(mesh, h, LineKind::Border);
    const auto is_beside_other = [&](auto side) {
      return !mesh.is_boundary(side) && labels[number_of(apex_of(side))] != labels[number_of(a)];
    };
    if (!labels.empty() && labels[number_of(a)] == labels[number_of(b)] &&
        (is_beside_other(h) || is_beside_other(twin)))
      mark(mesh, h, LineKind::Labels);
    if (is_border || !(angle_rad < std::numbers::pi)) continue;
    const auto left = apex_of(h), right = apex_of(twin);
    const Fold fold(mesh.point(a), mesh.point(b), mesh.point(left), mesh.point(right));
    const double deep =
        deep_m.empty() ? 0 : std::max(deep_m[number_of(left)], deep_m[number_of(right)]);
    if (fold.angle_rad > angle_rad && fold.depth_m > deep) mark(mesh, h, LineKind::Crease);
  }
}

void FeatureLines::mark(const SurfaceMesh& mesh, SurfaceMesh::HalfedgeHandle h, LineKind kind) {
  if (has(h)) return;
  edges_[number_of(h) / 2] = static_cast<std::uint32_t>(lines_.size());
  is_on_[number_of(mesh.from_vertex_handle(h))] = is_on_[number_of(mesh.to_vertex_handle(h))] = 1;
  lines_.push_back({.kind = kind});
}

FeatureLines::Crossing FeatureLines::crossing(const Star& star) const noexcept {
  Crossing crossing;
  if (is_on_[star.centre] == 0) return crossing;
  for (std::size_t i = 0; i < star.ring.size(); ++i) {
    if (!has(star.spokes[i])) continue;
    if (crossing.edges < 2) crossing.spokes[crossing.edges] = i;
    ++crossing.edges;
  }
  return crossing;
}

bool FeatureLines::may_leave_along(const Star& star, const Crossing& crossing,
                                   std::size_t to) const {
  const auto& [a, b] = crossing.spokes;
  if (to != a && to != b) return false;
  // The two edges become one, which must not coincide with an existing edge.
  const std::size_t other = to == a ? b : a, ring = star.ring.size();
  const auto is_closed_by_line = [&](std::size_t first, std::size_t second) {
    return second == (first + 1) % ring && first < star.triangles() &&
           has(star.mesh->next_halfedge_handle(star.spokes[first]));
  };
  if (is_closed_by_line(to, other) || is_closed_by_line(other, to)) return false;
  // A line ends where its kind changes.
  return lines_[line(star.spokes[a])].kind == lines_[line(star.spokes[b])].kind;
}

void FeatureLines::gather(const Star& star, const Crossing& crossing, std::size_t to,
                          Merged& merged) const {
  const auto& [a, b] = crossing.spokes;
  merged.onto = star.ring[to];
  merged.other_end = star.ring[to == a ? b : a];
  merged.kind = lines_[line(star.spokes[a])].kind;
  merged.vertices.clear();
  for (const std::size_t i : {a, b}) {
    for (std::uint32_t v = lines_[line(star.spokes[i])].first; v != none; v = next_[v])
      merged.vertices.push_back(v);
  }
  merged.vertices.push_back(star.centre);
}

void FeatureLines::append(Edge& edge, std::uint32_t first, std::uint32_t last) noexcept {
  if (first == none) return;
  (edge.first == none ? edge.first : next_[edge.last]) = first;
  edge.last = last;
}

void FeatureLines::add(SurfaceMesh::HalfedgeHandle edge, std::uint32_t vertex) {
  next_[vertex] = none;
  is_left_[vertex] = true;
  append(lines_[line(edge)], vertex, vertex);
}

void FeatureLines::collapse(const Star& star, const Crossing& crossing, std::size_t to) {
  const SurfaceMesh& mesh = *star.mesh;
  const auto along = star.spokes[to];
  if (crossing.edges == 2) {
    const auto stays =
        star.spokes[to == crossing.spokes[0] ? crossing.spokes[1] : crossing.spokes[0]];
    const Edge gone = std::exchange(lines_[line(along)], {});
    append(lines_[line(stays)], gone.first, gone.last);
    add(stays, star.centre);
  }
  // In each vanishing triangle, the edge at the centre gives way to the one at the target.
  const auto merge = [&](SurfaceMesh::HalfedgeHandle goes, SurfaceMesh::HalfedgeHandle stays) {
    std::uint32_t& line_that_stays = edges_[number_of(stays) / 2];
    if (line_that_stays == none) line_that_stays = line(goes);
  };
  if (!mesh.is_boundary(along))
    merge(mesh.prev_halfedge_handle(along), mesh.next_halfedge_handle(along));
  if (const auto back = mesh.opposite_halfedge_handle(along); !mesh.is_boundary(back))
    merge(mesh.next_halfedge_handle(back), mesh.prev_halfedge_handle(back));
}

DecimationState::DecimationState(const TriangleMesh& shape,
                                 const std::vector<std::uint16_t>& labels, double crease_rad,
                                 const std::vector<float>& tolerances_m,
                                 const std::vector<float>& deep_m)
    : mesh(to_surface(shape)),
      lines(mesh, labels, crease_rad, deep_m),
      triangles(shape.triangles.size()) {
  samples.reserve(tolerances_m.size());
  for (std::size_t i = 0; i < tolerances_m.size(); ++i)
    samples.push_back({.p_m = shape.vertices_m[i], .tolerance_m = tolerances_m[i]});
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
  return may_collapse(star, to);
}

}  // namespace groundray
