#include "sensors/lidar/beam/plane_footprint.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/math.h"

namespace groundray {
namespace {

constexpr int least_intervals = 24, most_intervals = 32'768;
// Gaussian beams end where the irradiance is 1e-8 of that on the axis.
const double gaussian_reach = std::sqrt(4 * std::numbers::ln10);
constexpr double planar = 1.0 / 256;      // of the resolution
constexpr double normal_rounding = 2e-6;  // of the span: floats, seen at 87 degrees
// Beyond this fraction of the distance to the plane's horizon, ranges grow too fast for the nodes.
constexpr double nearest_horizon = 0.75;

// Returns the largest factor by which equal steps of the Chebyshev angle are stretched, relative to
// those on the axis without perspective: max over the angle of sin a / (1 + k cos a)^2.
double stretch_of(double k) {
  const double cosine = -4 * k / (1 + std::sqrt(1 + 8 * k * k));
  const double nearness = 1 + k * cosine;
  return std::sqrt(1 - cosine * cosine) / (nearness * nearness);
}

// Returns the step from a number of intervals to the next: 24, 32, 48, 64, ...
int step_of(int intervals) {
  const int power = static_cast<int>(std::bit_floor(static_cast<unsigned>(intervals)));
  return power / 2;
}

std::uint32_t nearest_in_range(double range_m, std::span<const Hit> hits) {
  const auto apart_m = [&](const Hit& hit) { return std::abs(hit.range_m - range_m); };
  return static_cast<std::uint32_t>(std::ranges::min_element(hits, {}, apart_m) - hits.begin());
}

// Gives each sample the part of the object that the nearest traced sub-ray hits.
void take_parts(std::span<const Ray> rays, std::span<const Hit> traced, FootprintSamples& samples) {
  std::vector<glm::dvec3>& points = samples.points;
  points.clear();
  for (std::size_t i = 0; i < traced.size(); ++i)
    points.push_back(rays[i].origin + rays[i].direction * traced[i].range_m);
  for (std::size_t k = 0; k < samples.hits.size(); ++k) {
    const Ray& ray = samples.rays[k];
    const glm::dvec3 p_DQ = ray.origin + ray.direction * samples.hits[k].range_m;
    const auto apart_m2 = [&](const glm::dvec3& p) { return glm::dot(p - p_DQ, p - p_DQ); };
    const auto nearest = std::ranges::min_element(points, {}, apart_m2) - points.begin();
    samples.traced[k] = static_cast<std::uint32_t>(nearest);
    samples.hits[k].part = traced[samples.traced[k]].part;
  }
}

}  // namespace

PlaneQuadrature::PlaneQuadrature(BeamSpec::Profile profile, double spacing_m, double resolution_m)
    : spacing_m_(spacing_m), resolution_m_(resolution_m) {
  const bool gaussian = profile == BeamSpec::Profile::Gaussian;
  reach_ = gaussian ? gaussian_reach : 1;
  for (int intervals = least_intervals; intervals <= most_intervals;
       intervals += step_of(intervals)) {
    std::vector<Node>& table = tables_.emplace_back();
    double sum = 0, moment = 0;
    for (int k = 1; k < intervals; ++k) {
      const double angle_rad = std::numbers::pi * k / intervals;
      const double sine = math::sin(angle_rad), along = reach_ * math::cos(angle_rad);
      const double across = gaussian ? 0.5 : sine / std::numbers::sqrt3;
      const double share = sine * (gaussian ? math::exp(-2 * along * along) : sine);
      table.push_back({along, k % 2 == 0 ? across : -across, share});
      sum += share;
      moment += share * table.back().across;
    }
    for (Node& node : table) {
      node.share /= sum;
      node.across -= moment / sum;
    }
  }
}

std::optional<FootprintPlane> PlaneQuadrature::plane_of(const LaserBeam& beam,
                                                        const PulseAxis& axis,
                                                        std::span<const Ray> rays,
                                                        std::span<const Hit> hits) const noexcept {
  double near_m = hits[0].range_m, far_m = near_m;
  for (const Hit& hit : hits) {
    near_m = std::min(near_m, hit.range_m);
    far_m = std::max(far_m, hit.range_m);
  }
  const double span_m = far_m - near_m;
  if (!(span_m > resolution_m_) || !std::isfinite(far_m)) return {};
  FootprintPlane plane;
  for (const Hit& hit : hits) plane.normal += glm::dvec3(hit.normal);
  plane.normal = glm::normalize(plane.normal);
  const double tolerance_m = planar * resolution_m_ + normal_rounding * span_m;
  const auto offset_m = [&](const Ray& ray, double slope, double range_m) {
    return glm::dot(plane.normal, ray.origin) + slope * range_m;
  };
  const double first_m =
      offset_m(rays[0], glm::dot(plane.normal, rays[0].direction), hits[0].range_m);
  double beyond_m = 0;  // sum of the heights above the plane through the first
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double slope = glm::dot(plane.normal, rays[i].direction);
    const double height_m = offset_m(rays[i], slope, hits[i].range_m) - first_m;
    if (!(std::abs(height_m) <= -slope * tolerance_m) || hits[i].object != hits[0].object)
      return {};
    beyond_m += height_m;
  }
  plane.offset_m = first_m + beyond_m / static_cast<double>(hits.size());
  const double slope = glm::dot(plane.normal, axis.ray.direction);
  plane.axis_m = (plane.offset_m - glm::dot(plane.normal, axis.ray.origin)) / slope;
  if (!(slope < 0 && plane.axis_m > 0)) return {};
  plane.section = beam.section(plane.axis_m);
  plane.vertical = glm::cross(axis.ray.direction, axis.horizontal);
  const glm::dvec2 gradient_m =
      plane.section.radius_m / slope *
      glm::dvec2(glm::dot(plane.normal, axis.horizontal), glm::dot(plane.normal, plane.vertical));
  const double length_m = glm::length(gradient_m);
  const double reach_m = reach_ * length_m, to_horizon = reach_m / plane.axis_m;
  if (!(to_horizon > 0 && to_horizon <= nearest_horizon)) return {};
  plane.along = gradient_m / length_m;
  const double intervals = std::numbers::pi * reach_m * stretch_of(to_horizon) / spacing_m_;
  if (intervals > most_intervals) return {};
  for (int has = least_intervals; has < intervals; has += step_of(has)) ++plane.table;
  return plane;
}

void PlaneQuadrature::sample(const PulseAxis& axis, const FootprintPlane& plane,
                             std::span<const Ray> rays, std::span<const Hit> traced,
                             FootprintSamples& samples) const {
  const std::vector<Node>& table = tables_[plane.table];
  const glm::dvec2 across{-plane.along.y, plane.along.x};
  samples.rays.resize(table.size());
  samples.hits.resize(table.size());
  samples.shares.resize(table.size());
  samples.traced.assign(table.size(), nearest_in_range(plane.axis_m, traced));
  Hit hit = traced[samples.traced[0]];
  hit.normal = glm::vec3(plane.normal);
  for (const Hit& other : traced) hit.deviation_m = std::max(hit.deviation_m, other.deviation_m);
  for (std::size_t k = 0; k < table.size(); ++k) {
    const Node& node = table[k];
    const LaserBeam::SubRay to =
        plane.section.through(node.along * plane.along + node.across * across);
    const glm::dvec3 origin =
        axis.ray.origin + to.offset_m.x * axis.horizontal + to.offset_m.y * plane.vertical;
    const glm::dvec3 direction =
        axis.ray.direction + to.slope.x * axis.horizontal + to.slope.y * plane.vertical;
    samples.rays[k] = {origin, direction * to.per_length, axis.ray.far_m, axis.ray.time};
    hit.range_m = (plane.offset_m - glm::dot(plane.normal, origin)) /
                  glm::dot(plane.normal, samples.rays[k].direction);
    samples.hits[k] = hit;
    samples.shares[k] = node.share;
  }
  const auto differs = [&](const Hit& other) { return other.part != hit.part; };
  if (std::ranges::any_of(traced, differs)) take_parts(rays, traced, samples);
}

}  // namespace groundray
