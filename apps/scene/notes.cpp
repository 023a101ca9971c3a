#include "apps/scene/notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>
#include <limits>
#include <set>
#include <utility>
#include <variant>

#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

using Notes = std::vector<std::string>;

bool has_light(const PlacedLidar& lidar) { return lidar.spec.lidar.light.has_value(); }

bool has_weather(const AtmosphereSpec& air) {
  return std::min(air.visibility_m, air.fog_range_m) < AtmosphereSpec::none || air.rain_mm_h > 0 ||
         air.backscatter_per_m_sr > 0;
}

void note_weather(const Simulation& simulation, Notes& notes) {
  const SceneSpec& spec = simulation.spec;
  if (!has_weather(spec.air)) return;
  for (const PlacedLidar& lidar : simulation.lidars) {
    if (has_light(lidar)) continue;
    notes.push_back(fmt::format(
        "weather: has no effect on lidar '{}', which has no link budget; give it a `laser` and a "
        "`receiver` (docs/reference/sensors.md#light)",
        lidar.spec.name));
  }
  // Below this, the sky above the horizon is visibly hazy too.
  constexpr double thick_m = 2000;
  const double range_m = std::min(spec.air.visibility_m, spec.air.fog_range_m);
  if (simulation.cameras.empty() || !spec.sky || range_m > thick_m) return;
  if (std::holds_alternative<AnalyticSky>(spec.sky->dome)) {
    notes.push_back(fmt::format(
        "weather: hides surfaces beyond {:.4g} m, but the sky above them remains clear; "
        "give `sky` a `constant` radiance or an image",
        range_m));
  }
}

// Notes lidars whose ranges are too long or too short because they are calibrated for other air.
void note_air(const Simulation& simulation, Notes& notes) {
  const double air = simulation.spec.air.group_index;
  for (const PlacedLidar& lidar : simulation.lidars) {
    if (!has_light(lidar)) continue;
    const double calibrated = lidar.spec.lidar.light->receiver.calibrated_group_index;
    if (air == calibrated) continue;
    notes.push_back(fmt::format(
        "weather: with group_index = {}, lidar '{}' measures ranges {:.3g} mm per 100 m too {}, "
        "because it is calibrated for {}; set `receiver: {{calibrated_group_index: {}}}` if it is "
        "calibrated for this air",
        air, lidar.spec.name, 1e5 * std::abs(air / calibrated - 1),
        air > calibrated ? "long" : "short", calibrated, air));
  }
}

// Notes heights that mark missing samples in many DEMs, and that hardly any ground has.
void note_heights(const Simulation& simulation, Notes& notes) {
  // Only ocean trenches are deeper; the highest mountain of Mars has 22 km.
  constexpr double deepest_m = -9000, highest_m = 30'000;
  const HeightGrid* const grid = simulation.terrain.whole();
  if (grid == nullptr) return;
  for (const double height_m : std::set{grid->min_height_m(), grid->max_height_m()}) {
    if (!(height_m < deepest_m || height_m > highest_m)) continue;
    notes.push_back(
        fmt::format("terrain: it has heights of {} m: if these mark missing samples, set `nodata` "
                    "to their value in the file, {} if that is in metres",
                    height_m, height_m));
  }
}

void note_sky(const Simulation& simulation, Notes& notes) {
  if (!simulation.spec.sky || !simulation.cameras.empty()) return;
  if (std::ranges::none_of(simulation.lidars, has_light))
    notes.emplace_back("sky: has no effect, because there are no cameras or lidars with light");
}

// Data sheets state about 0.03 m for spinning lidars in 2026, and less than 0.1 m for all.
void note_noise(const Simulation& simulation, Notes& notes) {
  constexpr double most_m = 0.1, most_rad = 0.01;
  for (const PlacedLidar& lidar : simulation.lidars) {
    const LidarSpec& spec = lidar.spec.lidar;
    if (spec.range_noise_sigma_m > most_m) {
      notes.push_back(fmt::format(
          "lidar '{}': range_noise_sigma_m = {} is more than data sheets state, about 0.03 m; is "
          "it in centimetres?",
          lidar.spec.name, spec.range_noise_sigma_m));
    }
    if (spec.angular_jitter_rad > most_rad) {
      notes.push_back(fmt::format(
          "lidar '{}': angular_jitter_mrad = {:.4g} is more than half a degree; is it in "
          "microradians?",
          lidar.spec.name, 1e3 * spec.angular_jitter_rad));
    }
  }
}

// Returns the fraction of the image without a viewing direction, from a lattice of pixels.
double blind_share(const Lens& lens) {
  constexpr int steps = 32;
  int blind = 0;
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const glm::dvec2 share = glm::dvec2(i, j) / double{steps};
      if (!lens.ray(share * glm::dvec2(lens.size_px() - 1))) ++blind;
    }
  }
  return blind / double{(steps + 1) * (steps + 1)};
}

void note_cameras(const Simulation& simulation, Notes& notes) {
  for (const PlacedCamera& placed : simulation.cameras) {
    const CameraSpec& camera = placed.spec.camera;
    const double blind =
        std::holds_alternative<BrownConrady>(camera.lens) ? blind_share(placed.camera.lens()) : 0;
    if (blind > 0) {
      notes.push_back(fmt::format(
          "camera '{}': its distortion folds inside the image, so about {:.3g} % of the pixels "
          "show nothing; are the coefficients in OpenCV's order, and is the image as large as in "
          "the calibration?",
          placed.spec.name, 100 * blind));
    }
    const SamplingSpec& sampling = camera.sampling;
    if (needs_light(camera) && sampling.most_samples > sampling.samples &&
        sampling.relative_error == 0) {
      notes.push_back(fmt::format(
          "camera '{}': without a relative_error every pixel takes the {} paths of most_samples",
          placed.spec.name, sampling.most_samples));
    }
  }
}

// Returns the least height of a sensor above the ground below it, at times 10 ms apart; infinite if
// it is never above the DEM.
double least_height_m(const Trajectory& X_DS, const Simulation& simulation) {
  const Ground& ground = simulation.terrain.ground();
  double least_m = std::numeric_limits<double>::infinity();
  for (std::chrono::nanoseconds time{0}; time <= run_time(simulation.spec);
       time += std::chrono::milliseconds(10)) {
    const glm::dvec3 p_DS = X_DS.pose_at(time).translation_m;
    if (const auto ground_m = ground.height_m_at(glm::dvec2(p_DS)))
      least_m = std::min(least_m, p_DS.z - *ground_m);
  }
  return least_m;
}

// Notes sensors that may be as near to the reference surface as that is to the traced one.
void note_tolerance(const Simulation& simulation, Notes& notes) {
  const double tolerance_m = simulation.spec.terrain.detail.tolerance_m;
  if (tolerance_m == 0) return;
  const auto look = [&](const char* kind, const std::string& name, const Trajectory& X_DS) {
    const double height_m = least_height_m(X_DS, simulation);
    if (tolerance_m < height_m) return;
    notes.push_back(fmt::format(
        "tolerance_m = {} is not less than the height of {} '{}' above the ground, {:.3g} m: its "
        "error bounds can be infinite; choose a smaller one",
        tolerance_m, kind, name, height_m));
  };
  for (const PlacedLidar& lidar : simulation.lidars) look("lidar", lidar.spec.name, lidar.X_DS);
  for (const PlacedCamera& camera : simulation.cameras)
    look("camera", camera.spec.name, camera.X_DC);
}

void note_worlds(const SceneSpec& spec, Notes& notes) {
  if (spec.worlds == 0) return;
  notes.push_back(
      fmt::format("worlds: the scene is read as written; --world chooses one of its {} worlds, "
                  "whose values are "
                  "drawn",
                  spec.worlds));
}

}  // namespace

std::vector<std::string> notes_of(const Simulation& simulation) {
  Notes notes;
  note_worlds(simulation.spec, notes);
  note_weather(simulation, notes);
  note_air(simulation, notes);
  note_heights(simulation, notes);
  note_sky(simulation, notes);
  note_noise(simulation, notes);
  note_cameras(simulation, notes);
  note_tolerance(simulation, notes);
  return notes;
}

}  // namespace groundray
