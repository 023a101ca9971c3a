#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/python/binding/points.h"
#include "apps/python/scene_state.h"
#include "core/geometry/trajectory.h"
#include "core/io/mesh_io.h"
#include "sensors/lidar/lidar.h"

namespace groundray::python {

/// Sensor of a sweep, as far as users of the sweep need it: a sweep outlives its scene.
struct SweepSource {
  std::string sensor;
  std::chrono::nanoseconds stamp{0};
  LidarSpec::Points points = LidarSpec::Points::AsFired;
  double range_noise_sigma_m = 0;
  Georeference georeference;  ///< of D
  /// Poses X_DS around the time of the sweep, from which `X_DS` was made. Kept because it
  /// normalises them.
  std::vector<Trajectory::Sample> poses;
  Trajectory X_DS{poses};
};

/// Sweep of a scene's lidar: its echoes and the data that belong to them.
struct Sweep : Points {
  Points no_returns;
  Waveforms waveforms;
  Convergence convergence;
  std::int64_t frame = 0;
  SweepSource source;
};

/// Simulates a sweep.
/// @param lidar  index in the scene.
/// @throws as groundray::make_scan.
Sweep make_sweep(SceneState& state, std::size_t lidar, std::int64_t frame, const SweepWatch& watch);

/// Returns a view of a field of all runs, which `owner` keeps alive.
template <typename Value>
AnyArray field_of(const Waveforms& all, const Value WaveformRun::*field, nb::handle owner) {
  constexpr auto step = static_cast<std::int64_t>(sizeof(WaveformRun) / sizeof(Value));
  return view(all.runs.empty() ? nullptr : &(all.runs.front().*field), {all.runs.size()}, owner,
              step);
}

/// Returns the values from which restored_sweep makes an equal sweep.
nb::list state_of(nb::handle_t<Sweep> self);

/// Makes a sweep from a pickle.
/// @throws Error naming the damaged value.
Sweep restored_sweep(const nb::tuple& values);

}  // namespace groundray::python
