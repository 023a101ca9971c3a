#include "reconstruction/mesh/simplify/bounds/shape_rules.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace groundray {
namespace {

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
