#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/camera_image.h"
#include "apps/python/scene_state.h"
#include "apps/python/sweep.h"
#include "apps/scene/frames.h"
#include "core/error.h"
#include "core/geometry/pose.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

// Returns X_AB as the 4 x 4 matrix that maps (x, y, z, 1) in B to A.
AnyArray matrix_of(const Pose& X_AB) {
  const glm::dmat3 R_AB = glm::mat3_cast(X_AB.rotation);
  std::vector<double> values(16, 0.0);
  for (std::size_t row = 0; row < 3; ++row) {
    const auto axis = static_cast<int>(row);
    for (std::size_t column = 0; column < 3; ++column)
      values[4 * row + column] = R_AB[static_cast<int>(column)][axis];
    values[4 * row + 3] = X_AB.translation_m[axis];
  }
  values[15] = 1;
  return array_of(std::move(values), {4, 4});
}

// ----- pickling

// Returns the sensor's scene and its index there.
template <typename Sensor>
nb::list sensor_state(nb::handle self) {
  const auto& sensor = nb::cast<const Sensor&>(self);
  return nb::list(nb::make_tuple(sensor.state, sensor.index));
}

template <typename Sensor>
Sensor restored_sensor(const char* kind, const nb::tuple& values,
                       std::size_t count_of(const Simulation&)) {
  constexpr std::size_t count = 2;
  PickledState state(kind, values, count);
  Sensor sensor{state.next<std::shared_ptr<SceneState>>("scene"), state.next<std::size_t>("index")};
  if (!sensor.state) state.refuse("scene", "is None");
  if (sensor.index >= count_of(sensor.state->simulation))
    state.refuse("index", "is that of no sensor of its scene");
  return sensor;
}

SceneLidar restored_lidar(const nb::tuple& values) {
  return restored_sensor<SceneLidar>(
      "Lidar", values, [](const Simulation& simulation) { return simulation.lidars.size(); });
}

SceneCamera restored_camera(const nb::tuple& values) {
  return restored_sensor<SceneCamera>(
      "Camera", values, [](const Simulation& simulation) { return simulation.cameras.size(); });
}

// ----- lidars

FrameTimes times_of(const SceneLidar& lidar) {
  const PlacedLidar& placed = lidar.placed();
  const ScanPattern& pattern = placed.lidar.pattern();
  return {fmt::format("lidar '{}'", placed.spec.name), placed.sweeps,
          [&pattern](std::int64_t sweep) { return pattern.stamp(sweep); }};
}

Sweep scan(const SceneLidar& lidar, std::optional<double> t_s, std::optional<std::int64_t> frame) {
  const std::int64_t sweep = chosen_frame(times_of(lidar), t_s, frame);
  return without_gil([&](const StopRequest& stop) {
    return make_sweep(*lidar.state, lidar.index, sweep,
                      [&](double /*share*/) { return !stop.is_made(); });
  });
}

constexpr const char* scan_doc = R"(Makes one sweep, on all cores.

Give either of
  t_s    when the sweep begins, in seconds of the scene's time: one of `times_s`
  frame  its number, from 0, as in the names of the files of `groundray generate`

The result has a row for each echo, in firing order and by range, and the columns of
docs/guide/python.md: x_m, y_m, z_m in the frame S of the sensor as its pulse fired (x forward, y left,
z up), range_true_m, world_x_m, world_y_m, world_z_m and normals nx, ny, nz in the dataset's frame
D (x east, y north, z up, from `Scene.origin_w_m`), incidence_rad, time_s since the sweep began,
label, instance and more. The same seed yields the same bytes as `groundray generate`.

Other Python threads keep running, and may scan too. Ctrl-C stops the sweep.
Raises groundray.Error if no sweep begins at t_s.)";

void bind_lidar(nb::module_& module) {
  nb::class_<SceneLidar> type(module, "Lidar", "A lidar on a scene's platform. See Scene.lidar.");
  add_pickling(type, "lidar", &sensor_state<SceneLidar>);
  module.def("restore_lidar", &restored_lidar, "state"_a);
  type.def_prop_ro("name", [](const SceneLidar& lidar) { return lidar.placed().spec.name; })
      .def_prop_ro(
          "model", [](const SceneLidar& lidar) { return lidar.placed().spec.lidar.model; },
          "Make and model.")
      .def_prop_ro(
          "sweep_rate_hz",
          [](const SceneLidar& lidar) { return lidar.placed().lidar.pattern().sweep_rate_hz(); })
      .def_prop_ro(
          "times_s", [](const SceneLidar& lidar) { return all_times_s(times_of(lidar)); },
          nb::rv_policy::automatic,
          "Times at which the complete sweeps of the scene begin: n seconds.")
      .def("scan", &scan, nb::kw_only(), "t_s"_a = nb::none(), "frame"_a = nb::none(), scan_doc)
      .def(
          "pose",
          [](const SceneLidar& lidar, double t_s) {
            return matrix_of(lidar.placed().X_DS.pose_at(nanoseconds_of(t_s)));
          },
          "t_s"_a,
          R"(The pose X_DS of the sensor at a time of the scene: a 4 x 4 matrix.

It transforms points of the sensor's frame S, as columns (x, y, z, 1) in metres, to the frame D.
Raises groundray.Error outside the scene's time.)")
      .def("__repr__", [](const SceneLidar& lidar) {
        return fmt::format("<Lidar '{}': {}, {} sweeps>", lidar.placed().spec.name,
                           lidar.placed().spec.lidar.model, lidar.placed().sweeps);
      });
}

// ----- other data of a scan

nb::object waveforms_of(nb::handle_t<Sweep> self) {
  const auto& sweep = nb::cast<const Sweep&>(self);
  if (sweep.waveforms.interval_s == 0) return nb::none();
  nb::dict all;
  all["interval_s"] = sweep.waveforms.interval_s;
  all["power_w"] = view(sweep.waveforms.power_w.data(), {sweep.waveforms.power_w.size()}, self);
  all["pulse"] = field_of(sweep.waveforms, &WaveformRun::pulse, self);
  all["count"] = field_of(sweep.waveforms, &WaveformRun::count, self);
  all["first_sample"] = field_of(sweep.waveforms, &WaveformRun::first_sample, self);
  all["start_s"] = field_of(sweep.waveforms, &WaveformRun::start_s, self);
  return all;
}

nb::object convergence_of(const Sweep& sweep) {
  const Convergence& seen = sweep.convergence;
  if (seen.pulses == 0) return nb::none();
  nb::dict all;
  all["pulses"] = seen.pulses;
  all["other_echoes"] = seen.changed;
  all["range_rms_m"] = seen.range_m.rms();
  all["range_max_m"] = seen.range_m.largest;
  all["true_rms_m"] = seen.true_m.rms();
  all["true_max_m"] = seen.true_m.largest;
  all["share_rms"] = seen.share.rms();
  all["share_max"] = seen.share.largest;
  return all;
}

void bind_scan(nb::module_& module) {
  nb::class_<Sweep, Points> type(module, "Scan", R"(One sweep of a lidar: a row for each echo.

scan["range_true_m"] is a column; see Points for access to columns, Lidar.scan for their
meaning.)");
  add_pickling(type, "scan", [](nb::handle self) { return state_of(nb::handle_t<Sweep>(self)); });
  module.def("restore_scan", &restored_sweep, "state"_a);
  type.def_ro("frame", &Sweep::frame, "The sweep's number, from 0.")
      .def_prop_ro(
          "t_s", [](const Sweep& sweep) { return seconds_of(sweep.source.stamp); },
          "When the sweep began, in seconds of the scene's time; `time_s` counts from here.")
      .def_prop_ro("sensor", [](const Sweep& sweep) { return sweep.source.sensor; })
      .def_prop_ro(
          "no_returns",
          [](nb::handle_t<Sweep> self) {
            return nb::cast(&nb::cast<Sweep&>(self).no_returns, nb::rv_policy::reference_internal,
                            self);
          },
          nb::sig("def no_returns(self) -> Points"),
          R"(Pulses without an echo, if the sensor's file requests them (else no rows).

Columns: pulse, time_s, ring, dx, dy, dz (direction of the pulse, axes of D) and reason.)")
      .def_prop_ro("waveforms", &waveforms_of,
                   nb::sig("def waveforms(self) -> dict[str, typing.Any] | None"),
                   R"(The received power over time, if the sensor's file requests it, or None.

interval_s between samples; power_w, all samples; and for each run of samples pulse (in the sweep),
count, first_sample (index in power_w) and start_s, its time since the emission of the pulse.)")
      .def_prop_ro(
          "convergence", &convergence_of,
          nb::sig("def convergence(self) -> dict[str, float] | None"),
          R"(Convergence of the footprint: the change by twice the sub-rays; None for single rays.

Of every 64th pulse: pulses compared, other_echoes (pulses whose number of echoes would change),
and the differences between the echoes of the other pulses: range_rms_m and range_max_m of the range,
true_rms_m and true_max_m of range_true, share_rms and share_max of the share.)")
      .def("__repr__", [](const Sweep& sweep) {
        return fmt::format("<Scan {} of lidar '{}', {} s: {} echoes of {}>", sweep.frame,
                           sweep.source.sensor, seconds_of(sweep.source.stamp), sweep.cloud.rows(),
                           fmt::join(names_of(sweep), ", "));
      });
}

// ----- cameras

FrameTimes times_of(const SceneCamera& camera) {
  const PlacedCamera& placed = camera.placed();
  return {fmt::format("camera '{}'", placed.spec.name),
          static_cast<std::int64_t>(placed.begins.size()),
          [&placed](std::int64_t image) { return placed.begins[static_cast<std::size_t>(image)]; }};
}

CameraImage expose(const SceneCamera& camera, std::optional<double> t_s,
                   std::optional<std::int64_t> frame) {
  const std::int64_t image = chosen_frame(times_of(camera), t_s, frame);
  return without_gil([&](const StopRequest& stop) {
    return make_image(*camera.state, camera.index, image, [&] { stop.obey(); });
  });
}

constexpr const char* expose_doc = R"(Makes one image, on all cores.

Give either of
  t_s    when the first row's exposure begins, in seconds of the scene's time: one of `times_s`
  frame  its number, from 0, as in the names of the files of `groundray generate`

`products` in the camera's file selects the channels of the result: docs/guide/python.md lists them,
such as radiance_w_m2_sr (height x width x 3, linear sRGB), depth_m, range_m (height x width,
infinite for sky), position_m (in the frame D), normal, label, instance and picture. Integer
coordinates are centres of pixels; row 0 is uppermost. The same seed yields the same bytes as
`groundray generate`.

Other Python threads keep running. Ctrl-C stops the light transport, the longest part.
Raises groundray.Error if no image begins at t_s.)";

AnyArray directions_of(nb::handle_t<SceneCamera> self) {
  const auto& camera = nb::cast<const SceneCamera&>(self);
  const std::span<const glm::dvec3> all =
      without_gil([&](const StopRequest&) { return camera.placed().camera.directions(); });
  const glm::uvec2 size_px(camera.placed().spec.camera.size_px);
  return view(&all.front().x, {size_px.y, size_px.x, 3}, self);
}

AnyArray project(const SceneCamera& camera, const GivenPoints& points_m) {
  points_m.check("project: points_m");
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> pixels = without_gil([&](const StopRequest&) {
    const Lens& lens = camera.placed().camera.lens();
    std::vector<double> places;
    for (std::size_t i = 0; i < points_m.rows(); ++i) {
      const auto pixel = lens.project({points_m(i, 0), points_m(i, 1), points_m(i, 2)});
      places.push_back(pixel ? pixel->x : none);
      places.push_back(pixel ? pixel->y : none);
    }
    return places;
  });
  return array_of(std::move(pixels), {points_m.rows(), 2});
}

void bind_camera(nb::module_& module) {
  nb::class_<SceneCamera> type(module, "Camera",
                               "A camera on a scene's platform. See Scene.camera.");
  add_pickling(type, "camera", &sensor_state<SceneCamera>);
  module.def("restore_camera", &restored_camera, "state"_a);
  type.def_prop_ro("name", [](const SceneCamera& camera) { return camera.placed().spec.name; })
      .def_prop_ro(
          "model", [](const SceneCamera& camera) { return camera.placed().spec.camera.model; },
          "Make and model.")
      .def_prop_ro(
          "size_px",
          [](const SceneCamera& camera) {
            const glm::ivec2 size_px = camera.placed().spec.camera.size_px;
            return std::pair(size_px.x, size_px.y);
          },
          "Width and height.")
      .def_prop_ro(
          "times_s", [](const SceneCamera& camera) { return all_times_s(times_of(camera)); },
          nb::rv_policy::automatic, "Times at which the images of the scene begin: n seconds.")
      .def("expose", &expose, nb::kw_only(), "t_s"_a = nb::none(), "frame"_a = nb::none(),
           expose_doc)
      .def_prop_ro("directions", &directions_of,
                   R"(Viewing directions of all pixel centres: height x width x 3, a view.

Unit vectors in the camera's frame C (x right, y down, z ahead); zero for pixels without a ray.)")
      .def("project", &project, "points_m"_a,
           R"(Projects points of the camera's frame C (n x 3, metres): n x 2, column and row, px.

Results may be outside of the image; NaN for points that the lens cannot image.)")
      .def(
          "pose",
          [](const SceneCamera& camera, double t_s) {
            return matrix_of(camera.placed().X_DC.pose_at(nanoseconds_of(t_s)));
          },
          "t_s"_a,
          R"(The pose X_DC of the camera at a time of the scene: a 4 x 4 matrix.

It transforms points of the camera's frame C, as columns (x, y, z, 1) in metres, to the frame D.
Raises groundray.Error outside the scene's time.)")
      .def("__repr__", [](const SceneCamera& camera) {
        const PlacedCamera& placed = camera.placed();
        return fmt::format("<Camera '{}': {}, {} x {} px, {} images>", placed.spec.name,
                           placed.spec.camera.model, placed.spec.camera.size_px.x,
                           placed.spec.camera.size_px.y, placed.begins.size());
      });
}

}  // namespace

void bind_sensors(nb::module_& module) {
  bind_scan(module);
  bind_lidar(module);
  bind_camera(module);
}

}  // namespace groundray::python
