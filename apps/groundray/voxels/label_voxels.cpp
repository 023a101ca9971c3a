#include "apps/groundray/voxels/label_voxels.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <optional>

#include "terrain/lod/pass.h"

namespace groundray {
namespace {

constexpr std::size_t tasks_at_once = 64;

// Box of D that contains a grid.
ModelBounds bounds_of_grid(const VoxelGrid& grid, const Pose& X_DS) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  ModelBounds bounds{glm::dvec3(infinity), glm::dvec3(-infinity)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 at(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const glm::dvec3 p_D = X_DS * grid.corner_m(at * grid.size);
    bounds.low_m = glm::min(bounds.low_m, p_D);
    bounds.high_m = glm::max(bounds.high_m, p_D);
  }
  return bounds;
}

// Calls work(task, parts) for each task in parallel, and adds the parts in the order of the tasks.
void add_in_order(std::size_t tasks, VoxelAreas& areas, const std::function<void()>& check,
                  const auto& work) {
  std::vector<std::vector<VoxelPart>> parts(tasks_at_once);
  for (std::size_t first = 0; first < tasks; first += tasks_at_once) {
    const std::size_t count = std::min(tasks_at_once, tasks - first);
    check();
    run_pass(run_in_parallel, count, [&](std::size_t i) {
      parts[i].clear();
      work(first + i, parts[i]);
    });
    for (std::size_t i = 0; i < count; ++i) areas.add(parts[i]);
  }
}

// Adds the parts of the ground: the reference surface, whatever the tolerance of tracing.
class GroundVoxeliser {
 public:
  GroundVoxeliser(const Simulation& simulation, const Scene& scene, const VoxelGrid& grid,
                  const Pose& X_SD, const VoxelLabelMap& map)
      : ground_(simulation.terrain.ground()), scene_(scene), grid_(grid), X_SD_(X_SD), map_(map) {
    const GridFrame& frame = ground_.frame();
    within_ = bounds_of_grid(grid, inverse(X_SD));
    const glm::dvec2 a = frame.to_grid(glm::dvec2(within_.low_m)),
                     b = frame.to_grid(glm::dvec2(within_.high_m));
    const glm::dvec2 last = glm::dvec2(frame.samples - 1);
    first_ = glm::ivec2(glm::floor(glm::clamp(glm::min(a, b), glm::dvec2(0), last)));
    end_ = glm::ivec2(glm::ceil(glm::clamp(glm::max(a, b), glm::dvec2(0), last)));
  }

  std::size_t rows() const { return static_cast<std::size_t>(std::max(0, end_.y - first_.y)); }

  void add_row(std::size_t row, std::vector<VoxelPart>& parts) const {
    for (int column = first_.x; column < end_.x; ++column) {
      const glm::ivec2 cell(column, first_.y + static_cast<int>(row));
      add_half(cell, {cell, {cell.x + 1, cell.y}, {cell.x, cell.y + 1}}, parts);
      add_half(cell, {cell + 1, {cell.x, cell.y + 1}, {cell.x + 1, cell.y}}, parts);
    }
  }

 private:
  // The facet is that at the middle of its corners.
  void add_half(glm::ivec2 cell, const std::array<glm::ivec2, 3>& samples,
                std::vector<VoxelPart>& parts) const {
    const GridFrame& frame = ground_.frame();
    const glm::dvec2 middle = glm::dvec2(samples[0] + samples[1] + samples[2] - 3 * cell) / 3.0;
    const auto plane =
        ground_.facet_at(frame.origin_m + (glm::dvec2(cell) + middle) * frame.step_m);
    if (!plane) return;
    Corners corners;
    double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double z =
          plane->height_m + plane->u_slope_m * samples[i].x + plane->v_slope_m * samples[i].y;
      lowest_m = std::min(lowest_m, z);
      highest_m = std::max(highest_m, z);
      corners[i] = X_SD_ * glm::dvec3(frame.to_D(samples[i]), z);
    }
    if (lowest_m > within_.high_m.z || highest_m < within_.low_m.z) return;
    const glm::dvec3 normal = frame.normal(*plane);
    add_parts(
        grid_, corners, [&](const glm::dvec3& p_S) { return label_at(p_S, normal); }, parts);
  }

  std::uint16_t label_at(const glm::dvec3& p_S, const glm::dvec3& normal) const {
    if (scene_.cover.empty()) return map_.at(scene_.terrain.label);
    const Ray ray{.origin = inverse(X_SD_) * p_S + glm::dvec3(0, 0, 1), .direction = {0, 0, -1}};
    const Hit hit{.range_m = 1, .normal = glm::vec3(normal)};
    return map_.at(scene_.truth_of(ray, hit).label);
  }

  const Ground& ground_;
  const Scene& scene_;
  const VoxelGrid& grid_;
  Pose X_SD_;
  const VoxelLabelMap& map_;
  ModelBounds within_{};
  glm::ivec2 first_{0}, end_{0};  // cells
};

// Linear map from a model to the grid's frame.
struct ModelInGrid {
  glm::dmat3 linear{1};
  glm::dvec3 origin{0};
};

ModelInGrid in_grid(const ObjectTracer& objects, std::uint32_t object, const Pose& X_SD,
                    std::chrono::nanoseconds time) {
  const PlacedObject placed = objects.placed_at(object, time);
  const Lean lean = objects.lean(object, time);
  ModelInGrid map{.linear = placed.scale * glm::mat3_cast(placed.R_DO),
                  .origin = X_SD * placed.p_DO};
  for (glm::length_t axis = 0; axis < 3; ++axis)
    map.linear[axis] = X_SD.rotation * lean.leaning(map.linear[axis]);
  return map;
}

// Some triangles of an object.
struct ObjectTask {
  std::uint32_t object = 0;
  std::size_t first = 0, end = 0;
};

// Returns the triangles of the objects that may reach into the grid.
std::vector<ObjectTask> object_tasks(const ObjectTracer& objects, const VoxelGrid& grid,
                                     const Pose& X_SD, std::chrono::nanoseconds time) {
  constexpr std::size_t triangles_at_once = 4096;
  const auto models = objects.models();
  std::vector<ModelBounds> bounds;
  for (const ModelScene& model : models) bounds.push_back(bounds_of(model.model().mesh));
  const glm::dvec3 high_m = grid.corner_m(grid.size);
  std::vector<ObjectTask> tasks;
  for (std::uint32_t object = 1; object <= objects.size(); ++object) {
    const std::uint32_t model = objects.model_of(object);
    const ModelInGrid map = in_grid(objects, object, X_SD, time);
    const glm::dvec3 half = 0.5 * (bounds[model].high_m - bounds[model].low_m);
    const glm::dvec3 centre =
        map.origin + map.linear * (0.5 * (bounds[model].high_m + bounds[model].low_m));
    glm::dvec3 reach(0);
    for (glm::length_t axis = 0; axis < 3; ++axis) reach += half[axis] * glm::abs(map.linear[axis]);
    if (glm::any(glm::greaterThan(centre - reach, high_m)) ||
        glm::any(glm::lessThan(centre + reach, grid.low_m)))
      continue;
    const std::size_t count = models[model].model().mesh.triangles.size();
    for (std::size_t first = 0; first < count; first += triangles_at_once)
      tasks.push_back({object, first, std::min(count, first + triangles_at_once)});
  }
  return tasks;
}

}  // namespace

void VoxelAreas::add(const std::vector<VoxelPart>& parts) {
  std::vector<double>* areas = nullptr;
  std::optional<std::uint16_t> label;
  for (const VoxelPart& part : parts) {
    if (label != part.label) {
      label = part.label;
      areas = &areas_m2_.try_emplace(part.label, voxels_, -1.0).first->second;
    }
    double& area = (*areas)[part.voxel];
    area = std::max(area, 0.0) + part.area_m2;
  }
}

std::vector<std::uint16_t> VoxelAreas::labels() const {
  std::vector<std::uint16_t> labels(voxels_, 0);
  std::vector<double> largest_m2(voxels_, -1);
  for (const auto& [label, areas] : areas_m2_) {
    for (std::size_t i = 0; i < voxels_; ++i) {
      if (areas[i] <= largest_m2[i]) continue;
      largest_m2[i] = areas[i];
      labels[i] = label;
    }
  }
  return labels;
}

std::vector<std::uint16_t> label_voxels(const Simulation& simulation, const Scene& scene,
                                        const VoxelGrid& grid, const Pose& X_SD,
                                        std::chrono::nanoseconds time, const VoxelLabelMap& map,
                                        const std::function<void()>& check) {
  VoxelAreas areas(grid.count());
  const GroundVoxeliser ground(simulation, scene, grid, X_SD, map);
  add_in_order(ground.rows(), areas, check,
               [&](std::size_t row, std::vector<VoxelPart>& parts) { ground.add_row(row, parts); });
  const ObjectTracer& objects = scene.objects;
  const std::vector<ObjectTask> tasks = object_tasks(objects, grid, X_SD, time);
  add_in_order(tasks.size(), areas, check, [&](std::size_t i, std::vector<VoxelPart>& parts) {
    const ObjectTask& task = tasks[i];
    const std::uint32_t model = objects.model_of(task.object);
    const TriangleMesh& mesh = objects.models()[model].model().mesh;
    const std::uint16_t label = map.at(scene.models[model].label);
    const ModelInGrid in = in_grid(objects, task.object, X_SD, time);
    for (std::size_t k = task.first; k < task.end; ++k) {
      Corners corners;
      for (glm::length_t j = 0; j < 3; ++j) {
        const glm::dvec3& p_O = mesh.vertices_m[mesh.triangles[k][j]];
        corners[static_cast<std::size_t>(j)] = in.origin + in.linear * p_O;
      }
      add_parts(
          grid, corners, [&](const glm::dvec3&) { return label; }, parts);
    }
  });
  return areas.labels();
}

}  // namespace groundray
