#include "reconstruction/mesh/simplify/bounds/distance_rules.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "reconstruction/mesh/simplify/bounds/vector_to_edge.h"

namespace groundray {

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
        {star.triangle(i % star.spokes.size()),
         {star.ring[to], star.ring[i % star.ring.size()], star.ring[(i + 1) % star.ring.size()]}});
  }
  if (!fan_.empty()) return;
  const std::uint32_t beyond = piece_.mesh.twin(next_of(star.spokes[0])) / 3;
  fan_.push_back({beyond, piece_.mesh.corners(beyond)});
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
