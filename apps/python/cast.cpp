#include "apps/python/cast.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "apps/python/ray_order.h"
#include "core/elementary.h"
#include "core/error.h"
#include "core/geometry/cell.h"
#include "core/pack.h"

namespace groundray::python {
namespace {

constexpr std::size_t block = 16'384;  // rays of one task, which are sorted together
constexpr std::size_t few = 512;       // rays whose intermediate results stay in the nearest cache
constexpr double none = std::numeric_limits<double>::quiet_NaN();

// Returns the largest magnitude of the components.
double extent(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// Normalises a vector; NaN if it is zero or not finite. If squares might overflow or underflow, it
// is first scaled by a power of two, which is exact: the result is the same.
glm::dvec3 unit(const glm::dvec3& v) {
  const double square = glm::dot(v, v);
  if (1e-200 < square && square < 1e200) return glm::normalize(v);
  const double size = extent(v);
  if (!(0 < size && size < std::numeric_limits<double>::infinity())) return glm::dvec3(none);
  const int exponent = std::ilogb(size);
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

  // Writes the rows from `first` on, `few` at most.
  void write(std::size_t first, const Scene& scene, std::span<const Ray> rays,
             std::span<const Hit> hits) const {
    const bool is_bare = scene.cover.empty();
    std::array<double, few> sines{}, cosines{};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Ray& ray = rays[i];
      const Hit& hit = hits[i];
      const bool is_hit = static_cast<bool>(hit);
      const std::size_t row = first + i;
      const glm::dvec3 p_DQ = is_hit ? ray.origin + hit.range_m * ray.direction : glm::dvec3(none);
      const glm::dvec3 normal = is_hit ? glm::dvec3(hit.normal) : glm::dvec3(none);
      const SurfaceTruth truth = !is_hit                  ? SurfaceTruth{}
                                 : is_bare && !hit.object ? scene.terrain
                                                          : scene.truth_of(ray, hit);
      range_m[row] = hit.range_m;
      x_m[row] = p_DQ.x;
      y_m[row] = p_DQ.y;
      z_m[row] = p_DQ.z;
      nx[row] = static_cast<float>(normal.x);
      ny[row] = static_cast<float>(normal.y);
      nz[row] = static_cast<float>(normal.z);
      sines[i] = glm::length(glm::cross(ray.direction, normal));
      cosines[i] = std::abs(glm::dot(ray.direction, normal));
      label[row] = truth.label;
      instance[row] = truth.instance;
      estimate_m[row] =
          is_hit ? error_estimate_m(hit.deviation_m, hit.normal.z, static_cast<float>(cosines[i]))
                 : std::numeric_limits<float>::quiet_NaN();
    }
    for (std::size_t i = 0; i < rays.size(); i += pack_size) {
      const Pack angles_rad = angle_of(Pack(&sines[i], std::experimental::element_aligned),
                                       Pack(&cosines[i], std::experimental::element_aligned));
      for (std::size_t lane = 0; lane < std::min(pack_size, rays.size() - i); ++lane)
        incidence_rad[first + i + lane] = static_cast<float>(angles_rad[lane]);
    }
  }

  std::span<double> range_m, x_m, y_m, z_m;
  std::span<float> nx, ny, nz, incidence_rad;
  std::span<std::uint16_t> label;
  std::span<std::uint32_t> instance;
  std::span<float> estimate_m;
  std::span<double> bound_m;
};

// Returns the height in the middle between the lowest and the highest ground; 0 without ground.
double medium_height_m(const RayTracer& ground) {
  const HeightArray& heights = ground.levels().back().level().heights;
  return std::isnan(heights.min_m()) ? 0 : (heights.min_m() + heights.max_m()) / 2;
}

// Returns whether a point is on the ground or just above it, by the samples of the finest level.
bool is_on_ground(const Level& finest, const glm::dvec3& p_D) {
  constexpr double above_m = 0.1;
  const HeightArray& heights_m = finest.heights;
  const glm::dvec2 at = (finest.frame.to_grid(glm::dvec2(p_D)) - glm::dvec2(finest.first)) /
                        static_cast<double>(finest.step);
  const glm::ivec2 last = heights_m.size() - 1;
  if (!(0 <= at.x && at.x <= last.x && 0 <= at.y && at.y <= last.y)) return false;
  const glm::ivec2 first = glm::min(glm::ivec2(at), last - 1);
  const Cell cell{.column = first.x,
                  .row = first.y,
                  .nw = heights_m(first.x, first.y),
                  .ne = heights_m(first.x + 1, first.y),
                  .sw = heights_m(first.x, first.y + 1),
                  .se = heights_m(first.x + 1, first.y + 1)};
  const FacetPlane plane = cell.plane(cell.half_at(at.x, at.y));
  return p_D.z <= plane.height_m + plane.u_slope_m * at.x + plane.v_slope_m * at.y + above_m;
}

// Casts blocks of rays. Each thread has its own, to reuse the buffers.
class BlockCaster {
 public:
  BlockCaster(const Scene& scene, const GivenRays& rays, const Columns& columns)
      : scene_(scene), given_(rays), columns_(columns), order_(medium_height_m(scene.rays)) {}

  // Casts the rays of `count` rows from `first` on and writes these rows.
  void cast(std::size_t first, std::size_t count) {
    read(first, count);
    hits_.resize(count);
    const auto order = order_.sort(rays_);
    if (order.empty()) {
      trace(rays_, hits_);
    } else {
      trace_sorted(order);
    }
    const std::span<const Ray> rays(rays_);
    const std::span<const Hit> hits(hits_);
    for (std::size_t i = 0; i < count; i += few) {
      const std::size_t some = std::min(few, count - i);
      columns_.write(first + i, scene_, rays.subspan(i, some), hits.subspan(i, some));
    }
    if (!columns_.bound_m.empty())
      scene_.rays.bound_errors(rays, hits, columns_.bound_m.subspan(first, count));
  }

 private:
  void read(std::size_t first, std::size_t count) {
    rays_.resize(count);
    double faults = 0;  // NaN if there may be any
    for (std::size_t i = 0; i < count; ++i) {
      const Ray ray = given_[first + i];
      const glm::dvec3 sum = ray.origin + ray.direction;
      faults += 0 * (sum.x + sum.y + sum.z);
      rays_[i] = ray;
    }
    if (faults != 0) given_.check();
  }

  // Traces each run of packets of the same kind.
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const {
    const auto kind_at = [&](std::size_t i) {
      const auto packet = rays.subspan(i, std::min(packet_rays, rays.size() - i));
      if (!are_alike(packet)) return Batch::Scattered;
      return is_on_ground(scene_.rays.levels().front().level(), packet.front().origin)
                 ? Batch::ShadowRays
                 : Batch::Alike;
    };
    Batch kind = kind_at(0);
    for (std::size_t begin = 0, end = 0; begin < rays.size(); begin = end) {
      const Batch of_run = kind;
      do {
        end = std::min(end + packet_rays, rays.size());
        if (end < rays.size()) kind = kind_at(end);
      } while (end < rays.size() && kind == of_run);
      scene_.trace(rays.subspan(begin, end - begin), hits.subspan(begin, end - begin), of_run);
    }
  }

  void trace_sorted(std::span<const std::uint32_t> order) {
    std::array<Ray, few> rays;
    std::array<Hit, few> hits;
    for (std::size_t begin = 0; begin < order.size(); begin += few) {
      const auto some = order.subspan(begin, std::min(few, order.size() - begin));
      for (std::size_t i = 0; i < some.size(); ++i) rays[i] = rays_[some[i]];
      trace(std::span(rays).first(some.size()), std::span(hits).first(some.size()));
      for (std::size_t i = 0; i < some.size(); ++i) hits_[some[i]] = hits[i];
    }
  }

  const Scene& scene_;
  const GivenRays& given_;
  const Columns& columns_;
  RayOrder order_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
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
  return {.origin = origin_m(row), .direction = unit(direction(row)), .time = time_};
}

SensorBox GivenRays::box() const {
  if (size() == 0) return {glm::dvec3(0), glm::dvec3(0)};
  SensorBox box{origin_m(0), origin_m(0)};
  for (std::size_t i = 1; i < size(); ++i)
    box = {glm::min(box.low_m, origin_m(i)), glm::max(box.high_m, origin_m(i))};
  return box;
}

void GivenRays::check() const {
  for (std::size_t i = 0; i < size(); ++i) {
    const glm::dvec3 origin = origin_m(i), along = direction(i);
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
  oneapi::tbb::enumerable_thread_specific<BlockCaster> casters(
      [&] { return BlockCaster(scene, rays, columns); });
  oneapi::tbb::parallel_for(std::size_t{0}, (rays.size() + block - 1) / block, [&](std::size_t i) {
    check();
    casters.local().cast(i * block, std::min(block, rays.size() - i * block));
  });
  return cloud;
}

}  // namespace groundray::python
