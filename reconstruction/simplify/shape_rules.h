#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Whether a surface that hung over nowhere must do so nowhere.
enum class Overhang { Allow, Refuse };

/// Keeps a surface a manifold whose triangles do not turn over by a collapse nor become needles,
/// whatever it is far from.
class ShapeRules final : public CollapseRules {
 public:
  /// @param piece  must outlive this.
  ShapeRules(const Workpiece& piece, Overhang overhang) : piece_(piece), overhang_(overhang) {}

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star&, const FeatureLines::Crossing&, std::size_t) override {}

  /// The fan of what was allowed last.
  const Fan& fan() const noexcept { return fan_; }
  /// Ends of its edges, in order.
  const std::vector<glm::dvec3>& rim_m() const noexcept { return rim_m_; }
  const glm::dvec3& tip_m() const noexcept { return tip_m_; }

 private:
  bool is_sound(const Star& star, std::size_t i) const;

  const Workpiece& piece_;
  Overhang overhang_;
  Fan fan_;
  glm::dvec3 tip_m_{0};
  std::vector<glm::dvec3> rim_m_;
};

}  // namespace groundray
