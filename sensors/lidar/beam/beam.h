#pragma once

#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"

namespace groundray {

/// Cross-section of a laser beam and its sampling. Pairs are (horizontal, vertical).
struct BeamSpec {
  enum class Profile { Gaussian, TopHat };
  /// Definition of both widths of a Gaussian beam; those of a top hat are always from edge to edge.
  enum class Width {
    FullWidthHalfMaximum,  ///< between the two points of half the irradiance on the axis
    InverseESquare,  ///< between the two points of 1/e^2 (13.5 %) of the irradiance on the axis
  };
  /// Rotation of the sub-rays about the axis: the same for all pulses, or a random angle for each.
  enum class Turn { Fixed, EachPulse };

  Profile profile = Profile::Gaussian;
  Width width = Width::InverseESquare;
  glm::dvec2 divergence_rad{0};  ///< full angle in the far field; 0 for a parallel beam
  glm::dvec2 aperture_m{0};      ///< full width at the aperture; 0 for a point
  int sub_rays = 1;              ///< number per pulse: 1, or 16, 32, 64, ...
  /// Limit of the refinement of a pulse: `sub_rays` times a power of 2. If absent, a Lidar derives
  /// it from pulse and footprint, and a LaserBeam has `sub_rays`.
  std::optional<int> most_sub_rays;
  Turn turn = Turn::Fixed;
};

/// Laser beam as sub-rays of equal energy. About the axis, at any distance R along it, the sub-rays
/// have the beam's centroid (zero) and second moments (w(R) / 2)^2 to rounding. Here w is the 1/e^2
/// radius of a Gaussian or the edge radius of a top hat, and
/// w(R)^2 = w(0)^2 + (R tan(divergence / 2))^2 in each of the two directions. Immutable and
/// therefore thread-safe.
/// @see docs/theory/lidar_beam.md for the equations.
class LaserBeam {
 public:
  /// Maximum number of sub-rays of a pulse.
  static constexpr int sub_ray_limit = 65536;

  /// Straight line near the axis: it starts at origin + offset_m, given in (h, v), and has the
  /// direction normalize(axis + h * slope.x + v * slope.y), with unit vectors h and v across the
  /// axis.
  struct SubRay {
    glm::dvec2 offset_m{0};
    glm::dvec2 slope{0};
    double per_length = 1;  ///< 1 / |axis + h * slope.x + v * slope.y|
  };
  /// Rotation about the axis, from h towards v.
  struct Rotation {
    double cosine = 1;
    double sine = 0;
  };

  /// Constructs all levels in about n^(7/4) operations for n = the last: 3 ms for 1024, a
  /// few seconds for 65536.
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit LaserBeam(const BeamSpec& spec);

  BeamSpec::Turn turn() const { return turn_; }
  BeamSpec::Profile profile() const { return profile_; }

  /// Returns the number of levels. Level 0 has spec.sub_rays, each next level twice as many as the
  /// one before, up to spec.most_sub_rays.
  int levels() const { return static_cast<int>(levels_.size()); }

  /// Returns the sub-rays of a level in [0, levels()), all of equal energy.
  std::span<const SubRay> sub_rays(int level) const { return at(level).sub_rays; }

  /// Returns sub-ray `index` of a level after a rotation of the sub-rays. The ellipse that they
  /// sample is not rotated, so that moments and edge stay exact.
  SubRay turned(int level, std::size_t index, const Rotation& by) const noexcept {
    const auto turn = [&](const glm::dvec2& p) {
      return glm::dvec2(by.cosine * p.x - by.sine * p.y, by.sine * p.x + by.cosine * p.y);
    };
    const Node& node = at(level).nodes[index];
    const glm::dvec2 slope = tangent_ * turn(node.tilt);
    return {waist_m_ * turn(node.place), slope,
            1 / std::sqrt(1 + slope.x * slope.x + slope.y * slope.y)};
  }

  /// Returns pairs of sub-rays that stay close to each other along the whole beam: each sub-ray
  /// with about its six nearest. Pairs are unique and in ascending order, the smaller index first.
  /// If the ranges of a pair differ much, the level is too coarse.
  std::span<const glm::ivec2> neighbours(int level) const { return at(level).neighbours; }

  /// Cross-section at a distance along the axis.
  struct Section {
    glm::dvec2 radius_m{0};
    glm::dvec2 slope{0};  ///< mean of the sub-rays through the point (radius, radius)
    double range_m = 0;

    /// Returns the mean of the sub-rays through a point, (h, v) in units of the radii.
    SubRay through(const glm::dvec2& p) const noexcept {
      const glm::dvec2 to = p * slope;
      return {p * radius_m - range_m * to, to, 1 / std::sqrt(1 + to.x * to.x + to.y * to.y)};
    }
  };
  Section section(double range_m) const noexcept;

  /// Returns the radii w (1/e^2 or edge) at a distance along the axis. surface_patch()
  /// (core/geometry/footprint.h) projects a width onto a surface.
  glm::dvec2 radius_m(double range_m) const noexcept {
    return {math::hypot(waist_m_.x, range_m * tangent_.x),
            math::hypot(waist_m_.y, range_m * tangent_.y)};
  }

 private:
  // Sub-ray of the beam with radius 1 and tangent 1.
  struct Node {
    glm::dvec2 place{0};
    glm::dvec2 tilt{0};
  };
  struct Level {
    std::vector<Node> nodes;
    std::vector<SubRay> sub_rays;
    std::vector<glm::ivec2> neighbours;
  };

  const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }

  glm::dvec2 waist_m_;  // radii at the aperture
  glm::dvec2 tangent_;  // tangents of the half angles
  BeamSpec::Turn turn_;
  BeamSpec::Profile profile_;
  std::vector<Level> levels_;
};

}  // namespace groundray
