#include "reconstruction/mesh/simplify/volume_collapse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace groundray {
namespace {

// Squared sine and cosine of one degree.
constexpr double least_sine2 = 3.0458649045213493e-4, most_cosine2 = 1 - least_sine2;

/// Symmetric quadratic form p * h * p + 2 * c * p.
struct Form {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  glm::dvec3 c{0};

  glm::dvec3 times(const glm::dvec3& p) const {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z};
  }
};

// Returns two directions perpendicular to another and to each other.
std::pair<glm::dvec3, glm::dvec3> across(const glm::dvec3& along) {
  const glm::dvec3 size = glm::abs(along);
  glm::dvec3 aside(1, 0, 0);
  if (size.y <= size.x && size.y <= size.z) aside = {0, 1, 0};
  if (size.z <= size.x && size.z < size.y) aside = {0, 0, 1};
  const glm::dvec3 one = glm::cross(along, aside);
  return {one, glm::cross(along, one)};
}

/// Up to three planes that contain the position, no two nearly parallel.
class Planes {
 public:
  std::size_t size() const { return count_; }

  /// Adds normal * p = offset if it is independent of the others.
  void add(const glm::dvec3& normal, double offset) {
    if (count_ == 3) return;
    const double square = glm::dot(normal, normal);
    if (!(square > 0) || !std::isfinite(square)) return;
    if (count_ == 1) {
      const double along = glm::dot(normals_[0], normal);
      if (!(along * along < most_cosine2 * glm::dot(normals_[0], normals_[0]) * square)) return;
    }
    if (count_ == 2) {
      const glm::dvec3 line = glm::cross(normals_[0], normals_[1]);
      const double apart = glm::dot(line, normal);
      if (!(apart * apart > least_sine2 * glm::dot(line, line) * square)) return;
    }
    normals_[count_] = normal;
    offsets_[count_++] = offset;
  }

  /// Adds the conditions that minimise a form within the planes so far.
  void add_least(const Form& form) {
    if (count_ == 0) {
      add({form.xx, form.xy, form.xz}, -form.c.x);
      add({form.xy, form.yy, form.yz}, -form.c.y);
      add({form.xz, form.yz, form.zz}, -form.c.z);
    } else if (count_ == 1) {
      const auto [one, other] = across(normals_[0]);
      add(form.times(one), -glm::dot(form.c, one));
      add(form.times(other), -glm::dot(form.c, other));
    } else if (count_ == 2) {
      const glm::dvec3 line = glm::cross(normals_[0], normals_[1]);
      add(form.times(line), -glm::dot(form.c, line));
    }
  }

  /// Returns the intersection of all three.
  glm::dvec3 meet() const {
    const auto& [a, b, c] = normals_;
    const glm::dvec3 bc = glm::cross(b, c);
    return (offsets_[0] * bc + offsets_[1] * glm::cross(c, a) + offsets_[2] * glm::cross(a, b)) /
           glm::dot(a, bc);
  }

 private:
  std::array<glm::dvec3, 3> normals_{};
  std::array<double, 3> offsets_{};
  std::size_t count_ = 0;
};

// Twice the area vector of the triangles between a position p and the boundary edges is along x p +
// moment. The component of p along `along` is free.
void keep_border(const EdgeSurroundings& edge, Planes& planes) {
  glm::dvec3 along(0), moment(0);
  for (const auto& [begin, end] : edge.borders) {
    along += end - begin;
    moment += glm::cross(begin, end);
  }
  const double square = glm::dot(along, along);
  if (!(square > 0)) return;
  const glm::dvec3 best = glm::cross(along, moment) / square;
  const auto [one, other] = across(along);
  planes.add(one, glm::dot(one, best));
  planes.add(other, glm::dot(other, best));
}

Form form_of(const EdgeSurroundings& edge) {
  const VolumeTerm& v = edge.volume;
  Form form{v.xx, v.xy, v.xz, v.yy, v.yz, v.zz, -edge.pull};
  const double weight = 9 * glm::dot(edge.edge_m, edge.edge_m);
  for (const auto& [begin, end] : edge.borders) {
    const glm::dvec3 e = end - begin;
    const double square = glm::dot(e, e);
    form.xx += weight * (square - e.x * e.x), form.yy += weight * (square - e.y * e.y);
    form.zz += weight * (square - e.z * e.z);
    form.xy -= weight * e.x * e.y, form.xz -= weight * e.x * e.z, form.yz -= weight * e.y * e.z;
    form.c += weight * glm::cross(glm::cross(begin, end), e);
  }
  return form;
}

double cost_of(const EdgeSurroundings& edge, const glm::dvec3& p) {
  double border = 0;
  for (const auto& [begin, end] : edge.borders) {
    const glm::dvec3 area = glm::cross(begin - p, end - p);
    border += glm::dot(area, area);
  }
  const double volume = glm::dot(p, edge.volume.times(p) - 2.0 * edge.pull) + edge.rest;
  return std::max(0.0, volume) / 72 + glm::dot(edge.edge_m, edge.edge_m) * border / 8;
}

// Returns true if a triangle is counter-clockwise from above by more than the rounding of its final
// position, `away_m` from the world's origin: half an ulp of each coordinate.
bool lies_flat(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double away_m) {
  const glm::dvec3 ab = b - a, ac = c - a, bc = c - b;
  const double longest2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
  const double rounding_m = 8 * std::numeric_limits<double>::epsilon() * away_m;
  return ab.x * ac.y - ab.y * ac.x > std::max(1e-6 * longest2, rounding_m * std::sqrt(longest2));
}

}  // namespace

std::optional<EdgePlacement> place_edge(const EdgeSurroundings& edge) noexcept {
  Planes planes;
  if (!edge.borders.empty()) keep_border(edge, planes);
  planes.add(edge.volume.normal, edge.lift);
  if (planes.size() < 3) planes.add_least(form_of(edge));
  if (planes.size() < 3) {
    if (!edge.middle_m) return std::nullopt;
    planes.add_least({.xx = 1, .yy = 1, .zz = 1, .c = -*edge.middle_m});
    if (planes.size() < 3) return std::nullopt;
  }
  const glm::dvec3 place = planes.meet();
  return EdgePlacement{place, cost_of(edge, place)};
}

VolumeCollapse::VolumeCollapse(CollapsibleMesh& mesh, std::vector<glm::dvec3>& places_m,
                               const Lie& lie, const std::function<void(double share)>& tell)
    : mesh_(mesh),
      places_m_(places_m),
      lie_(lie),
      terms_(places_m.size()),
      rings_(places_m.size()),
      is_border_(places_m.size()),
      changed_(places_m.size()),
      queue_(3 * mesh.numbers()) {
  for (std::uint32_t i = 0; i < mesh.numbers(); ++i) {
    const glm::dvec3 n = normal(i);
    for (HalfEdge h = 3 * i; h < 3 * i + 3; ++h) {
      terms_[mesh.from(h)].add(n);
      if (mesh.twin(h) == none) is_border_[mesh.from(h)] = is_border_[mesh.to(h)] = true;
    }
  }
  for (std::uint32_t vertex = 0; vertex < places_m.size(); ++vertex) {
    if (!mesh.has_vertex(vertex)) continue;
    mesh.gather(vertex, round_);
    note_ring(round_);
  }
  for (HalfEdge h = 0; h < 3 * mesh.numbers(); ++h) {
    if (edge_of(h) == h) enter(h);
    if (h % 16384 == 0) tell(static_cast<double>(h) / static_cast<double>(3 * mesh.numbers()));
  }
}

// Returns the number of a half-edge's edge.
HalfEdge VolumeCollapse::edge_of(HalfEdge h) const noexcept { return std::min(h, mesh_.twin(h)); }

glm::dvec3 VolumeCollapse::normal(std::uint32_t triangle) const noexcept {
  const glm::uvec3 t = mesh_.corners(triangle);
  const glm::dvec3& a = places_m_[t.x];
  return glm::cross(places_m_[t.y] - a, places_m_[t.z] - a);
}

void VolumeCollapse::sum_up(std::uint32_t vertex) {
  mesh_.gather(vertex, round_);
  VolumeTerm term;
  const glm::dvec3& centre_m = places_m_[vertex];
  glm::dvec3 before = places_m_[round_.ring[0]] - centre_m;
  for (std::size_t i = 0; i < round_.spokes.size(); ++i) {
    const glm::dvec3 after = places_m_[round_.ring[(i + 1) % round_.ring.size()]] - centre_m;
    term.add(glm::cross(before, after));
    before = after;
  }
  terms_[vertex] = term;
  note_ring(round_);
}

void VolumeCollapse::note_ring(const Star& star) {
  Ring ring{.count = static_cast<std::uint32_t>(star.ring.size())};
  for (const std::uint32_t vertex : star.ring)
    ring.sum_m += places_m_[vertex] - places_m_[star.centre];
  if (star.is_open()) {
    ring.first = star.ring.front();
    ring.last = star.ring.back();
  }
  rings_[star.centre] = ring;
}

// Adds the boundary edges at a vertex, each once.
void VolumeCollapse::add_borders(std::uint32_t vertex, const glm::dvec3& origin_m) {
  if (!is_border_[vertex]) return;
  const Ring& ring = rings_[vertex];
  const glm::dvec3 centre_m = places_m_[vertex] - origin_m;
  const auto add = [&](const BorderEdge& edge) {
    for (const BorderEdge& known : borders_) {
      if (known.begin_m == edge.begin_m && known.end_m == edge.end_m) return;
    }
    borders_.push_back(edge);
  };
  add({centre_m, places_m_[ring.first] - origin_m});
  add({places_m_[ring.last] - origin_m, centre_m});
}

// Returns the mean of the vertices around an edge, relative to its first end.
glm::dvec3 VolumeCollapse::middle_round(HalfEdge h) const noexcept {
  const Ring &a = rings_[mesh_.from(h)], &b = rings_[mesh_.to(h)];
  const glm::dvec3 edge_m = places_m_[mesh_.to(h)] - places_m_[mesh_.from(h)];
  // Excludes both ends, each of which is in the other's ring.
  const double more = static_cast<double>(b.count) - 1;
  const double count = static_cast<double>(a.count) - 1 + more;
  const glm::dvec3 sum_m = a.sum_m + b.sum_m + more * edge_m;
  return count > 0 ? sum_m / count : sum_m;
}

std::optional<EdgePlacement> VolumeCollapse::placement(HalfEdge h) {
  const std::uint32_t a = mesh_.from(h), b = mesh_.to(h);
  const glm::dvec3& origin_m = places_m_[a];
  EdgeSurroundings edge{.edge_m = places_m_[b] - origin_m, .volume = terms_[a]};
  const VolumeTerm& of_b = terms_[b];
  edge.volume += of_b;
  edge.volume.add(normal(h / 3), -1);
  if (mesh_.twin(h) != none) edge.volume.add(normal(mesh_.twin(h) / 3), -1);
  edge.pull = of_b.times(edge.edge_m);
  edge.lift = glm::dot(of_b.normal, edge.edge_m);
  edge.rest = glm::dot(edge.edge_m, edge.pull);
  borders_.clear();
  add_borders(a, origin_m);
  add_borders(b, origin_m);
  edge.borders = borders_;
  edge.middle_m = middle_round(h);
  auto found = place_edge(edge);
  if (found) found->place_m += origin_m;
  return found;
}

void VolumeCollapse::enter(HalfEdge h) {
  ++looked_at_;
  if (const auto found = placement(h); found && std::isfinite(found->cost)) {
    queue_.set(h, found->cost);
  } else {
    queue_.remove(h);
  }
}

// Chooses the end that vanishes, in the interior if there is one. Returns false if neither may.
bool VolumeCollapse::choose_centre(HalfEdge h) {
  std::uint32_t centre = mesh_.from(h), onto = mesh_.to(h);
  if (is_border_[centre] && is_border_[onto] && mesh_.twin(h) != none) return false;
  if (is_border_[centre] && !is_border_[onto]) std::swap(centre, onto);
  mesh_.gather(centre, star_);
  to_ = static_cast<std::size_t>(std::find(star_.ring.begin(), star_.ring.end(), onto) -
                                 star_.ring.begin());
  return mesh_.may_collapse(star_, to_);
}

// Returns true if moving the centre flips none of the star's triangles that stay.
bool VolumeCollapse::keeps_sides(const Star& star, std::uint32_t other,
                                 const glm::dvec3& place_m) const {
  const glm::dvec3& centre_m = places_m_[star.centre];
  for (std::size_t i = 0; i < star.spokes.size(); ++i) {
    const std::uint32_t a = star.ring[i], b = star.ring[(i + 1) % star.ring.size()];
    if (a == other || b == other) continue;
    const glm::dvec3 &p = places_m_[a], &q = places_m_[b];
    const glm::dvec3 before = glm::cross(p - centre_m, q - centre_m);
    if (glm::dot(before, glm::cross(p - place_m, q - place_m)) < 0) return false;
    if (lie_.overhang == Overhang::Refuse && !lies_flat(place_m, p, q, lie_.away_m)) return false;
  }
  return true;
}

// Nearly parallel planes can intersect anywhere, so the position must be near.
bool VolumeCollapse::is_legal(const glm::dvec3& place_m) const {
  const glm::dvec3 middle_m = 0.5 * (places_m_[star_.centre] + places_m_[other_.centre]);
  double reach2 = 0;
  for (const Star* star : {&star_, &other_}) {
    for (const std::uint32_t vertex : star->ring) {
      const glm::dvec3 to = places_m_[vertex] - middle_m;
      reach2 = std::max(reach2, glm::dot(to, to));
    }
  }
  const glm::dvec3 moved = place_m - middle_m;
  return glm::dot(moved, moved) <= 4 * reach2 && keeps_sides(star_, other_.centre, place_m) &&
         keeps_sides(other_, star_.centre, place_m);
}

// Evaluates the edges at a vertex next to a collapse; those between two such vertices once.
void VolumeCollapse::enter_round(std::uint32_t vertex) {
  mesh_.gather(vertex, other_);
  for (std::size_t i = 0; i < other_.ring.size(); ++i) {
    const std::uint32_t end = other_.ring[i];
    if (changed_[end] == collapses_ && end < vertex) continue;
    enter(edge_of(i < other_.spokes.size() ? other_.spokes[i] : before(other_.spokes.back())));
  }
}

void VolumeCollapse::collapse(const glm::dvec3& place_m) {
  const std::uint32_t kept = other_.centre;
  // Edges of vanishing triangles get other numbers.
  for (std::size_t i = 0; i < star_.spokes.size(); ++i) {
    if (star_.ring[i] != kept && star_.ring[(i + 1) % star_.ring.size()] != kept) continue;
    const HalfEdge h = star_.spokes[i];
    for (const HalfEdge side : {h, next_of(h), before(h)}) queue_.remove(edge_of(side));
  }
  mesh_.collapse(star_, to_);
  places_m_[kept] = place_m;
  ++collapses_;
  mesh_.gather(kept, star_);
  changed_[kept] = collapses_;
  for (const std::uint32_t vertex : star_.ring) changed_[vertex] = collapses_;
  sum_up(kept);
  for (const std::uint32_t vertex : star_.ring) sum_up(vertex);
  enter_round(kept);
  for (const std::uint32_t vertex : star_.ring) enter_round(vertex);
}

std::optional<VolumeCollapse::Merge> VolumeCollapse::step() {
  while (!queue_.empty()) {
    const HalfEdge h = queue_.top();
    queue_.remove(h);
    if (!choose_centre(h)) continue;
    const auto found = placement(h);
    mesh_.gather(star_.ring[to_], other_);
    if (!found || !is_legal(found->place_m)) continue;
    const Merge merge{star_.centre, other_.centre};
    collapse(found->place_m);
    return merge;
  }
  return std::nullopt;
}

}  // namespace groundray
