#include "apps/scene/cameras.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "apps/scene/paths.h"
#include "core/error.h"
#include "sensors/camera/irradiance.h"
#include "sensors/camera/lens/stereo.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

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
    throw Error("camera '{}': {} Hz for {} s are {:.3g} images, but a run may have at most {:.0e}",
                mounted.name, mounted.camera.rate_hz, spec.duration_s,
                mounted.camera.rate_hz * spec.duration_s, most);
  }
  for (std::int64_t image = 0; begin_of(image) <= run_time(spec); ++image)
    begins.push_back(begin_of(image));
  return begins;
}

// Checks conditions that depend on both the camera's file and the scene's.
void check_work(const MountedCamera& mounted, const std::vector<nanoseconds>& begins) {
  const CameraSpec& camera = mounted.camera;
  const std::string& name = mounted.name;
  const auto too_soon = std::ranges::adjacent_find(begins, [&](nanoseconds a, nanoseconds b) {
    return b - a < time_of(camera.shutter.exposure_s);
  });
  if (mounted.trigger && too_soon != begins.end()) {
    throw Error(
        "camera '{}': it exposes for {:.6g} ms, but is triggered again after {:.6g} ms; "
        "shorten exposure_ms",
        name, 1e3 * camera.shutter.exposure_s,
        1e-6 * static_cast<double>((too_soon[1] - too_soon[0]).count()));
  }
  if (gives(camera, CameraProduct::Picture) && camera.imager->filter != ColorFilter::Mono &&
      std::min(camera.size_px.x, camera.size_px.y) < 3) {
    throw Error(
        "camera '{}': a picture of a mosaic needs at least 3 x 3 px, but size_px is [{}, {}]; "
        "enlarge it, or remove 'picture' from the products",
        name, camera.size_px.x, camera.size_px.y);
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
        "camera '{}': no image of {:.6g} s begins and ends within the run of {} s; lengthen "
        "duration_s, or check first_ms, trigger and shutter",
        mounted.name, 1e-9 * static_cast<double>(placed.camera.duration().count()),
        spec.duration_s);
  }
  const auto& [imager, aperture] = std::tie(mounted.camera.imager, mounted.camera.aperture);
  if (imager && aperture) {
    try {
      placed.pupil_sr = pupil_sr(placed.camera.lens(), *aperture, imager->pixel_pitch_m);
    } catch (const Error& fault) {
      throw Error("camera '{}': {}", mounted.name, fault.what());
    }
  }
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
        "stereo '{}': camera '{}' is also in an earlier pair, but can be rectified for one pair "
        "only; add another camera with the same mount",
        stereo.name, cameras[camera].name);
  }
  MountedCamera &left = cameras[l], &right = cameras[r];
  RectifiedPair pair;
  try {
    pair = rectified({left.camera.lens, left.camera.size_px, left.X_BC},
                     {right.camera.lens, right.camera.size_px, right.X_BC});
  } catch (const Error& fault) {
    throw Error("stereo '{}': {}", stereo.name, fault.what());
  }
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

}  // namespace

std::vector<PlacedCamera> place_cameras(const SceneSpec& spec, const Trajectory& X_DB) {
  std::vector<MountedCamera> cameras = spec.cameras;
  std::vector<std::optional<Rectification>> rectifications(cameras.size());
  for (const StereoSpec& stereo : spec.stereo) pair_up(stereo, cameras, rectifications);
  std::vector<PlacedCamera> placed;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    placed.push_back(place(cameras[i], spec, X_DB));
    placed.back().rectification = rectifications[i];
  }
  return placed;
}

}  // namespace groundray
