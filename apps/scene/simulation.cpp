#include "apps/scene/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "apps/scene/edited_simulation.h"
#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/scene_place.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/memory.h"
#include "core/own_folder.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/lens/stereo.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

std::string title(std::string_view kind, const std::string& name) {
  return fmt::format("{} '{}'", kind, name);
}

nanoseconds time_of(double seconds) { return nanoseconds(std::llround(seconds * 1e9)); }

// Returns the start times of a camera's images, including images that end after the run.
std::vector<nanoseconds> begins_of(const MountedCamera& mounted, const SceneSpec& spec) {
  std::vector<nanoseconds> begins;
  if (const auto& trigger = mounted.trigger) {
    const MountedLidar& lidar =
        *std::ranges::find(spec.lidars, trigger->lidar, &MountedLidar::name);
    const ScanPattern pattern(lidar.lidar.pattern);
    for (std::int64_t sweep = 0; sweep < whole_sweeps(pattern, spec); ++sweep)
      begins.push_back(pattern.stamp(sweep) + time_of(trigger->delay_s));
    return begins;
  }
  const auto begin_of = [&](std::int64_t image) {
    return time_of(mounted.camera.first_s + static_cast<double>(image) / mounted.camera.rate_hz);
  };
  constexpr double most = 1e6;
  if (mounted.camera.rate_hz * spec.duration_s > most) {
    throw Error("{} Hz for {} s are {:.3g} images, but a run may have at most {:.0e}",
                mounted.camera.rate_hz, spec.duration_s, mounted.camera.rate_hz * spec.duration_s,
                most);
  }
  for (std::int64_t image = 0; begin_of(image) <= run_time(spec); ++image)
    begins.push_back(begin_of(image));
  return begins;
}

// Checks conditions that depend on both the camera's file and the scene's.
void check_work(const MountedCamera& mounted, const std::vector<nanoseconds>& begins) {
  const CameraSpec& camera = mounted.camera;
  const auto too_soon = std::ranges::adjacent_find(begins, [&](nanoseconds a, nanoseconds b) {
    return b - a < time_of(camera.shutter.exposure_s);
  });
  if (mounted.trigger && too_soon != begins.end()) {
    throw Error(
        "it exposes for {:.6g} ms, but is triggered again after {:.6g} ms; shorten exposure_ms",
        1e3 * camera.shutter.exposure_s,
        1e-6 * static_cast<double>((too_soon[1] - too_soon[0]).count()));
  }
  if (gives(camera, CameraProduct::Picture) && camera.imager->filter != ColorFilter::Mono &&
      std::min(camera.size_px.x, camera.size_px.y) < 3) {
    throw Error(
        "a picture of a mosaic needs at least 3 x 3 px, but size_px is [{}, {}]; enlarge it, or "
        "remove 'picture' from the products",
        camera.size_px.x, camera.size_px.y);
  }
}

PlacedCamera place(const MountedCamera& mounted, const SceneSpec& spec, const Trajectory& X_DB) {
  PlacedCamera placed{
      mounted, Camera(mounted.camera), X_DB.mounted(mounted.X_BC), begins_of(mounted, spec), {},
      {}};
  check_work(mounted, placed.begins);
  std::erase_if(placed.begins, [&](nanoseconds begin) {
    return begin < nanoseconds(0) || run_time(spec) < begin + placed.camera.duration();
  });
  if (placed.begins.empty()) {
    throw Error(
        "no image of {:.6g} s begins and ends within the run of {} s; lengthen duration_s, or "
        "check first_ms, trigger and shutter",
        1e-9 * static_cast<double>(placed.camera.duration().count()), spec.duration_s);
  }
  const auto& [imager, aperture] = std::tie(mounted.camera.imager, mounted.camera.aperture);
  if (imager && aperture)
    placed.pupil_sr = pupil_sr(placed.camera.lens(), *aperture, imager->pixel_pitch_m);
  return placed;
}

// Computes the rectification of a stereo pair; for rectified images, applies it to the cameras.
void pair_up(const StereoSpec& stereo, std::vector<MountedCamera>& cameras,
             std::vector<std::optional<Rectification>>& rectifications) {
  const auto find = [&](const std::string& name) {
    return std::ranges::find(cameras, name, &MountedCamera::name) - cameras.begin();
  };
  const auto l = static_cast<std::size_t>(find(stereo.left));
  const auto r = static_cast<std::size_t>(find(stereo.right));
  for (const std::size_t camera : {l, r}) {
    if (!rectifications[camera]) continue;
    throw Error(
        "camera '{}' is also in an earlier pair, but can be rectified for one pair only; add "
        "another camera with the same mount",
        cameras[camera].name);
  }
  MountedCamera &left = cameras[l], &right = cameras[r];
  RectifiedPair pair = rectified({left.camera.lens, left.camera.size_px, left.X_BC},
                                 {right.camera.lens, right.camera.size_px, right.X_BC});
  if (stereo.images == StereoSpec::Images::Rectified) {
    for (MountedCamera* camera : {&left, &right}) {
      camera->camera.lens = Pinhole{pair.scale};
      camera->camera.size_px = pair.size_px;
    }
    left.X_BC = pair.X_BL;
    right.X_BC = pair.X_BR;
    pair.R_LC = pair.R_RC = {1, 0, 0, 0};
  }
  rectifications[l] = {pair.R_LC, pair.scale, 0};
  rectifications[r] = {pair.R_RC, pair.scale, pair.baseline_m};
}

std::vector<PlacedCamera> place_cameras(const SceneSpec& spec, const Trajectory& X_DB) {
  std::vector<MountedCamera> cameras = spec.cameras;
  std::vector<std::optional<Rectification>> rectifications(cameras.size());
  for (const StereoSpec& stereo : spec.stereo) {
    located(stereo.where, title("stereo", stereo.name),
            [&] { pair_up(stereo, cameras, rectifications); });
  }
  std::vector<PlacedCamera> placed;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    placed.push_back(located(cameras[i].where, title("camera", cameras[i].name),
                             [&] { return place(cameras[i], spec, X_DB); }));
    placed.back().rectification = rectifications[i];
  }
  return placed;
}

// Returns the platform's trajectory in D, from time 0 on; sets `begin` to that time on the
// recorder's clock.
Trajectory lay_platform_path(const RecordedPath& path, const SceneSpec& spec,
                             const Terrain& terrain, std::chrono::nanoseconds& begin) {
  begin = begin_time(path);
  Trajectory X_DB = recorded_path(path, terrain, begin);
  if (X_DB.end_time() < run_time(spec)) {
    throw Error(
        "{}: key 'trajectory': {}: the trajectory lasts {:.3f} s but the scene's duration_s is {} "
        "s; record longer or run shorter",
        path.where, path.tum.string(), in_seconds(X_DB.end_time()), spec.duration_s);
  }
  return X_DB;
}

Trajectory lay_platform_path(const DrivenPath& path, const SceneSpec& spec, const Terrain& terrain,
                             std::chrono::nanoseconds& /*begin*/) {
  // A pose for each 10 ms, of the platform and of each sensor; twice while the list grows.
  const auto paths = static_cast<double>(2 + spec.lidars.size() + spec.cameras.size());
  const double bytes = spec.duration_s / 0.01 * paths * sizeof(Trajectory::Sample);
  const double available = available_memory_bytes();
  if (bytes > available) {
    throw Error(
        "{}: the poses of a drive of {} s take {:.1f} GiB of memory, but {:.1f} GiB are available; "
        "shorten duration_s",
        path.where, spec.duration_s, bytes / 0x1p30, available / 0x1p30);
  }
  return driven_path(path, terrain, run_time(spec));
}

// Returns the distance of a point from the DEM's rectangle, in plan, m.
double distance_m(const GridFrame& frame, const glm::dvec3& p) {
  const glm::dvec2 a = frame.origin_m;
  const glm::dvec2 b = frame.to_D(frame.samples - 1);
  return glm::distance(glm::clamp(glm::dvec2(p), glm::min(a, b), glm::max(a, b)), glm::dvec2(p));
}

// Checks a sensor every 10 ms of the run: it must be above ground, and at least once within reach
// of the DEM.
void check_place(const Trajectory& X_DS, double reach_m, const Terrain& terrain,
                 std::chrono::nanoseconds run) {
  bool in_reach = false;
  for (std::chrono::nanoseconds time{0}; time <= run; time += std::chrono::milliseconds(10)) {
    stop_if_interrupted();
    const glm::dvec3 p_DS = X_DS.pose_at(time).translation_m;
    in_reach |= distance_m(terrain.frame(), p_DS) <= reach_m;
    const auto ground_m = terrain.ground().height_m_at(glm::dvec2(p_DS));
    if (!ground_m || p_DS.z > *ground_m) continue;
    const glm::dvec3 p_WS = p_DS + terrain.header().origin_w_m;
    throw Error(
        "at {:.3f} s it is {:.3f} m below the ground, at ({:.3f}, {:.3f}, {:.3f}) m in W; "
        "raise its mount or the platform's height, or check that the trajectory and the DEM share "
        "a vertical datum",
        in_seconds(time), *ground_m - p_DS.z, p_WS.x, p_WS.y, p_WS.z);
  }
  if (in_reach) return;
  const glm::dvec3 p_DS = X_DS.samples().front().pose.translation_m;
  const glm::dvec3 p_WS = p_DS + terrain.header().origin_w_m;
  throw Error(
      "it starts at ({:.3f}, {:.3f}) m in W, {:.0f} m from the DEM, and never comes within {:.0f} "
      "m of it; is the trajectory in the DEM's CRS, {}? {}",
      p_WS.x, p_WS.y, distance_m(terrain.frame(), p_DS), reach_m, terrain.header().crs_name,
      dem_extent(terrain, glm::dvec2(p_WS)));
}

// Returns the length of the DEM's diagonal. A camera has no range; if it is farther from the DEM
// than this, the trajectory is assumed to be wrong.
double diagonal_m(const GridFrame& frame) {
  return glm::distance(frame.to_D({0, 0}), frame.to_D(frame.samples - 1));
}

double largest_reach_m(const std::vector<PlacedLidar>& lidars,
                       const std::vector<PlacedCamera>& cameras) {
  double reach_m = 0;
  const auto look = [&](const Exposed& frame) {
    stop_if_interrupted();
    const SensorBox box = sensor_box(frame);
    reach_m = std::max(reach_m, glm::distance(glm::dvec2(box.low_m), glm::dvec2(box.high_m)) / 2);
  };
  for (const PlacedLidar& lidar : lidars) {
    for (std::int64_t sweep = 0; sweep < lidar.sweeps; ++sweep) look(exposed(lidar, sweep));
  }
  for (const PlacedCamera& camera : cameras) {
    for (std::size_t i = 0; i < camera.begins.size(); ++i)
      look(exposed(camera, static_cast<std::int64_t>(i)));
  }
  return reach_m;
}

PlacedLidar place(const MountedLidar& mounted, const SceneSpec& spec, const Trajectory& X_DB) {
  Lidar lidar(mounted.lidar, spec.air);
  const std::int64_t sweeps = whole_sweeps(lidar.pattern(), spec);
  if (sweeps == 0) {
    throw Error("a run of {} s is shorter than one sweep at {} Hz; lengthen duration_s",
                spec.duration_s, lidar.pattern().sweep_rate_hz());
  }
  return {mounted, std::move(lidar), X_DB.mounted(mounted.X_BS), sweeps};
}

std::vector<PlacedLidar> place_lidars(const SceneSpec& spec, const Trajectory& X_DB) {
  std::vector<PlacedLidar> lidars;
  for (const MountedLidar& mounted : spec.lidars) {
    lidars.push_back(located(mounted.where, title("lidar", mounted.name),
                             [&] { return place(mounted, spec, X_DB); }));
  }
  return lidars;
}

std::optional<Sky> load_sky(const SceneSpec& spec) {
  if (!spec.sky) return std::nullopt;
  const auto* environment = std::get_if<EnvironmentImage>(&spec.sky->dome);
  return Sky(*spec.sky, environment != nullptr ? read_image_f(environment->image) : ImageF());
}

// Returns true if two scenes that differ as edited_simulation permits scatter the same objects.
bool has_same_placements(const SceneSpec& a, const SceneSpec& b) {
  if (a.scatter.empty()) return true;
  return a.seed.value == b.seed.value &&
         std::ranges::equal(a.scatter, b.scatter, {}, &ScatterLayer::density_per_m2,
                            &ScatterLayer::density_per_m2);
}

std::optional<AerialPerspective> air_of(const SceneSpec& spec) {
  const AerialPerspective air(spec.air);
  return air.extinction_per_m() == glm::dvec3(0) ? std::nullopt : std::optional(air);
}

// Builds everything on a terrain.
// @param objects_of  returns the scene's objects.
template <typename ObjectsOf>
Simulation completed(SceneSpec spec, Terrain terrain, const ObjectsOf& objects_of) {
  std::chrono::nanoseconds begin{0};
  const Trajectory X_DB = extended(
      std::visit([&](const auto& path) { return lay_platform_path(path, spec, terrain, begin); },
                 spec.platform),
      spec);
  std::vector<PlacedLidar> lidars = place_lidars(spec, X_DB);
  std::vector<PlacedCamera> cameras = place_cameras(spec, X_DB);
  for (const PlacedLidar& placed : lidars) {
    located(placed.spec.where, title("lidar", placed.spec.name), [&] {
      check_place(placed.X_DS, placed.spec.lidar.gate.far_m, terrain, run_time(spec));
    });
  }
  for (const PlacedCamera& camera : cameras) {
    located(camera.spec.where, title("camera", camera.spec.name), [&] {
      check_place(camera.X_DC, diagonal_m(terrain.frame()), terrain, run_time(spec));
    });
  }
  const double reach_m = largest_reach_m(lidars, cameras);
  SceneObjects objects = objects_of(spec, terrain, begin);
  std::optional<Sky> sky = load_sky(spec);
  const std::optional<AerialPerspective> air = air_of(spec);
  return {std::move(spec),    std::move(terrain), begin,
          std::move(lidars),  std::move(cameras), reach_m,
          std::move(objects), std::move(sky),     air};
}

}  // namespace

std::chrono::nanoseconds run_time(const SceneSpec& spec) {
  return std::chrono::nanoseconds(std::llround(spec.duration_s * 1e9));
}

std::int64_t whole_sweeps(const ScanPattern& pattern, const SceneSpec& spec) {
  return static_cast<std::int64_t>(std::floor(spec.duration_s * pattern.sweep_rate_hz() + 1e-9));
}

Exposed exposed(const PlacedLidar& lidar, std::int64_t sweep) {
  const ScanPattern& pattern = lidar.lidar.pattern();
  return {&lidar.X_DS, pattern.stamp(sweep), pattern.last_firing(sweep)};
}

Exposed exposed(const PlacedCamera& camera, std::int64_t image) {
  const std::chrono::nanoseconds begin = camera.begins[static_cast<std::size_t>(image)];
  return {&camera.X_DC, begin, begin + camera.camera.duration()};
}

SensorBox sensor_box(const Exposed& frame) {
  constexpr std::chrono::milliseconds spacing(10);
  SensorBox box{glm::dvec3(std::numeric_limits<double>::infinity()),
                glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (std::chrono::nanoseconds time = frame.begin;; time += spacing) {
    time = std::min(time, frame.end);
    const glm::dvec3 p_DS = frame.X_DS->pose_at(time).translation_m;
    box = {glm::min(box.low_m, p_DS), glm::max(box.high_m, p_DS)};
    if (time == frame.end) return box;
  }
}

Exposed first_frame(const Simulation& simulation) {
  return simulation.lidars.empty() ? exposed(simulation.cameras.front(), 0)
                                   : exposed(simulation.lidars.front(), 0);
}

std::filesystem::path data_folder() {
  if (const char* chosen = std::getenv("GROUNDRAY_DATA")) return chosen;
  return own_folder() / "data";
}

Simulation load_simulation(const std::filesystem::path& scene, std::optional<Seed> seed,
                           std::optional<std::uint32_t> world) {
  SceneSpec spec = load_scene(scene, data_folder() / "sensors", world);
  if (seed) spec.seed = *seed;
  Certifying progress;  // shows nothing unless the terrain is certified
  return build_simulation(std::move(spec), [&](double share) { progress.update(share); });
}

Simulation build_simulation(SceneSpec spec, const Terrain::Progress& progress) {
  Terrain terrain = located(spec.terrain.where, "key 'dem'", [&] {
    return Terrain(spec.terrain.dem, spec.terrain.options, spec.terrain.detail, progress,
                   spec.terrain.relief, spec.terrain.erosion);
  });
  return completed(std::move(spec), std::move(terrain), build_scene_objects);
}

Simulation edited_simulation(SceneSpec spec, const Simulation& base) {
  const bool are_same = has_same_placements(spec, base.spec);
  return completed(std::move(spec), base.terrain,
                   [&](const SceneSpec& edited, const Terrain& terrain, nanoseconds begin) {
                     return are_same ? base.scene_objects
                                     : build_scene_objects(edited, terrain, begin);
                   });
}

}  // namespace groundray
