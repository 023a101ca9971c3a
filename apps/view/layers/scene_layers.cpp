#include "apps/view/layers/scene_layers.h"

#include <fmt/format.h>

#include <glm/geometric.hpp>
#include <optional>

#include "apps/view/layers/sensor_layer.h"

namespace groundray {
namespace {

constexpr double axes_m = 0.6, frustum_m = 4, field_m = 3;
constexpr glm::u8vec3 camera_rgb{250, 190, 60}, lidar_rgb{90, 200, 250};

struct Drawn {
  const std::string* name;
  const Trajectory* X_DS;
  Pose X_DS_now, X_BS;
  const Lens* lens = nullptr;
  const ScanPattern* pattern = nullptr;
};

void add_layers(std::vector<Layer>& layers, const Drawn& sensor, const glm::dvec3& origin_w_m) {
  LineDrawing drawing;
  add_axes(drawing, sensor.X_DS_now, axes_m);
  add_mount(drawing, sensor.X_DS_now * inverse(sensor.X_BS), sensor.X_DS_now);
  if (sensor.lens != nullptr)
    add_frustum(drawing, sensor.X_DS_now, *sensor.lens, frustum_m, camera_rgb);
  if (sensor.pattern != nullptr)
    add_field(drawing, sensor.X_DS_now, *sensor.pattern, field_m, lidar_rgb);
  layers.push_back(
      line_layer(fmt::format("sensors/{}", *sensor.name), LayerKind::Sensors, drawing, origin_w_m));
  layers.push_back(trail_layer(fmt::format("path/{}", *sensor.name), *sensor.X_DS, origin_w_m));
}

}  // namespace

std::vector<Layer> sensor_layers(const Simulation& simulation) {
  std::vector<Layer> layers;
  const glm::dvec3& origin_w_m = simulation.terrain.header().origin_w_m;
  for (const PlacedLidar& lidar : simulation.lidars) {
    add_layers(layers,
               {.name = &lidar.spec.name,
                .X_DS = &lidar.X_DS,
                .X_DS_now = lidar.X_DS.pose_at(exposed(lidar, 0).begin),
                .X_BS = lidar.spec.X_BS,
                .pattern = &lidar.lidar.pattern()},
               origin_w_m);
  }
  for (const PlacedCamera& camera : simulation.cameras) {
    add_layers(layers,
               {.name = &camera.spec.name,
                .X_DS = &camera.X_DC,
                .X_DS_now = camera.X_DC.pose_at(exposed(camera, 0).begin),
                .X_BS = camera.spec.X_BC,
                .lens = &camera.camera.lens()},
               origin_w_m);
  }
  return layers;
}

std::vector<Layer> sensor_layers(const RecordedRun& run) {
  std::vector<Layer> layers;
  for (const RecordedSensor& sensor : run.sensors) {
    std::optional<ScanPattern> pattern;
    if (sensor.lidar) pattern.emplace(sensor.lidar->spec.pattern);
    add_layers(layers,
               {.name = &sensor.name,
                .X_DS = &sensor.X_DS,
                .X_DS_now = sensor.X_DS.samples().front().pose,
                .X_BS = sensor.X_BS,
                .lens = sensor.camera ? &sensor.camera->lens : nullptr,
                .pattern = pattern ? &*pattern : nullptr},
               run.georeference.origin_w_m);
  }
  return layers;
}

glm::dvec3 middle_of_run(const Simulation& simulation) {
  const Exposed frame = first_frame(simulation);
  const auto& samples = frame.X_DS->samples();
  return samples[samples.size() / 2].pose.translation_m;
}

Look look_at(const glm::dvec3& at_w_m, const glm::dvec3& ahead, double distance_m) {
  glm::dvec3 level(ahead.x, ahead.y, 0);
  level = glm::length(level) > 1e-6 ? glm::normalize(level) : glm::dvec3(0, 1, 0);
  const glm::dvec3 aside(level.y, -level.x, 0);
  return {.from_w_m = at_w_m + distance_m * (-0.85 * level + 0.42 * aside + glm::dvec3(0, 0, 0.30)),
          .at_w_m = at_w_m};
}

Look look_at_platform(const Simulation& simulation) {
  const Exposed frame = first_frame(simulation);
  const Pose X_DS = frame.X_DS->pose_at(frame.begin);
  const glm::dvec3 ahead = middle_of_run(simulation) - X_DS.translation_m;
  return look_at(X_DS.translation_m + simulation.terrain.header().origin_w_m, ahead, 22);
}

}  // namespace groundray
