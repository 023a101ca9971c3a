// Textures of a model's surfaces: tints and shading normals.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/appearance/normal_map.h"
#include "core/geometry/tangents.h"
#include "core/tracing/model_scene.h"

namespace groundray {
namespace {

std::array<glm::dvec3, 3> corners_of(const Model& model, std::uint32_t triangle) {
  const glm::uvec3& t = model.mesh.triangles[triangle];
  return {model.mesh.vertices_m[t.x], model.mesh.vertices_m[t.y], model.mesh.vertices_m[t.z]};
}

std::array<glm::dvec2, 3> uv_of(const Model& model, std::uint32_t triangle) {
  const glm::uvec3& t = model.mesh.triangles[triangle];
  return {model.uv[t.x], model.uv[t.y], model.uv[t.z]};
}

// Barycentric coordinates of a point near the plane of a triangle; 1/3 each if it has no area.
glm::dvec3 shares_at(const std::array<glm::dvec3, 3>& p_m, const glm::dvec3& p_O) {
  const glm::dvec3 normal = glm::cross(p_m[1] - p_m[0], p_m[2] - p_m[0]);
  const double square = glm::dot(normal, normal);
  if (!(square > 0)) return glm::dvec3(1.0 / 3);
  const auto share = [&](int a, int b) {
    return glm::dot(glm::cross(p_m[static_cast<std::size_t>(a)] - p_O,
                               p_m[static_cast<std::size_t>(b)] - p_O),
                    normal) /
           square;
  };
  return {share(1, 2), share(2, 0), share(0, 1)};
}

Footprint footprint_on(const Model& model, std::uint32_t triangle, const SurfacePatch& patch_O) {
  return footprint_of(patch_O,
                      tangents_of_triangle(corners_of(model, triangle), uv_of(model, triangle)));
}

// Parallelogram with the second moments of a triangle. With edges e and f from one corner, those of
// the triangle are (e e' + f f' - (e f' + f e') / 2) / 18; those of a parallelogram with sides a
// and b are (a a' + b b') / 12.
Footprint footprint_of_all(const std::array<glm::dvec2, 3>& uv) {
  const glm::dvec2 e = uv[1] - uv[0], f = uv[2] - uv[0];
  return {(e + f) / std::sqrt(6.0), (e - f) / std::sqrt(2.0)};
}

}  // namespace

void ModelScene::Impl::find_means() {
  std::vector<glm::dvec3> sums(textures.size());
  std::vector<double> areas_m2(textures.size());
  for (std::uint32_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const std::uint16_t surface = model.surface_of[i];
    if (!textures[surface].albedo || model.uv.empty()) continue;
    const auto uv = uv_of(model, i);
    const double area_m2 = glm::length(normal(i)) / 2;
    sums[surface] +=
        area_m2 * glm::dvec3(textures[surface].albedo->color(
                      (uv[0] + uv[1] + uv[2]) / 3.0, footprint_of_all(uv), Filtering::Fast));
    areas_m2[surface] += area_m2;
  }
  for (std::size_t i = 0; i < textures.size(); ++i) {
    if (areas_m2[i] > 0) textures[i].mean = glm::vec3(sums[i] / areas_m2[i]);
  }
}

std::size_t ModelScene::texture_bytes() const noexcept {
  std::size_t bytes = impl_->cut_outs.memory_bytes();
  for (const auto& worn : impl_->textures) {
    for (const auto* texture : {&worn.albedo, &worn.normal, &worn.opacity}) {
      if (*texture) bytes += (*texture)->memory_bytes();
    }
  }
  return bytes;
}

bool ModelScene::has_albedo(std::uint32_t triangle) const noexcept {
  return impl_->textures_of(triangle).albedo.has_value() && !impl_->model.uv.empty();
}

bool ModelScene::has_albedo() const noexcept {
  return !impl_->model.uv.empty() && std::ranges::any_of(impl_->textures, [](const auto& worn) {
    return worn.albedo.has_value();
  });
}

Tint ModelScene::tint(std::uint32_t triangle, const glm::dvec3& p_O, const SurfacePatch& patch_O,
                      Filtering filtering) const noexcept {
  if (!has_albedo(triangle)) return {};
  const Model& model = impl_->model;
  const auto& worn = impl_->textures_of(triangle);
  const glm::dvec2 uv = impl_->uv_at(triangle, shares_at(corners_of(model, triangle), p_O));
  return tint_of(worn.albedo->color(uv, footprint_on(model, triangle, patch_O), filtering),
                 worn.mean);
}

glm::dvec3 ModelScene::shading_normal(std::uint32_t triangle, const glm::dvec3& p_O,
                                      const glm::dvec3& normal_O, const SurfacePatch& patch_O,
                                      Filtering filtering) const noexcept {
  const Model& model = impl_->model;
  const auto corners_m = corners_of(model, triangle);
  const glm::dvec3 shares = shares_at(corners_m, p_O);
  glm::dvec3 base = normal_O;
  if (!model.normals.empty()) {
    const glm::uvec3& t = model.mesh.triangles[triangle];
    const glm::dvec3 smooth = glm::dvec3(model.normals[t.x]) * shares.x +
                              glm::dvec3(model.normals[t.y]) * shares.y +
                              glm::dvec3(model.normals[t.z]) * shares.z;
    const double size = glm::length(smooth);
    if (size > 0) base = (glm::dot(smooth, normal_O) < 0 ? -smooth : smooth) / size;
  }
  const auto& bumps = impl_->textures_of(triangle).normal;
  if (!bumps || model.uv.empty())
    return groundray::shading_normal({}, base, normal_O, glm::dvec3(0, 0, 1));
  const Tangents tangents = tangents_of_triangle(corners_m, uv_of(model, triangle));
  const glm::vec3 texel =
      bumps->color(impl_->uv_at(triangle, shares), footprint_of(patch_O, tangents), filtering);
  return groundray::shading_normal(tangents, base, normal_O, decode_normal(texel));
}

}  // namespace groundray
