#include "sensors/lidar/beam/plane_footprint.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace groundray {
namespace {

constexpr int least_intervals = 32, most_intervals = 32'768;
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

// Returns the index of the hit nearest to a point.
std::uint32_t nearest_to(const glm::dvec3& p_DQ, std::span<const glm::dvec3> points) {
  const auto distance = [&](const glm::dvec3& p) { return glm::dot(p - p_DQ, p - p_DQ); };
  return static_cast<std::uint32_t>(std::ranges::min_element(points, {}, distance) -
                                    points.begin());
}

}  // namespace

PlaneQuadrature::PlaneQuadrature(BeamSpec::Profile profile, double spacing_m, double resolution_m)
    : spacing_m_(spacing_m), resolution_m_(resolution_m) {
  const bool gaussian = profile == BeamSpec::Profile::Gaussian;
  reach_ = gaussian ? gaussian_reach : 1;
  for (int intervals = least_intervals; intervals <= most_intervals; intervals *= 2) {
    std::vector<Node>& table = tables_.emplace_back();
    double sum = 0;
    for (int k = 1; k < intervals; ++k) {
      const double angle_rad = std::numbers::pi * k / intervals;
      const double sine = std::sin(angle_rad), along = reach_ * std::cos(angle_rad);
      const double share = sine * (gaussian ? std::exp(-2 * along * along) : sine);
      table.push_back({along, gaussian ? 0.5 : sine / std::numbers::sqrt3, share});
      sum += 2 * share;
    }
    for (Node& node : table) node.share /= sum;
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
  if (std::ranges::any_of(hits, [&](const Hit& hit) { return hit.object != hits[0].object; }))
    return {};
  FootprintPlane plane;
  for (const Hit& hit : hits) plane.normal += glm::dvec3(hit.normal);
  plane.normal = glm::normalize(plane.normal);
  for (std::size_t i = 0; i < hits.size(); ++i)
    plane.offset_m += glm::dot(plane.normal, rays[i].origin + rays[i].direction * hits[i].range_m);
  plane.offset_m /= static_cast<double>(hits.size());
  const double tolerance_m = planar * resolution_m_ + normal_rounding * span_m;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double slope = glm::dot(plane.normal, rays[i].direction);
    const double height_m = glm::dot(plane.normal, rays[i].origin) - plane.offset_m;
    if (!(slope < 0) || !(std::abs(height_m + slope * hits[i].range_m) <= -slope * tolerance_m))
      return {};
  }
  const double slope = glm::dot(plane.normal, axis.ray.direction);
  plane.axis_m = (plane.offset_m - glm::dot(plane.normal, axis.ray.origin)) / slope;
  if (!(slope < 0 && plane.axis_m > 0)) return {};
  const glm::dvec3 vertical = glm::cross(axis.ray.direction, axis.horizontal);
  plane.gradient_m =
      beam.radius_m(plane.axis_m) / slope *
      glm::dvec2(glm::dot(plane.normal, axis.horizontal), glm::dot(plane.normal, vertical));
  const double reach_m = reach_ * glm::length(plane.gradient_m);
  const double to_horizon = reach_m / plane.axis_m;
  if (!(to_horizon > 0 && to_horizon <= nearest_horizon)) return {};
  const double intervals = std::numbers::pi * reach_m * stretch_of(to_horizon) / spacing_m_;
  if (intervals > most_intervals) return {};
  for (double has = least_intervals; has < intervals; has *= 2) ++plane.table;
  return plane;
}

void PlaneQuadrature::sample(const LaserBeam& beam, const PulseAxis& axis,
                             const FootprintPlane& plane, std::span<const Ray> rays,
                             std::span<const Hit> traced, FootprintSamples& samples) const {
  const std::vector<Node>& table = tables_[plane.table];
  const glm::dvec3 vertical = glm::cross(axis.ray.direction, axis.horizontal);
  const glm::dvec2 along = glm::normalize(plane.gradient_m), across{-along.y, along.x};
  const glm::dvec3 p_DA = axis.ray.origin + axis.ray.direction * plane.axis_m;
  std::vector<glm::dvec3>& points = samples.points;
  points.clear();
  for (std::size_t i = 0; i < traced.size(); ++i)
    points.push_back(rays[i].origin + rays[i].direction * traced[i].range_m);
  const bool varies = std::ranges::any_of(
      traced, [&](const Hit& hit) { return hit.part != traced[0].part; });
  const std::uint32_t middle = nearest_to(p_DA, points);
  Hit hit;
  hit.normal = glm::vec3(plane.normal);
  hit.object = traced[0].object;
  for (const Hit& other : traced) hit.deviation_m = std::max(hit.deviation_m, other.deviation_m);
  samples.rays.clear();
  samples.hits.clear();
  samples.shares.clear();
  samples.traced.clear();
  double parity = 1;
  for (const Node& node : table) {
    for (const double side : {1., -1.}) {
      // Alternating deviations of the directions give them their variance at each point.
      const LaserBeam::SubRay to =
          beam.through(node.along * along + side * node.across * across, plane.axis_m,
                       {parity, side * parity});
      const Ray ray{axis.ray.origin + to.offset_m.x * axis.horizontal + to.offset_m.y * vertical,
                    (axis.ray.direction + to.slope.x * axis.horizontal + to.slope.y * vertical) *
                        to.per_length,
                    axis.ray.far_m, axis.ray.time};
      samples.rays.push_back(ray);
      hit.range_m = (plane.offset_m - glm::dot(plane.normal, ray.origin)) /
                    glm::dot(plane.normal, ray.direction);
      const std::uint32_t like =
          varies ? nearest_to(ray.origin + ray.direction * hit.range_m, points) : middle;
      hit.part = traced[like].part;
      samples.hits.push_back(hit);
      samples.shares.push_back(node.share);
      samples.traced.push_back(like);
    }
    parity = -parity;
  }
}

}  // namespace groundray
