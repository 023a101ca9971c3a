#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <utility>
#include <vector>

#include "core/tracing/scene.h"
#include "terrain/terrain_scene.h"

namespace groundray::testing {

constexpr std::uint16_t ground_label = 3;
constexpr std::uint16_t first_model_label =
    10;  // label of the first model; each next model has one more

/// The plane z = x_slope x + y_slope y + height_m over 4 km, exact where floats represent it.
inline HeightGrid plane_ground(double x_slope, double y_slope, double height_m) {
  const double east_m = 2000 * x_slope, north_m = 2000 * y_slope;
  std::vector<float> heights_m;
  for (const double offset_m :
       {-east_m - north_m, east_m - north_m, -east_m + north_m, east_m + north_m})
    heights_m.push_back(static_cast<float>(height_m + offset_m));
  return {{2, 2}, {-2000, -2000}, {4000, 4000}, std::move(heights_m)};
}

/// A scene with a single grey material.
inline Scene scene_of(const HeightGrid& ground, std::vector<Model> models,
                      std::vector<PlacedObject> placed = {}, std::vector<MovingObject> moving = {},
                      Tracing tracing = Tracing::Fast) {
  const RayDevice device;
  std::vector<ModelTruth> truths;
  std::vector<ModelScene> scenes;
  for (Model& model : models) {
    truths.push_back({static_cast<std::uint16_t>(first_model_label + scenes.size()),
                      std::vector<std::uint16_t>(model.surfaces.size(), 0)});
    scenes.emplace_back(device, std::move(model), tracing);
  }
  return {RayTracer({full_resolution_level(ground)}, {0, 0, 0}, tracing),
          {.label = ground_label},
          Materials{{"grey", Lambertian{{{400, 0.5}, {700, 0.5}}}}},
          {device, std::move(scenes), std::move(placed), std::move(moving)},
          std::move(truths)};
}

/// A square of side 2 half_m in the y-z plane of its frame that faces x; u along y, v along z.
inline Model board(double half_m) {
  Model model;
  model.mesh.vertices_m = {
      {0, -half_m, -half_m}, {0, half_m, -half_m}, {0, half_m, half_m}, {0, -half_m, half_m}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  model.surface_of = {0, 0};
  model.surfaces.resize(1);
  return model;
}

/// Pose of a camera at one position that looks towards another, with level rows.
inline Pose looking(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 z = glm::normalize(to - from);
  const glm::dvec3 x = glm::normalize(glm::cross(z, glm::dvec3(0, 0, 1)));
  return {glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z)), from};
}

/// A trajectory that passes `pose` at time 0, from one second before it to two after it.
inline Trajectory gliding(const Pose& pose, const glm::dvec3& velocity_m_s) {
  return Trajectory(
      {{std::chrono::seconds(-1), {pose.rotation, pose.translation_m - velocity_m_s}},
       {std::chrono::seconds(0), pose},
       {std::chrono::seconds(2), {pose.rotation, pose.translation_m + 2.0 * velocity_m_s}}});
}

}  // namespace groundray::testing
