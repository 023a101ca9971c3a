#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/tracing/ray.h"
#include "sensors/lidar/beam/beam.h"

namespace groundray {

/// Axis of a pulse as it leaves, and the unit vector h across it, both in D.
struct PulseAxis {
  const Ray& ray;
  const glm::dvec3& horizontal;
};

/// Plane on which a footprint lies: the points p in D with dot(normal, p) = offset_m.
struct FootprintPlane {
  glm::dvec3 normal{0};
  double offset_m = 0;
  double axis_m = 0;           ///< distance along the axis
  LaserBeam::Section section;  ///< of the beam there
  glm::dvec3 vertical{0};      ///< unit vector v across the axis, in D
  glm::dvec2 along{0};         ///< (h, v) in units of the radii: where the range decreases; unit
  std::size_t table = 0;       ///< of the quadrature
};

/// Sub-rays of unequal energy that sample a footprint, their hits, their shares of the pulse's
/// energy, which add up to 1, and for each the index of a traced hit with its attributes.
struct FootprintSamples {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<double> shares;
  std::vector<std::uint32_t> traced;
  std::vector<glm::dvec3> points;  ///< in D, of the traced hits
};

/// Quadrature of a beam over a plane that its footprint lies on: no further rays are traced. Ranges
/// of neighbouring nodes are so close that their pulses add up to a smooth waveform. Immutable and
/// therefore thread-safe.
/// @see docs/theory/lidar_beam.md
class PlaneQuadrature {
 public:
  /// @param spacing_m  largest difference between the ranges of neighbouring nodes.
  /// @param resolution_m  differences in range up to this need no quadrature.
  PlaneQuadrature(BeamSpec::Profile profile, double spacing_m, double resolution_m);

  /// Returns the plane that all of a pulse's sub-rays hit. Empty if their ranges differ by no more
  /// than the resolution, if they hit several objects or nothing, if any lies farther than 1/256 of
  /// the resolution from the plane (in range), or if the beam's edge is nearly parallel to the
  /// plane.
  std::optional<FootprintPlane> plane_of(const LaserBeam& beam, const PulseAxis& axis,
                                         std::span<const Ray> rays,
                                         std::span<const Hit> hits) const noexcept;

  /// Sets `samples` to the quadrature of a beam over a plane, nearly in order of range.
  /// @param traced  hits from which the plane was found.
  void sample(const PulseAxis& axis, const FootprintPlane& plane, std::span<const Ray> rays,
              std::span<const Hit> traced, FootprintSamples& samples) const;

 private:
  // Position in units of the beam's radius, and share of the energy.
  struct Node {
    double along = 0, across = 0;  // the gradient
    double share = 0;
  };

  double spacing_m_, resolution_m_;
  double reach_;                           // of the nodes, in units of the beam's radius
  std::vector<std::vector<Node>> tables_;  // each next one has more nodes
};

}  // namespace groundray
