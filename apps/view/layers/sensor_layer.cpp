#include "apps/view/layers/sensor_layer.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <optional>

#include "sensors/lidar/pattern/firing_cycle.h"

namespace groundray {
namespace {

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
    ring.push_back(depth_m * glm::dvec3(std::sin(off) * std::cos(azimuth),
                                        std::sin(off) * std::sin(azimuth), std::cos(off)));
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
    const double turn = std::atan2(direction.y, direction.x) / glm::radians(360.0);
    const auto sector = static_cast<std::size_t>((turn - std::floor(turn)) * sectors) % sectors;
    Extent& extent = found[sector];
    if (!extent.low || direction.z < extent.low->z) extent.low = direction;
    if (!extent.high || direction.z > extent.high->z) extent.high = direction;
  }
  return found;
}

}  // namespace

void add_axes(LineDrawing& drawing, const Pose& X_DF, double length_m) {
  constexpr std::array<glm::u8vec3, 3> colours = {
      glm::u8vec3(224, 62, 54), {70, 170, 70}, {60, 110, 220}};
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    glm::dvec3 tip(0);
    tip[axis] = length_m;
    drawing.add({X_DF * glm::dvec3(0), X_DF * tip}, colours[static_cast<std::size_t>(axis)]);
  }
}

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

void add_mount(LineDrawing& drawing, const Pose& X_DB, const Pose& X_DS) {
  drawing.add({X_DB.translation_m, X_DS.translation_m}, {150, 150, 150});
}

Layer line_layer(const std::string& name, LayerKind kind, const LineDrawing& drawing,
                 const glm::dvec3& origin_w_m) {
  std::vector<std::size_t> lengths;
  std::size_t all = 0;
  for (const LineDrawing::Run& run : drawing.runs) {
    if (run.points_m.size() < 2) continue;
    lengths.push_back(run.points_m.size());
    all += run.points_m.size();
  }
  Layer layer{.name = name, .kind = kind, .data = make_points(all)};
  const glm::dvec3 origin = all == 0 ? glm::dvec3(0) : glm::round(drawing.runs[0].points_m[0]);
  layer.origin_w_m = origin_w_m + origin;
  const auto places = coordinates(*layer.data);
  std::vector<std::uint8_t> rgb;
  std::size_t next = 0;
  for (const LineDrawing::Run& run : drawing.runs) {
    if (run.points_m.size() < 2) continue;
    for (const glm::dvec3& p : run.points_m) {
      for (glm::length_t k = 0; k < 3; ++k) {
        places[next++] = static_cast<float>(p[k] - origin[k]);
        rgb.push_back(run.rgb[k]);
      }
    }
  }
  set_lines(*layer.data, lengths);
  add_colours(layer, {.name = "colour", .unit = ""}, rgb);
  layer.coloured_by = "colour";
  layer.line_width_px = 2;
  return layer;
}

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
  Layer layer = line_layer(name, LayerKind::Trail, drawing, origin_w_m);
  add_column(layer, {.name = "time", .unit = "s", .scale = ColourScale::Vivid}, time);
  layer.line_width_px = 3;
  return layer;
}

}  // namespace groundray
