#include "sensors/camera/lidar_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <optional>

#include "core/io/npy_io.h"
#include "sensors/camera/observation.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t echoes_at_once = 2048;

// Columns of a scan that are used.
struct Columns {
  explicit Columns(const PointCloud& cloud)
      : x(cloud.column<double>("world_x")),
        y(cloud.column<double>("world_y")),
        z(cloud.column<double>("world_z")),
        range_m(cloud.column<double>("range_true")),
        nx(cloud.column<float>("nx")),
        ny(cloud.column<float>("ny")),
        nz(cloud.column<float>("nz")),
        time_s(cloud.column<float>("time")),
        instance(cloud.column<std::uint32_t>("instance")) {}

  std::span<const double> x, y, z, range_m;
  std::span<const float> nx, ny, nz, time_s;
  std::span<const std::uint32_t> instance;
};

// Returns a ray that hits whatever hides a point from the camera, but not the point's own surface.
// Its end is above the surface by more than the errors of the lidar's range and of the ray's hits,
// however small the angle between ray and surface. Objects move by less than 0.5 um within the
// error of `time`.
Ray towards(const Observation& seen, const glm::dvec3& normal, double lidar_range_m) {
  const double lift_m = 1e-6 + 1e-9 * (2 + lidar_range_m + glm::length(seen.towards));
  const glm::dvec3 above =
      seen.towards + normal * std::copysign(lift_m, -glm::dot(normal, seen.towards));
  const double range_m = glm::length(above);
  return {seen.X_DC.translation_m, above / range_m, range_m, seen.time};
}

// Projects blocks of a scan's echoes.
class Imaging {
 public:
  Imaging(const Camera& camera, const Scene& scene, const Trajectory& X_DC, nanoseconds begin,
          const PointCloud& cloud, nanoseconds stamp)
      : camera_(camera), scene_(scene), X_DC_(X_DC), begin_(begin), echoes_(cloud), stamp_(stamp) {}

  std::vector<ImagedEcho> fill(std::size_t begin, std::size_t end) const {
    std::vector<ImagedEcho> imaged;
    std::vector<Ray> rays;
    std::vector<std::size_t> inside;  // indices in `imaged` that have a ray
    double row = 0;                   // first guess for the next echo
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 p_DQ(echoes_.x[i], echoes_.y[i], echoes_.z[i]);
      const nanoseconds time = stamp_ + nanoseconds(std::llround(1e9 * double{echoes_.time_s[i]}));
      const glm::dvec3 normal(echoes_.nx[i], echoes_.ny[i], echoes_.nz[i]);
      const std::uint32_t instance = echoes_.instance[i];
      const std::uint32_t object =
          instance == 0 ? 0 : scene_.objects.part_at(instance, p_DQ, normal, time);
      const Mover point(scene_.objects, object, p_DQ, time);
      const auto seen = observe(camera_, X_DC_, begin_, point, row);
      if (!seen) continue;
      row = seen->pixel.y;
      imaged.push_back({.echo = static_cast<std::uint32_t>(i),
                        .u_px = seen->pixel.x,
                        .v_px = seen->pixel.y,
                        .depth_m = (glm::conjugate(seen->X_DC.rotation) * seen->towards).z,
                        .is_inside = is_inside(camera_.spec().size_px, seen->pixel)});
      if (!imaged.back().is_inside) continue;
      const Mover tip(scene_.objects, object, p_DQ + normal, time);
      const glm::dvec3 turned = tip.seen_from(seen->X_DC.translation_m, seen->time) - seen->towards;
      inside.push_back(imaged.size() - 1);
      rays.push_back(towards(*seen, turned, echoes_.range_m[i]));
    }
    std::vector<Hit> hits(rays.size());
    scene_.trace(rays, hits);
    for (std::size_t k = 0; k < rays.size(); ++k) imaged[inside[k]].is_visible = !hits[k];
    return imaged;
  }

 private:
  const Camera& camera_;
  const Scene& scene_;
  const Trajectory& X_DC_;
  nanoseconds begin_;
  Columns echoes_;
  nanoseconds stamp_;
};

}  // namespace

std::vector<ImagedEcho> image_echoes(const Camera& camera, const Scene& scene,
                                     const Trajectory& X_DC, nanoseconds begin,
                                     const PointCloud& echoes, nanoseconds stamp) {
  camera.check_cover(X_DC, begin);
  const Imaging imaging(camera, scene, X_DC, begin, echoes, stamp);
  const std::size_t blocks = (echoes.rows() + echoes_at_once - 1) / echoes_at_once;
  std::vector<std::vector<ImagedEcho>> parts(blocks);
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
    const std::size_t first = block * echoes_at_once;
    parts[block] = imaging.fill(first, std::min(first + echoes_at_once, echoes.rows()));
  });
  std::vector<ImagedEcho> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

void write_imaged_echoes(const std::filesystem::path& path, std::span<const ImagedEcho> echoes) {
  static_assert(std::endian::native == std::endian::little);
  std::vector<std::byte> bytes;
  const auto add = [&](const auto& value) {
    const auto part = std::as_bytes(std::span(&value, 1));
    bytes.insert(bytes.end(), part.begin(), part.end());
  };
  for (const ImagedEcho& echo : echoes) {
    add(echo.echo);
    add(echo.u_px);
    add(echo.v_px);
    add(echo.depth_m);
    add(static_cast<std::uint8_t>(echo.is_inside));
    add(static_cast<std::uint8_t>(echo.is_visible));
  }
  write_npy(path,
            {{"echo", "<u4"},
             {"u_px", "<f8"},
             {"v_px", "<f8"},
             {"depth_m", "<f8"},
             {"is_inside", "|u1"},
             {"is_visible", "|u1"}},
            echoes.size(), bytes);
}

}  // namespace groundray
