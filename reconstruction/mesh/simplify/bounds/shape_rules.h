#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Treatment of overhangs in a surface without any: allowed, or rejected.
enum class Overhang { Allow, Refuse };

/// Keeps a surface manifold and its triangles from being flipped or becoming slivers, regardless of
/// the distance from the original.
class ShapeRules final : public CollapseRules {
 public:
  /// @param piece  must outlive this.
  ShapeRules(const DecimationState& piece, Overhang overhang)
      : piece_(piece), overhang_(overhang) {}

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star&, const FeatureLines::Crossing&, std::size_t) override {}

  /// Returns the fan of the latest collapse tested.
  const Fan& fan() const noexcept { return fan_; }
  /// Returns the outer ends of its edges, in order.
  const std::vector<glm::dvec3>& rim_m() const noexcept { return rim_m_; }
  const glm::dvec3& tip_m() const noexcept { return tip_m_; }

 private:
  bool is_sound(const Star& star, std::size_t i) const;

  const DecimationState& piece_;
  Overhang overhang_;
  Fan fan_;
  glm::dvec3 tip_m_{0};
  std::vector<glm::dvec3> rim_m_;
};

}  // namespace groundray
