#include "reconstruction/simplify/distance_rules.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

#include "reconstruction/simplify/vector_to_edge.h"

namespace groundray {

DistanceRules::DistanceRules(Workpiece& piece, const ClosestPoint& original,
                             std::optional<double> border_m)
    : piece_(piece),
      original_(original),
      border_m_(border_m),
      lists_(piece.mesh.numbers()),
      shape_(piece, Overhang::Allow) {}

// Whether the fan is as near to a vertex as it must be, and which triangle of it is nearest.
bool DistanceRules::is_near(std::uint32_t vertex, std::size_t& triangle) const {
  const Sample& sample = piece_.samples[vertex];
  const std::vector<glm::dvec3>& rim_m = shape_.rim_m();
  double least_m = std::numeric_limits<double>::infinity();
  if (shape_.fan().triangles == 0)
    least_m = glm::length(vector_to_edge(sample.p_m, shape_.tip_m(), rim_m[0]));
  for (std::size_t i = 0; i < shape_.fan().triangles; ++i) {
    const double distance_m =
        glm::length(vector_to_triangle(sample.p_m, shape_.tip_m(), rim_m[i], rim_m[i + 1]));
    if (!(distance_m < least_m)) continue;
    least_m = distance_m;
    triangle = i;
  }
  return least_m <= static_cast<double>(sample.tolerance_m);
}

// Whether a line's new edge is near enough to all that left for it.
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

// Checks all that left for the star's triangles. What is too far once tends to be so again, so it
// is looked at first.
bool DistanceRules::keeps_samples(const Star& star) {
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < star.spokes.size(); ++i) {
    const std::uint32_t first = lists_.first(star.triangle(i));
    if (first != none && !is_near(first, nearest)) return false;
  }
  for (std::size_t i = 0; i < star.spokes.size(); ++i) {
    const std::uint32_t triangle = star.triangle(i);
    std::uint32_t prior = none;
    for (std::uint32_t vertex = lists_.first(triangle); vertex != none;) {
      if (!is_near(vertex, nearest)) {
        if (prior != none) lists_.bring_forward(piece_.samples, triangle, prior);
        return false;
      }
      placed_.emplace_back(vertex, nearest);
      prior = vertex;
      vertex = piece_.samples[vertex].next;
    }
  }
  return true;
}

bool DistanceRules::is_near_original(const glm::dvec3& p_m) {
  const NearestPoint nearest = original_.nearest(p_m, near_);
  near_ = nearest.triangle;
  const glm::uvec3& t = original_.mesh().triangles[near_];
  const float tolerance_m =
      std::min({piece_.samples[t.x].tolerance_m, piece_.samples[t.y].tolerance_m,
                piece_.samples[t.z].tolerance_m});
  return nearest.distance_m <= static_cast<double>(tolerance_m);
}

// Takes samples of the fan's triangles: amid each, on edges that are new, then amid its corners'
// parts.
bool DistanceRules::is_near_original(const Star& star) {
  const std::vector<glm::dvec3>& rim_m = shape_.rim_m();
  const glm::dvec3& tip_m = shape_.tip_m();
  near_ = star.triangle(0);
  const std::size_t triangles = shape_.fan().triangles;
  for (std::size_t i = 0; i < triangles; ++i) {
    if (!is_near_original((tip_m + rim_m[i] + rim_m[i + 1]) / 3.0)) return false;
  }
  const std::size_t last = star.is_open() ? triangles + 1 : triangles;
  for (std::size_t i = star.is_open() ? 0 : 1; i < last; ++i) {
    for (const double share : {0.5, 0.25, 0.75}) {
      if (!is_near_original(tip_m + share * (rim_m[i] - tip_m))) return false;
    }
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    const glm::dvec3 sum = tip_m + rim_m[i] + rim_m[i + 1];
    for (const glm::dvec3& corner : {tip_m, rim_m[i], rim_m[i + 1]}) {
      if (!is_near_original((sum + 3.0 * corner) / 6.0)) return false;
    }
  }
  return true;
}

bool DistanceRules::allow(const Star& star, const FeatureLines::Crossing& crossing,
                          std::size_t to) {
  if (!shape_.allow(star, crossing, to)) return false;
  placed_.clear();
  if (crossing.edges == 2) {
    piece_.lines.gather(star, crossing, to, line_);
    if (!keeps_line()) return false;
  }
  std::size_t nearest = 0;
  if (!is_near(star.centre, nearest)) return false;
  placed_.emplace_back(star.centre, nearest);
  return keeps_samples(star) && is_near_original(star);
}

void DistanceRules::collapse(const Star& star, const FeatureLines::Crossing&, std::size_t) {
  for (std::size_t i = 0; i < star.spokes.size(); ++i) lists_.clear(star.triangle(i));
  // Where the star's one triangle vanishes, the one beyond its outer edge stands for it.
  const std::uint32_t beyond = piece_.mesh.twin(next_of(star.spokes[0])) / 3;
  for (const auto& [vertex, i] : placed_) {
    const std::size_t triangle = (shape_.fan().first + i) % star.spokes.size();
    lists_.add(piece_.samples, shape_.fan().triangles == 0 ? beyond : star.triangle(triangle),
               vertex);
  }
}

}  // namespace groundray
