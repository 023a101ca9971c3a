#include "apps/python/cast.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray::python {
namespace {

constexpr std::size_t batch = 4096;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

glm::dvec3 row_of(const GivenPoints& rows, std::size_t i) {
  return {rows(i, 0), rows(i, 1), rows(i, 2)};
}

// Returns the largest magnitude of the components.
double extent(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// Normalises after scaling by a power of two, which is exact, so that squares neither overflow nor
// underflow.
glm::dvec3 unit(const glm::dvec3& v) {
  const int exponent = std::ilogb(extent(v));
  return glm::normalize(glm::dvec3(std::scalbn(v.x, -exponent), std::scalbn(v.y, -exponent),
                                   std::scalbn(v.z, -exponent)));
}

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Columns of the result of cast_rays.
struct Columns {
  explicit Columns(PointCloud& cloud, ErrorBounds bounds)
      : range_m(cloud.add<double>("range_true")),
        x_m(cloud.add<double>("world_x")),
        y_m(cloud.add<double>("world_y")),
        z_m(cloud.add<double>("world_z")),
        nx(cloud.add<float>("nx")),
        ny(cloud.add<float>("ny")),
        nz(cloud.add<float>("nz")),
        incidence_rad(cloud.add<float>("incidence")),
        label(cloud.add<std::uint16_t>("label")),
        instance(cloud.add<std::uint32_t>("instance")),
        estimate_m(cloud.add<float>("error_estimate")) {
    if (bounds == ErrorBounds::Report) bound_m = cloud.add<double>("error_bound");
  }

  void write(std::size_t row, const Scene& scene, const Ray& ray, const Hit& hit) const {
    const bool is_hit = static_cast<bool>(hit);
    const glm::dvec3 p_DQ = is_hit ? ray.origin + hit.range_m * ray.direction : glm::dvec3(none);
    const glm::dvec3 normal = is_hit ? glm::dvec3(hit.normal) : glm::dvec3(none);
    const SurfaceTruth truth = is_hit ? scene.truth_of(ray, hit) : SurfaceTruth{};
    range_m[row] = hit.range_m;
    x_m[row] = p_DQ.x;
    y_m[row] = p_DQ.y;
    z_m[row] = p_DQ.z;
    nx[row] = static_cast<float>(normal.x);
    ny[row] = static_cast<float>(normal.y);
    nz[row] = static_cast<float>(normal.z);
    incidence_rad[row] = static_cast<float>(std::atan2(
        glm::length(glm::cross(ray.direction, normal)), std::abs(glm::dot(ray.direction, normal))));
    label[row] = truth.label;
    instance[row] = truth.instance;
    estimate_m[row] =
        is_hit ? error_estimate_m(hit.deviation_m, hit.normal.z,
                                  static_cast<float>(std::abs(glm::dot(ray.direction, normal))))
               : std::numeric_limits<float>::quiet_NaN();
  }

  std::span<double> range_m, x_m, y_m, z_m;
  std::span<float> nx, ny, nz, incidence_rad;
  std::span<std::uint16_t> label;
  std::span<std::uint32_t> instance;
  std::span<float> estimate_m;
  std::span<double> bound_m;
};

}  // namespace

GivenRays::GivenRays(GivenPoints origins_m, GivenPoints directions, std::chrono::nanoseconds time)
    : origins_m_(std::move(origins_m)), directions_(std::move(directions)), time_(time) {
  origins_m_.check("cast_rays: origins_m");
  directions_.check("cast_rays: directions");
  if (origins_m_.rows() != directions_.rows())
    throw Error("cast_rays: there are {} origins but {} directions; the numbers must be equal",
                origins_m_.rows(), directions_.rows());
}

Ray GivenRays::operator[](std::size_t row) const {
  return {.origin = row_of(origins_m_, row),
          .direction = unit(row_of(directions_, row)),
          .time = time_};
}

SensorBox GivenRays::box() const {
  if (size() == 0) return {glm::dvec3(0), glm::dvec3(0)};
  SensorBox box{row_of(origins_m_, 0), row_of(origins_m_, 0)};
  for (std::size_t i = 1; i < size(); ++i) {
    const glm::dvec3 origin_m = row_of(origins_m_, i);
    box = {glm::min(box.low_m, origin_m), glm::max(box.high_m, origin_m)};
  }
  return box;
}

void GivenRays::check() const {
  for (std::size_t i = 0; i < size(); ++i) {
    const glm::dvec3 origin = row_of(origins_m_, i), along = row_of(directions_, i);
    if (is_finite(origin) && is_finite(along) && extent(along) > 0) continue;
    throw Error(
        "ray {}: origin ({}, {}, {}) and direction ({}, {}, {}) must be finite, and the direction "
        "not zero",
        i, origin.x, origin.y, origin.z, along.x, along.y, along.z);
  }
}

PointCloud cast_rays(const Scene& scene, const GivenRays& rays, ErrorBounds bounds,
                     const std::function<void()>& check) {
  PointCloud cloud(rays.size());
  const Columns columns(cloud, bounds);
  const auto cast_batch = [&](std::size_t number) {
    check();
    const std::size_t begin = number * batch;
    std::vector<Ray> part(std::min(batch, rays.size() - begin));
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = rays[begin + i];
    std::vector<Hit> hits(part.size());
    scene.trace(part, hits, Batch::Scattered);
    for (std::size_t i = 0; i < part.size(); ++i) columns.write(begin + i, scene, part[i], hits[i]);
    if (bounds == ErrorBounds::Report)
      scene.rays.bound_errors(part, hits, columns.bound_m.subspan(begin, part.size()));
  };
  tbb::parallel_for(std::size_t{0}, (rays.size() + batch - 1) / batch, cast_batch);
  return cloud;
}

}  // namespace groundray::python
