// Rays are sorted by counting small keys: the place of the ray in a plane, along Morton's curve,
// which keeps neighbours near each other. If all rays start at one place, as those of a lidar that
// fires its rings in turn, the plane is that of their directions; else it is at medium height of
// the ground, and rays towards different octants are apart.
#include "apps/python/ray_order.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

namespace groundray::python {
namespace {

constexpr std::uint32_t place_bits = 6;  // for each of two coordinates
constexpr double near_m = 1;             // between starts, so that only directions matter

bool are_within(std::span<const Ray> rays, double cosine) noexcept {
  const Ray& first = rays.front();
  double farthest = 0, least = 1;
  for (const Ray& ray : rays) {
    const glm::dvec3 away_m = ray.origin - first.origin;
    farthest = std::max(farthest, glm::dot(away_m, away_m));
    least = std::min(least, glm::dot(ray.direction, first.direction));
  }
  return farthest <= near_m * near_m && least >= cosine;
}

// Returns whether most packets are so narrow that sorting would not pay, judged by a sample.
bool are_narrow(std::span<const Ray> rays) noexcept {
  constexpr double cosine = 0.999;   // of 0.045 rad
  constexpr std::size_t one_in = 8;  // packets
  std::size_t narrow = 0, seen = 0;
  for (std::size_t i = 0; i + packet_rays <= rays.size(); i += one_in * packet_rays, ++seen)
    narrow += are_within(rays.subspan(i, packet_rays), cosine) ? 1 : 0;
  return 2 * narrow >= seen;
}

// Maps directions to a square: an octahedron, unfolded.
glm::dvec2 unfolded(const glm::dvec3& v) noexcept {
  const glm::dvec2 p = glm::dvec2(v) / (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  if (v.z >= 0) return p;
  return {std::copysign(1 - std::abs(p.y), p.x), std::copysign(1 - std::abs(p.x), p.y)};
}

std::uint32_t octant(const glm::dvec3& v) noexcept {
  return (v.x < 0 ? 1U : 0U) | (v.y < 0 ? 2U : 0U) | (v.z < 0 ? 4U : 0U);
}

// Inserts a zero before each of eight bits.
std::uint32_t spread(std::uint32_t bits) noexcept {
  bits = (bits | bits << 4U) & 0x0F0FU;
  bits = (bits | bits << 2U) & 0x3333U;
  return (bits | bits << 1U) & 0x5555U;
}

}  // namespace

bool are_alike(std::span<const Ray> packet) noexcept { return are_within(packet, 0.98); }

std::span<const std::uint32_t> RayOrder::sort(std::span<const Ray> rays) {
  if (are_narrow(rays)) return {};
  constexpr double far = std::numeric_limits<double>::max();
  glm::dvec3 low_m(far), high_m(-far);
  for (const Ray& ray : rays) {
    low_m = glm::min(low_m, ray.origin);
    high_m = glm::max(high_m, ray.origin);
  }
  const glm::dvec3 size_m = high_m - low_m;
  const double widest_m = std::max(size_m.x, size_m.y);
  const bool is_one_start = std::max(widest_m, size_m.z) < near_m;
  const auto place_of = [&](const Ray& ray) {
    if (is_one_start) return unfolded(ray.direction);
    const double t_m = (height_m_ - ray.origin.z) / ray.direction.z;
    const bool is_near = 0 < t_m && t_m < widest_m;
    return glm::dvec2(ray.origin + (is_near ? t_m : 0) * ray.direction);
  };
  places_.resize(rays.size());
  glm::dvec2 low(far), high(-far);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    places_[i] = place_of(rays[i]);
    low = glm::min(low, places_[i]);
    high = glm::max(high, places_[i]);
  }
  constexpr std::uint32_t cells = 1U << place_bits;
  const double widest = std::max(high.x - low.x, high.y - low.y);
  const double per_cell = widest > 0 ? (cells - 0.5) / widest : 0;
  keys_.resize(rays.size());
  ends_.assign(8 * cells * cells + 1, 0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const glm::uvec2 cell((places_[i] - low) * per_cell);
    keys_[i] = (is_one_start ? 0 : octant(rays[i].direction)) << 2 * place_bits | spread(cell.x) |
               spread(cell.y) << 1U;
    ++ends_[keys_[i] + 1];
  }
  std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());  // where each key begins
  order_.resize(rays.size());
  for (std::uint32_t i = 0; i < rays.size(); ++i) order_[ends_[keys_[i]]++] = i;
  return order_;
}

}  // namespace groundray::python
