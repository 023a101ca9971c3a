#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "core/io/npy_io.h"
#include "core/random.h"
#include "sensors/camera/camera.h"
#include "terrain/terrain_scene.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray {
namespace {

using namespace std::chrono_literals;

constexpr double albedo = 0.4;
const glm::dvec3 sky_radiance(30, 40, 60);
constexpr double step_m = 1;

void write(const std::filesystem::path& path, std::span<const float> values) {
  write_npy(path, {{"", "<f4"}}, values.size(), std::as_bytes(values));
}

std::string text(const glm::dvec3& v) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x, v.y, v.z);
}

// Pose at `from` that looks at `to`, with the top of the image upwards.
Pose looking(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 ahead = glm::normalize(to - from);
  const glm::dvec3 right = glm::normalize(glm::cross(ahead, glm::dvec3(0, 0, 1)));
  return {glm::quat_cast(glm::dmat3(right, glm::cross(ahead, right), ahead)), from};
}

// The scene that other renderers get too: a fractal landscape of one grey, lit by a constant sky
// and a uniform solar disc, seen by a pinhole camera.
void expose(const std::filesystem::path& folder, int width, int samples, int depth,
            int terrain_samples) {
  const HeightGrid grid =
      testing::fractal(terrain_samples, step_m, 0.2 * terrain_samples * step_m, Seed{6});
  const Scene scene{RayTracer({full_resolution_level(grid)}, {0, 0, 0}, Tracing::Fast),
                    {.label = 1},
                    {{"grey", Lambertian{{{300, albedo}, {2500, albedo}}}}}};
  const Sky sky({ConstantSky{sky_radiance},
                 SunSpec{SunAngles{.azimuth_deg = 130, .elevation_deg = 30}, SunDisc::Uniform}});
  const PathTracer light(scene, sky, depth, std::nullopt);

  const double half_m = step_m * (terrain_samples - 1) / 2;
  const glm::dvec3 from(-0.7 * half_m, -0.7 * half_m, grid.max_height_m() + 0.1 * half_m);
  const glm::dvec3 to(0.1 * half_m, 0.1 * half_m, grid.min_height_m());
  const Pose X_DC = looking(from, to);
  CameraSpec spec;
  spec.size_px = {width, width * 3 / 4};
  const glm::dvec2 centre_px = (glm::dvec2(spec.size_px) - 1.0) / 2.0;
  spec.lens = Pinhole{{{0.8 * width, 0.8 * width}, centre_px, 0}};
  spec.sampling = {.samples = samples, .most_samples = samples, .depth = depth};
  const Camera camera(spec);
  const Trajectory still({{0s, X_DC}, {1s, X_DC}});
  const std::clock_t begin = std::clock();
  const Exposure exposure = camera.expose(light, still, 0s, {Seed{1}});
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;

  write(folder / "heights.npy", grid.heights_m());
  write(folder / "radiance.npy", exposure.radiance.values());
  write(folder / "standard_error.npy", exposure.standard_error.values());
  fmt::print(
      "{{\"size_px\": [{}, {}], \"focal_px\": {}, \"from\": {}, \"to\": {}, \"albedo\": {}, "
      "\"sky\": {}, \"sun\": {}, \"sun_radius_rad\": {:.17g}, \"sun_irradiance\": {}, "
      "\"terrain_samples\": {}, \"origin_m\": [{}, {}], \"step_m\": [{}, {}], \"paths\": {}, "
      "\"cpu_s\": {}}}\n",
      spec.size_px.x, spec.size_px.y, 0.8 * width, text(from), text(to), albedo, text(sky_radiance),
      text(sky.sun()->direction()), sky.sun()->angular_radius_rad(), text(sky.sun()->irradiance()),
      terrain_samples, grid.frame().origin_m.x, grid.frame().origin_m.y, grid.frame().step_m.x,
      grid.frame().step_m.y, spec.size_px.x * spec.size_px.y * samples, cpu_s);
}

}  // namespace
}  // namespace groundray

// Renders the image that other renderers are compared with, for the checks in Python:
//   expose_scene FOLDER WIDTH SAMPLES DEPTH TERRAIN
// writes heights.npy, radiance.npy and standard_error.npy and prints the other parameters of the
// scene as JSON. The image has WIDTH x 3/4 WIDTH pixels, the terrain TERRAIN x TERRAIN samples, 2^k
// + 1.
int main(int argc, char** argv) {
  if (argc != 6) {
    fmt::print(stderr, "usage: expose_scene FOLDER WIDTH SAMPLES DEPTH TERRAIN\n");
    return 2;
  }
  try {
    groundray::expose(argv[1], std::stoi(argv[2]), std::stoi(argv[3]), std::stoi(argv[4]),
                      std::stoi(argv[5]));
  } catch (const std::exception& fault) {
    fmt::print(stderr, "{}\n", fault.what());
    return 1;
  }
  return 0;
}
