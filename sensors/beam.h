#pragma once

#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// A laser beam's cross-section and how it is sampled. Pairs are (horizontal, vertical).
struct BeamSpec {
  enum class Profile { Gaussian, TopHat };
  /// What both widths of a Gaussian beam mean; those of a top hat are always from rim to rim.
  enum class Width {
    FullWidthHalfMaximum,  ///< between the two points of half the irradiance on the axis
    InverseESquare,        ///< between the two points of 1/e^2 = 13.5 % of it
  };
  /// Whether every pulse has its sub-rays turned about the axis by an angle of its own.
  enum class Turn { Fixed, EachPulse };

  Profile profile = Profile::Gaussian;
  Width width = Width::InverseESquare;
  glm::dvec2 divergence_rad{0};  ///< full angle far from the sensor; 0 for a parallel beam
  glm::dvec2 aperture_m{0};      ///< full width where the beam leaves; 0 for a point
  int sub_rays = 1;              ///< of a pulse: 1, or 16, 32, 64, ...
  int most_sub_rays = 1;         ///< `sub_rays` times a power of 2: how far a pulse may be refined
  Turn turn = Turn::Fixed;
};

/// A laser beam as sub-rays of equal energy. About the axis, at any distance R along it, they have
/// the beam's centroid (zero) and its second moments (w(R) / 2)^2 to rounding, with w the 1/e^2
/// radius of a Gaussian or the rim of a top hat, w(R)^2 = w(0)^2 + (R tan(divergence / 2))^2 in
/// each of the two directions. Immutable, so any number of threads may use one.
/// @see docs/lidar_beam.md for the equations.
class LaserBeam {
 public:
  /// A pulse has at most this many sub-rays.
  static constexpr int sub_ray_limit = 65536;

  /// A straight line near the axis: it leaves at origin + offset_m, given in (h, v), and runs along
  /// normalize(axis + h * slope.x + v * slope.y), with unit vectors h and v across the axis.
  struct SubRay {
    glm::dvec2 offset_m{0};
    glm::dvec2 slope{0};
    double per_length = 1;  ///< 1 / |axis + h * slope.x + v * slope.y|
  };
  /// A turn about the axis, from h towards v.
  struct Rotation {
    double cosine = 1;
    double sine = 0;
  };

  /// Takes some n^(7/4) operations for n = spec.most_sub_rays: 3 ms for 1024, a few seconds for
  /// 65536.
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit LaserBeam(const BeamSpec& spec);

  BeamSpec::Turn turn() const { return turn_; }

  /// Returns how many levels there are: level 0 has spec.sub_rays, each further one twice as many
  /// as the one before, and the last spec.most_sub_rays.
  int levels() const { return static_cast<int>(levels_.size()); }

  /// Returns the sub-rays of a level in [0, levels()), each with the same share of the energy.
  std::span<const SubRay> sub_rays(int level) const { return at(level).sub_rays; }

  /// Returns sub-ray `index` of a level after the sub-rays, but not the ellipse that they sample,
  /// have been turned: moments and rim stay exact.
  SubRay turned(int level, std::size_t index, const Rotation& by) const noexcept {
    const auto turn = [&](const glm::dvec2& p) {
      return glm::dvec2(by.cosine * p.x - by.sine * p.y, by.sine * p.x + by.cosine * p.y);
    };
    const Node& node = at(level).nodes[index];
    const glm::dvec2 slope = tangent_ * turn(node.tilt);
    return {waist_m_ * turn(node.place), slope,
            1 / std::sqrt(1 + slope.x * slope.x + slope.y * slope.y)};
  }

  /// Returns pairs of sub-rays (smaller index first, in ascending order, each pair once) that stay
  /// close to one another all along the beam: each sub-ray with about its six nearest. Where their
  /// ranges differ much, the level is too coarse.
  std::span<const glm::ivec2> neighbours(int level) const { return at(level).neighbours; }

  /// Returns the radii w, 1/e^2 or rim, at a distance along the axis.
  glm::dvec2 radius_m(double range_m) const noexcept {
    return {std::hypot(waist_m_.x, range_m * tangent_.x),
            std::hypot(waist_m_.y, range_m * tangent_.y)};
  }

 private:
  // A sub-ray of the beam whose radius and tangent are both 1.
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

  glm::dvec2 waist_m_;  // radii where the beam leaves
  glm::dvec2 tangent_;  // of the half angles
  BeamSpec::Turn turn_;
  std::vector<Level> levels_;
};

}  // namespace groundray
