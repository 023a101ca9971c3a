#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

// Plants that lean in wind: docs/reference/wind.md.
namespace groundray {

/// Horizontal wind over the whole scene: a mean, and gusts that travel with it.
struct Wind {
  double speed_m_s = 0;       ///< mean at 10 m above the ground: 0, or 0.1 to 30
  glm::dvec2 towards{1, 0};   ///< unit vector in D
  double turbulence = 0.2;    ///< standard deviation of the speed along the wind, over its mean
  glm::dvec2 origin_w_m{0};   ///< D's origin in W, to which the gusts are fixed
  std::uint64_t variant = 0;  ///< another number gives other gusts

  friend bool operator==(const Wind&, const Wind&) = default;
};

/// Response of a plant of scale 1 to wind.
struct Flexibility {
  double frequency_hz = 1;  ///< natural frequency; inversely proportional to the plant's scale
  double lean_rad = 0;      ///< inclination in a steady wind of 10 m/s, at most 1

  friend bool operator==(const Flexibility&, const Flexibility&) = default;
};

/// Linear map of an upright plant to one that leans, about its foot. Vertical lines become parallel
/// slanted ones of the same length, and horizontal planes stay horizontal.
struct Lean {
  glm::dvec2 tangent{0};  ///< horizontal displacement per height above the foot
  double secant = 1;      ///< length of a line of unit height

  /// Returns true unless the plant is upright.
  explicit operator bool() const noexcept { return tangent != glm::dvec2(0); }
  /// Maps a vector.
  glm::dvec3 leaning(const glm::dvec3& v) const noexcept {
    const double z = v.z / secant;
    return {v.x + tangent.x * z, v.y + tangent.y * z, z};
  }
  /// Returns the inverse of `leaning`.
  glm::dvec3 upright(const glm::dvec3& v) const noexcept {
    return {v.x - tangent.x * v.z, v.y - tangent.y * v.z, secant * v.z};
  }
  /// Maps the normal of a surface; does not keep its length.
  glm::dvec3 leaning_normal(const glm::dvec3& n) const noexcept {
    return {n.x, n.y, secant * n.z - (tangent.x * n.x + tangent.y * n.y)};
  }
  /// Returns the inverse of `leaning_normal`.
  glm::dvec3 upright_normal(const glm::dvec3& n) const noexcept {
    return {n.x, n.y, (n.z + (tangent.x * n.x + tangent.y * n.y)) / secant};
  }
};

/// Inclination of plants of one kind by wind, in closed form of place and time. Immutable.
class Sway {
 public:
  /// Bounds of Lean::tangent.
  struct Range {
    glm::dvec2 low{0}, high{0};
  };

  /// Constructs the sway of objects that stand still.
  Sway() = default;
  /// @throws Error listing each value that is out of bounds.
  Sway(const Wind& wind, const Flexibility& plant);

  bool is_still() const noexcept { return tangent_per_m_s_ == 0; }

  /// Computes the inclination of a plant at several times.
  /// @param p_D  position of its foot.
  /// @param leans  one for each time.
  void lean(const glm::dvec2& p_D, double scale, std::span<const double> times_s,
            std::span<Lean> leans) const noexcept;
  /// Returns the same for one time.
  Lean lean(const glm::dvec2& p_D, double scale, double time_s) const noexcept;

  /// Returns the velocity of a point of a leaning plant, m/s in D.
  /// @param height_m  of the point above the foot.
  glm::dvec3 velocity_m_s(const glm::dvec2& p_D, double scale, double time_s,
                          double height_m) const noexcept;

  /// Returns bounds over all places, scales and times.
  Range range() const noexcept;

 private:
  // Plane wave of the wind's speed, or of the speed that would have the effect of the resonance.
  struct Wave {
    double rate_hz = 0;
    glm::dvec2 turns_per_m{0};
    double turn = 0;  // phase at W's origin and time 0
    double amplitude_m_s = 0;
  };
  struct Phase {
    double rate_hz, turn;
  };
  static constexpr std::size_t gusts = 4, resonances = 2;
  using Phases = std::array<Phase, gusts + resonances>;

  Phases phases(const glm::dvec2& p_D, double scale) const noexcept;
  template <typename Real>
  void tangent(const Phases& phases, const Real& time_s, Real& x, Real& y) const noexcept;

  std::array<Wave, gusts + resonances> waves_;  // resonances last, at scale 1
  double speed_m_s_ = 0;
  glm::dvec2 towards_{1, 0}, origin_w_m_{0};
  double tangent_per_m_s_ = 0;
};

}  // namespace groundray
