#include "terrain/ground_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/geometry/pose.h"
#include "core/math.h"

namespace groundray {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::nanoseconds pose_spacing = 10ms;
constexpr double least_spacing_m = 0.01;

// p(t) = c0 + c1 t + c2 t^2 + c3 t^3 for t in [0, 1].
struct Cubic {
  std::array<glm::dvec2, 4> c;

  glm::dvec2 at(double t) const { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
  glm::dvec2 velocity(double t) const { return c[1] + t * (2.0 * c[2] + t * (3.0 * c[3])); }

  // Returns the arc length, by Gauss-Legendre quadrature with five nodes.
  double length_m(double t_begin, double t_end) const {
    constexpr std::array<std::pair<double, double>, 5> nodes{
        {{0, 0.5688888888888889},
         {-0.5384693101056831, 0.4786286704993665},
         {0.5384693101056831, 0.4786286704993665},
         {-0.9061798459386640, 0.2369268850561891},
         {0.9061798459386640, 0.2369268850561891}}};
    const double half = (t_end - t_begin) / 2;
    double sum = 0;
    for (const auto& [node, weight] : nodes) {
      sum += weight * glm::length(velocity(t_begin + half * (1 + node)));
    }
    return sum * half;
  }
};

// Returns the centripetal Catmull-Rom segment from p[1] to p[2]: the knots are separated by the
// square roots of the chords.
Cubic catmull_rom(const std::array<glm::dvec2, 4>& p) {
  const double before = std::sqrt(glm::distance(p[0], p[1]));
  const double across = std::sqrt(glm::distance(p[1], p[2]));
  const double after = std::sqrt(glm::distance(p[2], p[3]));
  const glm::dvec2 chord = p[2] - p[1];
  const glm::dvec2 m1 =
      chord + across * ((p[1] - p[0]) / before - (p[2] - p[0]) / (before + across));
  const glm::dvec2 m2 = chord + across * ((p[3] - p[2]) / after - (p[3] - p[1]) / (across + after));
  return {{p[1], m1, 3.0 * chord - 2.0 * m1 - m2, m1 + m2 - 2.0 * chord}};
}

// Curve through waypoints, parametrised by arc length.
class Curve {
 public:
  struct Point {
    glm::dvec2 p_m;
    double heading_rad;
  };

  explicit Curve(std::span<const glm::dvec2> waypoints_m) {
    const std::size_t n = waypoints_m.size();
    std::vector<glm::dvec2> p{2.0 * waypoints_m[0] - waypoints_m[1]};
    p.insert(p.end(), waypoints_m.begin(), waypoints_m.end());
    p.push_back(2.0 * waypoints_m[n - 1] - waypoints_m[n - 2]);
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Cubic cubic = catmull_rom({p[i], p[i + 1], p[i + 2], p[i + 3]});
      for (int piece = 0; piece < pieces_per_segment; ++piece) {
        const double t = static_cast<double>(piece) / pieces_per_segment;
        pieces_.push_back({cubic, t, length_m_});
        length_m_ += cubic.length_m(t, t + 1.0 / pieces_per_segment);
      }
    }
  }

  double length_m() const { return length_m_; }

  Point at(double s_m) const {
    const auto after = std::ranges::upper_bound(pieces_, s_m, {}, &Piece::start_m);
    const Piece& piece = *std::prev(after);
    double t = piece.t;
    for (int step = 0; step < 20; ++step) {  // Newton's method; three or four steps suffice
      const double rest_m = s_m - piece.start_m - piece.cubic.length_m(piece.t, t);
      if (std::abs(rest_m) <= 1e-14 * length_m_) break;
      t = std::clamp(t + rest_m / glm::length(piece.cubic.velocity(t)), piece.t,
                     piece.t + 1.0 / pieces_per_segment);
    }
    const glm::dvec2 along = piece.cubic.velocity(t);
    return {piece.cubic.at(t), math::atan2(along.y, along.x)};
  }

 private:
  static constexpr int pieces_per_segment = 64;  // short enough for the quadrature
  struct Piece {
    Cubic cubic;
    double t;        // parameter of its start on the segment
    double start_m;  // arc length of its start on the curve
  };
  std::vector<Piece> pieces_;
  double length_m_ = 0;
};

// Vehicle on the ground: poses from the heights below its centre and its wheels.
class Vehicle {
 public:
  Vehicle(const Ground& ground, const GroundPathSpec& spec) : ground_(ground), spec_(spec) {}

  Pose stand_at(const Curve::Point& point, std::chrono::nanoseconds time) const {
    const glm::dvec2 ahead =
        glm::dvec2(math::cos(point.heading_rad), math::sin(point.heading_rad)) *
        (spec_.footprint_m.x / 2);
    const glm::dvec2 left =
        glm::dvec2(-math::sin(point.heading_rad), math::cos(point.heading_rad)) *
        (spec_.footprint_m.y / 2);
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
    return {rotation_from_yaw_pitch_roll(point.heading_rad, pitch_rad, roll_rad), {point.p_m, z_m}};
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

void check_waypoints(std::span<const glm::dvec2> p, Violations& broken) {
  broken.unless(p.size() >= 2, "waypoints_m has {} points; a path needs two or more", p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    broken.unless(std::isfinite(p[i].x + p[i].y), "waypoints_m[{}] = ({}, {}) must be finite", i,
                  p[i].x, p[i].y);
    if (i == 0) continue;
    const double chord_m = glm::distance(p[i - 1], p[i]);
    broken.unless(
        !(chord_m < least_spacing_m),
        "waypoints_m[{}] is {} m from the previous one; the distance must be {} m or more: "
        "is it a duplicate?",
        i, chord_m, least_spacing_m);
    if (i + 1 == p.size()) continue;
    const glm::dvec2 in = glm::normalize(p[i] - p[i - 1]);
    const glm::dvec2 out = glm::normalize(p[i + 1] - p[i]);
    broken.unless(!(glm::distance(in, -out) < 1e-3),
                  "the path reverses at waypoints_m[{}] = ({}, {}); add waypoints for the turn", i,
                  p[i].x, p[i].y);
  }
}

}  // namespace

Trajectory build_ground_path(const Ground& ground, const GroundPathSpec& spec) {
  const auto is_positive = [](double x) { return std::isfinite(x) && x > 0; };
  const double duration_s = Seconds(spec.duration).count();
  Violations broken("ground path");
  check_waypoints(spec.waypoints_m, broken);
  broken.unless(is_positive(spec.speed_m_s), "speed_m_s = {} must be positive", spec.speed_m_s);
  broken.unless(std::isfinite(spec.height_m), "height_m = {} must be finite", spec.height_m);
  broken.unless(is_positive(spec.footprint_m.x) && is_positive(spec.footprint_m.y),
                "footprint_m = [{}, {}], wheel base and track, must be positive",
                spec.footprint_m.x, spec.footprint_m.y);
  broken.unless(spec.duration > 0ns, "the duration, {} s, must be positive", duration_s);
  broken.throw_if_any();

  const Curve curve(spec.waypoints_m);
  const double drive_m = spec.speed_m_s * duration_s;
  constexpr double rounding = 1e-9;  // tolerance for lengths that are meant to be equal
  broken.unless(drive_m <= curve.length_m() * (1 + rounding),
                "the curve through the waypoints is {:.3f} m long, but {} s at {} m/s cover {:.3f} "
                "m; reduce the duration or the speed, or add waypoints",
                curve.length_m(), duration_s, spec.speed_m_s, drive_m);
  broken.throw_if_any();

  const Vehicle vehicle(ground, spec);
  std::vector<Trajectory::Sample> samples;
  for (std::chrono::nanoseconds time = 0ns;; time += pose_spacing) {
    time = std::min(time, spec.duration);
    samples.push_back(
        {time, vehicle.stand_at(curve.at(spec.speed_m_s * Seconds(time).count()), time)});
    if (time == spec.duration) break;
  }
  return Trajectory(std::move(samples));
}

}  // namespace groundray
