#include "apps/groundray/info.h"

#include <fmt/format.h>

#include <cmath>

#include "apps/groundray/world.h"
#include "terrain/dem_io.h"

namespace groundray {
namespace {

// Height, float vertex, Embree's grid BVH: measured by `./dev bench`, see docs/accuracy.md.
constexpr double bytes_per_sample = 37;

void print_dem(const Dem& dem) {
  const HeightGrid& grid = dem.grid;
  const glm::dvec2 step_m = glm::abs(grid.step_m());
  const auto samples = static_cast<double>(grid.heights_m().size());
  const glm::dvec2 centre_m = glm::dvec2(dem.origin_w_m) + grid.origin_m() +
                              glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m() / 2.0;
  fmt::print("size      {} x {} samples, {:.1f} x {:.1f} m\n", grid.columns(), grid.rows(),
             step_m.x * (grid.columns() - 1), step_m.y * (grid.rows() - 1));
  fmt::print("CRS       {}\n", dem.crs_name);
  fmt::print("centre    {:.3f}, {:.3f} m\n", centre_m.x, centre_m.y);
  fmt::print("cell      {:.6g} x {:.6g} m\n", step_m.x, step_m.y);
  fmt::print("heights   {:.3f} to {:.3f} m\n", grid.min_height_m(), grid.max_height_m());
  fmt::print("holes     {} samples ({:.2f} %)\n", grid.hole_count(),
             100 * static_cast<double>(grid.hole_count()) / samples);
  fmt::print("memory    about {:.0f} MiB to trace\n", samples * bytes_per_sample / (1 << 20));
}

void print_scene(const World& world) {
  fmt::print("seed      {}\n", world.spec.seed.value);
  fmt::print("duration  {} s, {} tracing\n", world.spec.duration_s,
             world.spec.tracing == Tracing::Fast ? "fast" : "exact");
  fmt::print("terrain   {}\n", world.spec.terrain.dem.string());
  print_dem(world.dem);
  for (const PlacedLidar& lidar : world.lidars) {
    const ScanPattern& pattern = lidar.lidar.pattern();
    const auto pulses = static_cast<double>(pattern.first_sequence(lidar.sweeps)) *
                        static_cast<double>(pattern.shots().size());
    fmt::print("lidar     {}: {}, {} scans of about {:.0f} pulses, at most {:.1f} MiB of PLY\n",
               lidar.spec.name, lidar.spec.lidar.model, lidar.sweeps,
               pulses / static_cast<double>(lidar.sweeps), pulses * 88 / (1 << 20));
  }
}

}  // namespace

void print_info(const std::filesystem::path& file) {
  if (file.extension() == ".yaml" || file.extension() == ".yml")
    return print_scene(load_world(file));
  const DemInfo info = inspect_dem(file);
  fmt::print("format    {}, {}\n", info.driver, info.sample_type);
  print_dem(load_dem(file));
}

}  // namespace groundray
