#include "apps/view/layers/scene_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <optional>
#include <string>
#include <utility>

#include "apps/view/layers/line_layer.h"
#include "core/math.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/lidar/pattern/firing_cycle.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {
namespace {

constexpr double axes_m = 0.6, frustum_m = 4, field_m = 3;
constexpr glm::u8vec3 camera_rgb{250, 190, 60}, lidar_rgb{90, 200, 250};

// Number of intervals into which each side of an image is divided.
constexpr int points_a_side = 12;

// Returns points on the boundary of an image, in C at a distance from the lens; each run contains
// consecutive points that the lens images.
std::vector<std::vector<glm::dvec3>> border(const Lens& lens, double depth_m) {
  const glm::dvec2 last = glm::dvec2(lens.size_px()) - 0.5;
  const std::array<glm::dvec2, 5> corner = {
      {{-0.5, -0.5}, {last.x, -0.5}, {last.x, last.y}, {-0.5, last.y}, {-0.5, -0.5}}};
  std::vector<std::vector<glm::dvec3>> runs(1);
  for (std::size_t side = 0; side < 4; ++side) {
    for (int i = 0; i <= points_a_side; ++i) {
      const double share = static_cast<double>(i) / points_a_side;
      const auto ray = lens.ray(corner[side] + share * (corner[side + 1] - corner[side]));
      if (ray) {
        runs.back().push_back(depth_m * ray->direction);
      } else if (!runs.back().empty()) {
        runs.emplace_back();
      }
    }
  }
  return runs;
}

// Returns the limit of the imaged directions as a ring, for a lens that images none of the corners.
std::vector<glm::dvec3> limit_ring(const Lens& lens, double depth_m) {
  std::vector<glm::dvec3> ring;
  for (int i = 0; i <= 64; ++i) {
    const double azimuth = glm::radians(i * 360.0 / 64), off = lens.limit_rad(azimuth);
    ring.push_back(depth_m * glm::dvec3(math::sin(off) * math::cos(azimuth),
                                        math::sin(off) * math::sin(azimuth), math::cos(off)));
  }
  return ring;
}

std::vector<glm::dvec3> moved(const Pose& X_DS, std::vector<glm::dvec3> points) {
  for (glm::dvec3& p : points) p = X_DS * p;
  return points;
}

struct Extent {
  std::optional<glm::dvec3> low, high;
};

// Returns the lowest and the highest direction in each sector of azimuth.
std::vector<Extent> extents(const ScanPattern& pattern) {
  constexpr std::size_t sectors = 72;
  PulseBatch batch;
  pattern.fill(0, 0, pattern.pulses(0), batch);
  std::vector<Extent> found(sectors);
  for (const glm::dvec3& direction : batch.direction) {
    const double turn = math::atan2(direction.y, direction.x) / glm::radians(360.0);
    const auto sector = static_cast<std::size_t>((turn - std::floor(turn)) * sectors) % sectors;
    Extent& extent = found[sector];
    if (!extent.low || direction.z < extent.low->z) extent.low = direction;
    if (!extent.high || direction.z > extent.high->z) extent.high = direction;
  }
  return found;
}

// Adds the view frustum of a camera: the boundary of its image as the lens bends it, and lines to
// the corners.
// @param depth_m  length along the rays, not along the optical axis.
void add_frustum(LineDrawing& drawing, const Pose& X_DC, const Lens& lens, double depth_m,
                 glm::u8vec3 rgb) {
  const glm::dvec2 last = glm::dvec2(lens.size_px()) - 0.5;
  bool has_corner = false;
  for (const glm::dvec2 corner :
       {glm::dvec2(-0.5, -0.5), {last.x, -0.5}, {last.x, last.y}, {-0.5, last.y}}) {
    const auto ray = lens.ray(corner);
    if (!ray) continue;
    has_corner = true;
    drawing.add(moved(X_DC, {glm::dvec3(0), depth_m * ray->direction}), rgb);
  }
  for (const auto& run : border(lens, depth_m)) drawing.add(moved(X_DC, run), rgb);
  if (!has_corner) drawing.add(moved(X_DC, limit_ring(lens, depth_m)), rgb);
}

// Adds a lidar's field of view at one distance: the lowest and the highest beam at all azimuths.
void add_field(LineDrawing& drawing, const Pose& X_DS, const ScanPattern& pattern, double range_m,
               glm::u8vec3 rgb) {
  const std::vector<Extent> all = extents(pattern);
  const std::size_t count = all.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Extent &here = all[i], &next = all[(i + 1) % count];
    if (!here.low) continue;
    const glm::dvec3 low = range_m * *here.low, high = range_m * *here.high;
    const bool is_end = !next.low || !all[(i + count - 1) % count].low;
    if (next.low) {
      drawing.add(moved(X_DS, {low, range_m * *next.low}), rgb);
      drawing.add(moved(X_DS, {high, range_m * *next.high}), rgb);
    }
    if (is_end || i % 18 == 0) drawing.add(moved(X_DS, {low, glm::dvec3(0), high}), rgb);
  }
}

// Returns the layer of a trajectory, with the column "time", s.
Layer trail_layer(const std::string& name, const Trajectory& X_DS, const glm::dvec3& origin_w_m) {
  LineDrawing drawing;
  std::vector<glm::dvec3> path;
  std::vector<float> time;
  for (const Trajectory::Sample& sample : X_DS.samples()) {
    path.push_back(sample.pose.translation_m);
    time.push_back(std::chrono::duration<float>(sample.time).count());
  }
  if (path.size() == 1) {
    path.push_back(path.front());
    time.push_back(time.front());
  }
  drawing.add(std::move(path), {245, 165, 40});
  Layer layer = line_layer(name, LayerKind::Trail, origin_w_m, drawing, 3);
  add_column(layer, {.name = "time", .unit = "s", .scale = ColourScale::Vivid}, time);
  return layer;
}

// Adds the layers of a sensor at a pose.
void add_layers(std::vector<Layer>& layers, const RecordedSensor& sensor, const Pose& X_DS,
                const glm::dvec3& origin_w_m) {
  const Pose X_DB = X_DS * inverse(sensor.X_BS);
  LineDrawing drawing;
  add_axes(drawing, X_DS, axes_m);
  drawing.add({X_DB.translation_m, X_DS.translation_m}, {150, 150, 150});
  if (sensor.camera) add_frustum(drawing, X_DS, sensor.camera->lens, frustum_m, camera_rgb);
  if (sensor.lidar)
    add_field(drawing, X_DS, ScanPattern(sensor.lidar->spec.pattern), field_m, lidar_rgb);
  layers.push_back(
      line_layer(fmt::format("sensors/{}", sensor.name), LayerKind::Sensors, origin_w_m, drawing));
  layers.push_back(trail_layer(fmt::format("path/{}", sensor.name), sensor.X_DS, origin_w_m));
}

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

std::vector<Layer> sensor_layers(const Simulation& simulation) {
  std::vector<Layer> layers;
  const RecordedRun run = run_of(simulation);
  for (const RecordedSensor& sensor : run.sensors)
    add_layers(layers, sensor, pose_at(sensor, sensor.frames.front().stamp),
               run.georeference.origin_w_m);
  return layers;
}

std::vector<Layer> sensor_layers(const RecordedRun& run) {
  std::vector<Layer> layers;
  for (const RecordedSensor& sensor : run.sensors)
    add_layers(layers, sensor, sensor.X_DS.samples().front().pose, run.georeference.origin_w_m);
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
  constexpr double near_m = 22;
  glm::dvec3 target = X_DS.translation_m;
  const double height_m =
      target.z - simulation.terrain.ground().height_m_at(glm::dvec2(target)).value_or(target.z);
  if (height_m > near_m) target.z -= height_m;  // what an aircraft sees, not the aircraft
  return look_at(target + simulation.terrain.header().origin_w_m, ahead,
                 std::max(near_m, 1.5 * height_m));
}

}  // namespace groundray
