#include "terrain/ground_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/geometry/pose.h"
#include "core/math.h"
#include "terrain/trail/smooth_curve.h"

namespace groundray {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::nanoseconds pose_spacing = 10ms;

// Vehicle on the ground: poses from the heights below its centre and its wheels.
class Vehicle {
 public:
  Vehicle(const Ground& ground, const GroundPathSpec& spec) : ground_(ground), spec_(spec) {}

  Pose stand_at(const SmoothCurve::Point& point, std::chrono::nanoseconds time) const {
    const double heading_rad = math::atan2(point.along.y, point.along.x);
    const glm::dvec2 ahead =
        glm::dvec2(math::cos(heading_rad), math::sin(heading_rad)) * (spec_.footprint_m.x / 2);
    const glm::dvec2 left =
        glm::dvec2(-math::sin(heading_rad), math::cos(heading_rad)) * (spec_.footprint_m.y / 2);
    const double front_left = ground_m(point.p_m + ahead + left, "front left wheel", time);
    const double front_right = ground_m(point.p_m + ahead - left, "front right wheel", time);
    const double rear_left = ground_m(point.p_m - ahead + left, "rear left wheel", time);
    const double rear_right = ground_m(point.p_m - ahead - left, "rear right wheel", time);
    // Slopes of the plane forward and to the left: least squares over the four corners of a
    // rectangle.
    const double forward =
        (front_left + front_right - rear_left - rear_right) / (2 * spec_.footprint_m.x);
    const double leftward =
        (front_left + rear_left - front_right - rear_right) / (2 * spec_.footprint_m.y);
    const double pitch_rad = -math::atan(forward);
    const double roll_rad = math::atan(leftward * math::cos(pitch_rad));
    const double z_m = ground_m(point.p_m, "centre", time) + spec_.height_m;
    return {rotation_from_yaw_pitch_roll(heading_rad, pitch_rad, roll_rad), {point.p_m, z_m}};
  }

 private:
  double ground_m(glm::dvec2 p, const char* part, std::chrono::nanoseconds time) const {
    if (const auto z_m = ground_.height_m_at(p)) return *z_m;
    const glm::dvec2 uv = ground_.frame().to_grid(p);
    const glm::dvec2 last(ground_.frame().samples - 1);
    const bool inside = 0 <= uv.x && uv.x <= last.x && 0 <= uv.y && uv.y <= last.y;
    throw Error(
        "ground path: at {:.2f} s the vehicle's {} would stand {} at ({:.3f}, {:.3f}) m in W; move "
        "the waypoints",
        Seconds(time).count(), part, inside ? "in a hole of the DEM" : "outside the DEM",
        spec_.origin_w_m.x + p.x, spec_.origin_w_m.y + p.y);
  }

  const Ground& ground_;
  const GroundPathSpec& spec_;
};

}  // namespace

Trajectory build_ground_path(const Ground& ground, const GroundPathSpec& spec) {
  const auto is_positive = [](double x) { return std::isfinite(x) && x > 0; };
  const double duration_s = Seconds(spec.duration).count();
  Violations broken("ground path");
  SmoothCurve::check(spec.waypoints_m, broken);
  broken.unless(is_positive(spec.speed_m_s), "speed_m_s = {} must be positive", spec.speed_m_s);
  broken.unless(std::isfinite(spec.height_m), "height_m = {} must be finite", spec.height_m);
  broken.unless(std::isfinite(spec.from_m) && spec.from_m >= 0,
                "from_m = {} must be finite and not negative", spec.from_m);
  broken.unless(is_positive(spec.footprint_m.x) && is_positive(spec.footprint_m.y),
                "footprint_m = [{}, {}], wheel base and track, must be positive",
                spec.footprint_m.x, spec.footprint_m.y);
  broken.unless(spec.duration > 0ns, "the duration, {} s, must be positive", duration_s);
  broken.throw_if_any();

  const SmoothCurve curve(spec.waypoints_m);
  const double drive_m = spec.speed_m_s * duration_s;
  constexpr double rounding = 1e-9;  // tolerance for lengths that are meant to be equal
  broken.unless(spec.from_m + drive_m <= curve.length_m() * (1 + rounding),
                "the curve through the waypoints is {:.3f} m long, but {} s at {} m/s cover {:.3f} "
                "m{}; reduce the duration or the speed, or add waypoints",
                curve.length_m(), duration_s, spec.speed_m_s, drive_m,
                spec.from_m > 0 ? fmt::format(" from {} m on", spec.from_m) : "");
  broken.throw_if_any();

  const Vehicle vehicle(ground, spec);
  std::vector<Trajectory::Sample> samples;
  for (std::chrono::nanoseconds time = 0ns;; time += pose_spacing) {
    time = std::min(time, spec.duration);
    samples.push_back(
        {time,
         vehicle.stand_at(curve.at(spec.from_m + spec.speed_m_s * Seconds(time).count()), time)});
    if (time == spec.duration) break;
  }
  return Trajectory(std::move(samples));
}

}  // namespace groundray
