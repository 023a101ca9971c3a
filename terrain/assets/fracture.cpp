#include "terrain/assets/fracture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/math.h"

namespace groundray {
namespace {

// Returns a direction that deviates from `normal` by two normal random angles.
glm::dvec3 scattered(const glm::dvec3& normal, double sigma, AssetRandom& random) {
  const glm::dvec3 axis = std::abs(normal.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(normal, axis)), v = glm::cross(normal, u);
  const double along_u = sigma * random.normal();
  const double along_v = sigma * random.normal();
  return glm::normalize(normal + along_u * u + along_v * v);
}

double support(std::span<const glm::dvec3> corners, const glm::dvec3& direction) {
  double most = 0;
  for (const glm::dvec3& p : corners) most = std::max(most, glm::dot(p, direction));
  return most;
}

}  // namespace

double joint_spacing(double share) {
  const double low = math::exp(-least_spacing), high = math::exp(-most_spacing);
  return -math::log(low - share * (low - high));
}

std::vector<RockPlane> rock_block(const RockMass& mass, AssetRandom& random) {
  std::vector<RockPlane> planes;
  for (const JointSet& set : mass.sets) {
    const double half = set.spacing * joint_spacing(random.between(0, 1)) / 2;
    for (const double side : {1.0, -1.0})
      planes.push_back({side * scattered(set.normal, mass.scatter_rad, random), half});
  }
  const std::vector<glm::dvec3> corners = corners_of(planes);
  // Chips: half of them at corners, half anywhere.
  for (int i = 0; i < mass.chips; ++i) {
    const glm::dvec3 anywhere = random.direction();
    const auto number = static_cast<std::size_t>(random.between(0, double(corners.size())));
    const bool is_corner = i % 2 == 0 && number < corners.size();
    const glm::dvec3 towards =
        is_corner ? glm::normalize(glm::normalize(corners[number]) + 0.5 * anywhere) : anywhere;
    const double share = is_corner ? random.between(0.6, 0.92) : random.between(0.88, 0.99);
    planes.push_back({towards, share * support(corners, towards)});
  }
  return planes;
}

std::vector<glm::dvec3> corners_of(std::span<const RockPlane> planes) {
  std::vector<glm::dvec3> corners;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    for (std::size_t j = i + 1; j < planes.size(); ++j) {
      for (std::size_t k = j + 1; k < planes.size(); ++k) {
        const glm::dvec3 &a = planes[i].normal, &b = planes[j].normal, &c = planes[k].normal;
        const glm::dvec3 bc = glm::cross(b, c);
        const double determinant = glm::dot(a, bc);
        if (std::abs(determinant) < 1e-6) continue;
        const glm::dvec3 p = (planes[i].offset * bc + planes[j].offset * glm::cross(c, a) +
                              planes[k].offset * glm::cross(a, b)) /
                             determinant;
        const bool is_inside = std::ranges::all_of(planes, [&](const RockPlane& plane) {
          return glm::dot(plane.normal, p) <= plane.offset + 1e-9 * (1 + glm::length(p));
        });
        if (is_inside) corners.push_back(p);
      }
    }
  }
  return corners;
}

double rounded_level(std::span<const RockPlane> planes, double edge, const glm::dvec3& p) {
  // A soft maximum of width w recedes at a right-angled edge by sqrt(2) ln(2) w, a circle of radius
  // r by (sqrt(2) - 1) r.
  const double width = edge * (std::numbers::sqrt2 - 1) / (std::numbers::sqrt2 * std::numbers::ln2);
  double most = -1e300;
  for (const RockPlane& plane : planes)
    most = std::max(most, glm::dot(plane.normal, p) - plane.offset);
  double sum = 0;
  for (const RockPlane& plane : planes)
    sum += math::exp((glm::dot(plane.normal, p) - plane.offset - most) / width);
  return most + width * math::log(sum);
}

}  // namespace groundray
