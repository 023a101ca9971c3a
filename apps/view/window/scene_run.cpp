#include "apps/view/window/scene_run.h"

namespace groundray {
namespace {

template <typename Placed>
void add_frame(RecordedSensor& sensor, const Placed& placed, std::int64_t number) {
  const Exposed frame = exposed(placed, number);
  sensor.frames.push_back({number, frame.begin, {}});
  sensor.lasts = frame.end - frame.begin;
}

RecordedSensor sensor_of(const PlacedLidar& placed) {
  RecordedSensor sensor{.name = placed.spec.name,
                        .model = placed.spec.lidar.model,
                        .kind = SensorKind::Lidar,
                        .X_DS = placed.X_DS,
                        .X_BS = placed.spec.X_BS,
                        .frames = {},
                        .lidar = LidarFacts{placed.spec.lidar, true},
                        .camera = std::nullopt};
  for (std::int64_t k = 0; k < placed.sweeps; ++k) add_frame(sensor, placed, k);
  return sensor;
}

RecordedSensor sensor_of(const PlacedCamera& placed) {
  RecordedSensor sensor{.name = placed.spec.name,
                        .model = "",
                        .kind = SensorKind::Camera,
                        .X_DS = placed.X_DC,
                        .X_BS = placed.spec.X_BC,
                        .frames = {},
                        .lidar = std::nullopt,
                        .camera = CameraFacts{.lens = placed.camera.lens()}};
  for (std::size_t k = 0; k < placed.begins.size(); ++k) {
    add_frame(sensor, placed, static_cast<std::int64_t>(k));
  }
  return sensor;
}

}  // namespace

RecordedRun run_of(const Simulation& simulation) {
  RecordedRun run;
  run.georeference.origin_w_m = simulation.terrain.header().origin_w_m;
  run.georeference.crs_name = simulation.terrain.header().crs_name;
  for (const PlacedLidar& lidar : simulation.lidars) run.sensors.push_back(sensor_of(lidar));
  for (const PlacedCamera& camera : simulation.cameras) run.sensors.push_back(sensor_of(camera));
  return run;
}

}  // namespace groundray
