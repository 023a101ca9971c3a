#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/ext/scalar_constants.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "core/random.h"
#include "reconstruction/dem/measured_points.h"

namespace groundray::testing {

/// Rolling ground with boulders, which are part of it, and trunks, which are not: all in closed
/// form, with rays cast by marching, independent of groundray's own tracer.
class RollingGround {
 public:
  RollingGround(double half_m, int boulders, int trunks, Seed seed) : seed_(seed) {
    for (int i = 0; i < boulders; ++i) {
      const glm::dvec2 at = uniform(1, i), size = uniform(2, i);
      boulders_.push_back({(2.0 * at - 1.0) * half_m, 0.3 + 0.6 * size.x, 0.1 + 0.35 * size.y});
    }
    for (int i = 0; i < trunks; ++i) {
      const glm::dvec2 at = uniform(3, i), size = uniform(4, i);
      trunks_.push_back({(2.0 * at - 1.0) * half_m, 0.08 + 0.15 * size.x});
    }
  }

  double height_m(glm::dvec2 p) const {
    double z = 0;
    for (const Wave& wave : waves)
      z += wave.height_m * std::sin(glm::dot(wave.per_m, p) + wave.phase);
    for (const Boulder& boulder : boulders_) {
      const glm::dvec2 off = (p - boulder.place_m) / boulder.radius_m;
      const double inside = 1 - glm::dot(off, off);
      if (inside > 0) z += boulder.height_m * inside * inside;
    }
    return z;
  }
  bool is_in_trunk(glm::dvec2 p, double margin_m) const {
    for (const Trunk& trunk : trunks_)
      if (glm::length(p - trunk.place_m) < trunk.radius_m + margin_m) return true;
    return false;
  }

  /// Returns the distance along the ray to the first hit, or nothing beyond far_m.
  std::optional<double> meet(const glm::dvec3& from, const glm::dvec3& along, double far_m) const {
    double nearest = far_m;
    for (const Trunk& trunk : trunks_) nearest = std::min(nearest, meet(trunk, from, along));
    double before = 0, t = 0;
    while (t < nearest) {
      const glm::dvec3 p = from + t * along;
      const double above = p.z - height_m(glm::dvec2(p));
      if (above <= 0) return bisect(from, along, before, t);
      before = t;
      t += std::max(0.002, 0.4 * above);  // slopes stay below 2
    }
    if (nearest < far_m) return nearest;
    return std::nullopt;
  }

  glm::dvec2 uniform(int what, int i) const {
    return random_uniform({.seed = seed_,
                           .frame = static_cast<std::uint32_t>(what),
                           .pulse = static_cast<std::uint32_t>(i)});
  }

 private:
  struct Wave {
    double height_m;
    glm::dvec2 per_m;
    double phase;
  };
  struct Boulder {
    glm::dvec2 place_m;
    double radius_m, height_m;
  };
  struct Trunk {
    glm::dvec2 place_m;
    double radius_m;
  };
  static constexpr std::array<Wave, 6> waves{{{0.8, {0.15, 0.07}, 0.3},
                                              {0.5, {-0.1, 0.22}, 1.1},
                                              {0.15, {0.6, 0.35}, 2.0},
                                              {0.1, {-0.5, 0.8}, 0.5},
                                              {0.03, {2.1, -1.6}, 4.0},
                                              {0.012, {3.5, 5.1}, 5.1}}};

  static double meet(const Trunk& trunk, const glm::dvec3& from, const glm::dvec3& along) {
    const glm::dvec2 off = glm::dvec2(from) - trunk.place_m, d(along);
    const double a = glm::dot(d, d), b = glm::dot(off, d);
    const double c = glm::dot(off, off) - trunk.radius_m * trunk.radius_m;
    const double root = b * b - a * c;
    const double t = root < 0 ? -1 : (-b - std::sqrt(root)) / a;
    return t > 0 ? t : std::numeric_limits<double>::infinity();
  }
  double bisect(const glm::dvec3& from, const glm::dvec3& along, double low, double high) const {
    for (int i = 0; i < 40; ++i) {
      const double t = 0.5 * (low + high);
      const glm::dvec3 p = from + t * along;
      (p.z > height_m(glm::dvec2(p)) ? low : high) = t;
    }
    return high;
  }

  Seed seed_;
  std::vector<Boulder> boulders_;
  std::vector<Trunk> trunks_;
};

/// Returns the index of a sample in the columns of a DEM.
inline std::size_t number_of(const GridFrame& frame, glm::ivec2 sample) {
  return static_cast<std::size_t>(sample.y) * static_cast<std::size_t>(frame.samples.x) +
         static_cast<std::size_t>(sample.x);
}

/// Appends a point to all columns.
inline void add_point(MeasuredPoints& points, const glm::dvec3& p_m, double sd_m, double bias_sd_m,
                      double across_sd_m, std::uint32_t group, PointOrigin origin,
                      glm::vec2 lean = glm::vec2(0)) {
  points.p_m.push_back(p_m);
  points.sd_m.push_back(static_cast<float>(sd_m));
  points.bias_sd_m.push_back(static_cast<float>(bias_sd_m));
  points.lean.push_back(lean);
  points.across_sd_m.push_back(static_cast<float>(across_sd_m));
  points.groups.push_back(group);
  points.origins.push_back(origin);
}

/// Simulates a lidar of 32 rings from 25 to 5 degrees below the horizon: noise of range and of
/// direction, a range bias for each scan, 1 % outliers.
inline MeasuredPoints scan_by_lidar(const RollingGround& ground, const glm::dvec3& from,
                                    int azimuths, std::uint32_t group, Seed seed) {
  constexpr double range_sd_m = 0.02, bias_sd_m = 0.004, angle_sd = 0.0009, far_m = 60;
  MeasuredPoints points;
  const RandomKey key{.seed = seed, .sensor = group};
  RandomKey bias_key = key;
  bias_key.frame = 99;
  const double bias_m = bias_sd_m * random_normal(bias_key).x;
  for (int ring = 0; ring < 32; ++ring) {
    for (int azimuth = 0; azimuth < azimuths; ++azimuth) {
      RandomKey one = key;
      one.pulse = static_cast<std::uint32_t>(ring * azimuths + azimuth);
      one.frame = 1;
      const glm::dvec2 turn = random_normal(one);
      one.frame = 2;
      const glm::dvec2 noise = random_normal(one);
      one.frame = 3;
      const glm::dvec2 dice = random_uniform(one);
      const double down = glm::radians(5.0 + 20.0 * ring / 31);
      const double heading = (2 * glm::pi<double>()) * (azimuth + 0.3 * (ring % 3)) / azimuths;
      const auto towards = [](double dip, double yaw) {
        return glm::dvec3(std::cos(dip) * std::cos(yaw), std::cos(dip) * std::sin(yaw),
                          -std::sin(dip));
      };
      const glm::dvec3 nominal = towards(down, heading);
      const glm::dvec3 actual =
          towards(down + angle_sd * turn.x, heading + angle_sd * turn.y / std::cos(down));
      const auto met_m = ground.meet(from, actual, far_m);
      if (!met_m) continue;
      const bool is_outlier = dice.x < 0.01;
      const double range_m =
          is_outlier ? 0.5 + 30 * dice.y : *met_m + bias_m + range_sd_m * noise.x;
      const double side_m = range_m * angle_sd;
      const PointErrors errors =
          point_errors(glm::dmat3(side_m * side_m) + (range_sd_m * range_sd_m - side_m * side_m) *
                                                         glm::outerProduct(nominal, nominal));
      add_point(points, from + range_m * nominal, double{errors.sd_m},
                bias_sd_m * std::abs(nominal.z), double{errors.across_sd_m}, group,
                PointOrigin::Lidar, errors.lean);
    }
  }
  return points;
}

/// Simulates the points of a stereo pair: disparities with noise of 0.3 px, a bias of 0.1 px for
/// each pair, and 2 % mismatches.
inline MeasuredPoints match_by_stereo(const RollingGround& ground, const glm::dvec3& from,
                                      double yaw_rad, int columns, std::uint32_t group, Seed seed) {
  constexpr double focal_px = 800, baseline_m = 0.5, noise_px = 0.3, bias_px = 0.1, far_m = 25;
  constexpr double pitch_rad = 0.4;
  const glm::dvec3 ahead(std::cos(pitch_rad) * std::cos(yaw_rad),
                         std::cos(pitch_rad) * std::sin(yaw_rad), -std::sin(pitch_rad));
  const glm::dvec3 right(std::sin(yaw_rad), -std::cos(yaw_rad), 0);
  const glm::dvec3 down = glm::cross(ahead, right);
  MeasuredPoints points;
  const RandomKey key{.seed = seed, .sensor = group};
  RandomKey bias_key = key;
  bias_key.frame = 99;
  const double shift_px = bias_px * random_normal(bias_key).x;
  const int rows = columns * 3 / 4;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      RandomKey one = key;
      one.pulse = static_cast<std::uint32_t>(row * columns + column);
      one.frame = 2;
      const glm::dvec2 noise = random_normal(one);
      one.frame = 3;
      const glm::dvec2 dice = random_uniform(one),
                       spread = random_normal({one.seed, one.sensor, 4, one.pulse});
      // 53 by 41 degrees, whatever the number of columns.
      const glm::dvec2 px((column + 0.5) / columns - 0.5, 0.75 * ((row + 0.5) / rows - 0.5));
      const glm::dvec3 ray = ahead + px.x * right + px.y * down;  // 1 m deep
      const auto met = ground.meet(from, ray / glm::length(ray), far_m);
      if (!met) continue;
      const double depth_m = *met / glm::length(ray);
      const double disparity = focal_px * baseline_m / depth_m + noise_px * noise.x + shift_px;
      const double seen_m = dice.x < 0.02 ? 2 + 25 * dice.y : focal_px * baseline_m / disparity;
      const double per_px = seen_m / (focal_px * baseline_m);  // as a fraction of the depth
      const double side_m = seen_m / focal_px * noise_px;
      const glm::dvec3 seen =
          seen_m * (ray + noise_px / focal_px * (spread.x * right + spread.y * down));
      const glm::dvec3 deep_m = per_px * noise_px * seen;
      const PointErrors errors = point_errors(
          glm::outerProduct(deep_m, deep_m) +
          side_m * side_m * (glm::outerProduct(right, right) + glm::outerProduct(down, down)));
      add_point(points, from + seen, double{errors.sd_m}, std::abs(per_px * bias_px * seen.z),
                double{errors.across_sd_m}, group, PointOrigin::Stereo, errors.lean);
    }
  }
  return points;
}

}  // namespace groundray::testing
