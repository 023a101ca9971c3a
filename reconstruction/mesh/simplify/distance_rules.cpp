#include "reconstruction/mesh/simplify/distance_rules.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

#include "core/geometry/mesh.h"

namespace groundray {
namespace {

constexpr std::size_t few_parts = 16, most_parts = 128;  // per triangle

bool has(const Star& star, std::uint32_t triangle) {
  return std::ranges::any_of(star.spokes, [&](SurfaceMesh::HalfedgeHandle spoke) {
    return number_of(star.mesh->face_handle(spoke)) == triangle;
  });
}

}  // namespace

FaceCorrespondence::FaceCorrespondence(const DecimationState& piece,
                                       const std::vector<glm::uvec3>& triangles)
    : piece_(piece),
      triangles_(triangles),
      firsts_(triangles.size()),
      firsts_of_(triangles.size()),
      nearest_(piece.samples.size()),
      asked_of_(triangles.size()) {
  entries_.reserve(triangles.size() + triangles.size() / 4);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    firsts_[i] = firsts_of_[i] = i;
    entries_.push_back({.original = i, .triangle = i});
  }
}

double FaceCorrespondence::distance_m(const glm::dvec3& p_m, std::uint32_t candidate) const {
  const auto& [a, b, c] = candidates_[candidate].corners_m;
  return glm::length(vector_to_triangle(p_m, a, b, c));
}

// Assigns the best candidate from `first` on, if it is better than the corner's.
void FaceCorrespondence::choose_nearest(ProofCorner& corner, std::size_t first) const {
  for (std::size_t i = first; i < candidates_.size(); ++i) {
    const auto candidate = static_cast<std::uint32_t>(i);
    const double excess = excess_m(corner, candidate);
    if (!(excess < corner.excess_m)) continue;
    corner.excess_m = excess;
    corner.nearest = candidate;
  }
}

ProofCorner FaceCorrespondence::corner(const ProofCorner& a, const ProofCorner& b,
                                       double share) const {
  ProofCorner corner{.p_m = (1 - share) * a.p_m + share * b.p_m,
                     .excess_m = std::numeric_limits<double>::infinity(),
                     .tolerance_m = (1 - share) * a.tolerance_m + share * b.tolerance_m};
  choose_nearest(corner, 0);
  return corner;
}

double FaceCorrespondence::excess_m(const ProofCorner& corner, std::uint32_t candidate) const {
  return distance_m(corner.p_m, candidate) - corner.tolerance_m;
}

void FaceCorrespondence::use(std::uint32_t candidate) {
  if (std::find(used_.begin(), used_.end(), candidate) == used_.end()) used_.push_back(candidate);
}

// A vertex is a corner of many triangles, so its nearest triangle of the fan is found only once.
ProofCorner FaceCorrespondence::corner_at(std::uint32_t vertex) {
  const Sample& sample = piece_.samples[vertex];
  Nearest& known = nearest_[vertex];
  if (known.asked != asked_) {
    known = {.asked = asked_, .distance_m = std::numeric_limits<double>::infinity()};
    for (std::uint32_t i = 0; i < fan_size_; ++i) {
      const double distance = distance_m(sample.p_m, i);
      if (!(distance < known.distance_m)) continue;
      known.distance_m = distance;
      known.of_fan = i;
    }
  }
  const auto tolerance_m = static_cast<double>(sample.tolerance_m);
  ProofCorner corner{.p_m = sample.p_m,
                     .nearest = known.of_fan,
                     .excess_m = known.distance_m - tolerance_m,
                     .tolerance_m = tolerance_m};
  choose_nearest(corner, fan_size_);
  return corner;
}

void FaceCorrespondence::add_candidate(const PlacedTriangle& triangle) {
  const glm::uvec3& t = triangle.corners;
  candidates_.push_back(
      {triangle, {piece_.samples[t.x].p_m, piece_.samples[t.y].p_m, piece_.samples[t.z].p_m}});
}

// Returns true if the candidates cover a triangle of the original, as seen along its normal, within
// tolerance.
bool FaceCorrespondence::covers(const glm::uvec3& original, std::uint32_t nearest) {
  std::vector<std::uint32_t> vertices;
  TriangleMesh mesh;
  for (const Candidate& candidate : candidates_) {
    glm::uvec3 t;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = candidate.triangle.corners[k];
      t[k] = static_cast<std::uint32_t>(std::find(vertices.begin(), vertices.end(), vertex) -
                                        vertices.begin());
      if (t[k] < vertices.size()) continue;
      vertices.push_back(vertex);
      mesh.vertices_m.push_back(piece_.samples[vertex].p_m);
    }
    mesh.triangles.push_back(t);
  }
  std::array<glm::dvec3, 3> corners_m;
  double tolerance_m = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Sample& sample = piece_.samples[original[k]];
    corners_m[static_cast<std::size_t>(k)] = sample.p_m;
    tolerance_m = std::min(tolerance_m, static_cast<double>(sample.tolerance_m));
  }
  used_.clear();
  const glm::dvec3 upright = glm::cross(corners_m[1] - corners_m[0], corners_m[2] - corners_m[0]);
  return CoverBound(mesh).is_within(corners_m, upright, nearest, [&](std::uint32_t triangle) {
    use(triangle);
    return tolerance_m;
  });
}

// Returns true if the fan and the other triangles that represent an original still can.
bool FaceCorrespondence::stands(const Star& star, std::uint32_t original) {
  candidates_.resize(fan_size_);
  for (std::uint32_t e = firsts_of_[original]; e != none; e = entries_[e].next_of_same) {
    const std::uint32_t triangle = entries_[e].triangle;
    if (!has(star, triangle)) add_candidate({triangle, corners_of(piece_.mesh, triangle)});
  }
  const glm::uvec3& t = triangles_[original];
  const std::array<ProofCorner, 3> corners{corner_at(t.x), corner_at(t.y), corner_at(t.z)};
  for (const ProofCorner& corner : corners) {
    if (!(corner.excess_m <= 0)) return false;
  }
  used_.clear();
  if (!proof_.holds(corners, few_parts, *this) && !covers(t, corners[0].nearest)) {
    used_.clear();
    if (!proof_.holds(corners, most_parts, *this)) return false;
  }
  for (const std::uint32_t candidate : used_)
    proved_.emplace_back(original, candidates_[candidate].triangle.number);
  return true;
}

// Frees the entries at a link that are out of date.
std::uint32_t& FaceCorrespondence::clean(std::uint32_t& link) {
  while (link != none && entries_[link].original == none) {
    const std::uint32_t gone = link;
    link = entries_[gone].next;
    free(gone);
  }
  return link;
}

// A triangle that failed once tends to fail again, so it is moved to the front and tested first.
bool FaceCorrespondence::allow(const Star& star, const std::vector<PlacedTriangle>& fan) {
  ++asked_;
  candidates_.clear();
  for (const PlacedTriangle& triangle : fan) add_candidate(triangle);
  fan_size_ = fan.size();
  proved_.clear();
  for (std::size_t i = 0; i < star.triangles(); ++i) {
    const std::uint32_t first = clean(firsts_[star.triangle(i)]);
    if (first == none) continue;
    const std::uint32_t original = entries_[first].original;
    if (asked_of_[original] == asked_) continue;
    asked_of_[original] = asked_;
    if (!stands(star, original)) return false;
  }
  for (std::size_t i = 0; i < star.triangles(); ++i) {
    std::uint32_t& head = firsts_[star.triangle(i)];
    for (std::uint32_t* link = &head; clean(*link) != none; link = &entries_[*link].next) {
      const std::uint32_t entry = *link, original = entries_[entry].original;
      if (asked_of_[original] == asked_) continue;
      asked_of_[original] = asked_;
      if (stands(star, original)) continue;
      *link = entries_[entry].next;
      entries_[entry].next = head;
      head = entry;
      return false;
    }
  }
  return true;
}

void FaceCorrespondence::add(std::uint32_t original, std::uint32_t triangle) {
  std::uint32_t entry = free_;
  if (entry == none) {
    entry = static_cast<std::uint32_t>(entries_.size());
    entries_.emplace_back();
  } else {
    free_ = entries_[entry].next;
  }
  entries_[entry] = {original, triangle, firsts_[triangle], firsts_of_[original]};
  firsts_[triangle] = firsts_of_[original] = entry;
}

void FaceCorrespondence::free(std::uint32_t entry) {
  entries_[entry].next = free_;
  free_ = entry;
}

void FaceCorrespondence::collapse(const Star& star) {
  for (const auto& [original, triangle] : proved_) {
    for (std::uint32_t e = firsts_of_[original]; e != none; e = entries_[e].next_of_same)
      entries_[e].original = none;
    firsts_of_[original] = none;
  }
  for (std::size_t i = 0; i < star.triangles(); ++i) clean(firsts_[star.triangle(i)]);
  for (const auto& [original, triangle] : proved_) add(original, triangle);
}

DistanceRules::DistanceRules(DecimationState& piece, const ClosestPoint& original,
                             std::optional<double> border_m)
    : piece_(piece),
      original_(original),
      border_m_(border_m),
      shape_(piece, Overhang::Allow),
      stand_ins_(piece, original.mesh().triangles),
      cover_(original.mesh()),
      near_original_(original, cover_, [this](std::uint32_t triangle) {
        const glm::uvec3& t = original_.mesh().triangles[triangle];
        return static_cast<double>(
            std::min({piece_.samples[t.x].tolerance_m, piece_.samples[t.y].tolerance_m,
                      piece_.samples[t.z].tolerance_m}));
      }) {}

// Collects the fan. If the star's only triangle vanishes, the triangle beyond its outer edge
// represents it.
void DistanceRules::set_fan(const Star& star, std::size_t to) {
  const Fan& fan = shape_.fan();
  fan_.clear();
  for (std::size_t i = fan.first; i < fan.first + fan.triangles; ++i) {
    fan_.push_back(
        {star.triangle(i % star.triangles()),
         {star.ring[to], star.ring[i % star.ring.size()], star.ring[(i + 1) % star.ring.size()]}});
  }
  if (!fan_.empty()) return;
  const auto outer = piece_.mesh.next_halfedge_handle(star.spokes[0]);
  const std::uint32_t beyond = number_of(piece_.mesh.opposite_face_handle(outer));
  fan_.push_back({beyond, corners_of(piece_.mesh, beyond)});
}

// Returns true if a line's new edge is near enough to all vertices that it represents.
bool DistanceRules::keeps_line() {
  const glm::dvec3& end_m = piece_.samples[line_.other_end].p_m;
  return std::all_of(line_.vertices.begin(), line_.vertices.end(), [&](std::uint32_t vertex) {
    const Sample& sample = piece_.samples[vertex];
    const double tolerance_m = static_cast<double>(sample.tolerance_m);
    const double most_m =
        line_.kind == LineKind::Crease ? tolerance_m : border_m_.value_or(tolerance_m);
    return glm::length(vector_to_edge(sample.p_m, shape_.tip_m(), end_m)) <= most_m;
  });
}

bool DistanceRules::is_near_original(const Star& star) {
  const std::vector<glm::dvec3>& rim_m = shape_.rim_m();
  for (std::size_t i = 0; i < shape_.fan().triangles; ++i) {
    if (!near_original_.holds({shape_.tip_m(), rim_m[i], rim_m[i + 1]}, star.triangle(0)))
      return false;
  }
  return true;
}

bool DistanceRules::allow(const Star& star, const FeatureLines::Crossing& crossing,
                          std::size_t to) {
  if (!shape_.allow(star, crossing, to)) return false;
  if (crossing.edges == 2) {
    piece_.lines.gather(star, crossing, to, line_);
    if (!keeps_line()) return false;
  }
  set_fan(star, to);
  return stand_ins_.allow(star, fan_) && is_near_original(star);
}

void DistanceRules::collapse(const Star& star, const FeatureLines::Crossing&, std::size_t) {
  stand_ins_.collapse(star);
}

}  // namespace groundray
