#include "core/tracing/scene.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "core/tracing/ground_slope.h"

namespace groundray {
namespace {

// Returns the point of the ground that a ray hit.
GroundCover::Point ground_point(const Scene& scene, const Ray& ray, const Hit& hit) noexcept {
  GroundCover::Point point = GroundCover::on_facet(ray.origin + ray.direction * hit.range_m,
                                                   glm::normalize(glm::dvec3(hit.normal)));
  if (scene.cover.depends_on_slope()) {
    if (const auto slope_rad = ground_slope_rad(scene.rays, glm::dvec2(point.p_D)))
      point.slope_rad = *slope_rad;
  }
  return point;
}

// Point of an object that a ray hit, in the object's frame O, and the surface patch that the ray
// covers there; of a plant that leans, as if it were upright.
struct ModelPoint {
  const ModelScene& model;
  Lean lean;
  glm::dquat R_DO;
  glm::dvec3 p_O;
  glm::dvec3 normal_O;
  SurfacePatch patch_O;
};
ModelPoint model_point(const ObjectTracer& objects, const Ray& ray, const Hit& hit,
                       double width_m) noexcept {
  const PlacedObject object = objects.placed_at(hit.object, ray.time);
  const glm::dquat R_OD = glm::conjugate(object.R_DO);
  glm::dvec3 p_DQ = ray.origin + ray.direction * hit.range_m;
  glm::dvec3 normal = glm::normalize(glm::dvec3(hit.normal));
  SurfacePatch patch = surface_patch(width_m, ray.direction, normal);
  const Lean lean = objects.lean(hit.object, ray.time);
  if (lean) {
    p_DQ = object.p_DO + lean.upright(p_DQ - object.p_DO);
    normal = glm::normalize(lean.upright_normal(normal));
    patch = {lean.upright(patch.a_m), lean.upright(patch.b_m)};
  }
  return {objects.models()[object.model],
          lean,
          object.R_DO,
          R_OD * (p_DQ - object.p_DO) / object.scale,
          R_OD * normal,
          {R_OD * patch.a_m / object.scale, R_OD * patch.b_m / object.scale}};
}

Appearance of_material(std::uint16_t material) noexcept {
  Appearance appearance;
  appearance.parts[0] = {material, 1, {}};
  appearance.count = 1;
  return appearance;
}

Appearance appearance_at(const Scene& scene, const Ray& ray, const Hit& hit, const ModelPoint& at,
                         Filtering filtering) noexcept {
  Appearance appearance = of_material(scene.truth_of(ray, hit).material);
  if (at.model.has_albedo(hit.part))
    appearance.parts[0].tint = at.model.tint(hit.part, at.p_O, at.patch_O, filtering);
  return appearance;
}

Appearance appearance_at(const GroundCover& cover, const GroundCover::Point& point,
                         const SurfacePatch& patch, Filtering filtering) noexcept {
  Appearance appearance;
  const auto shares = cover.shares_at(point);
  for (std::size_t i = 0; i < cover.layers().size(); ++i) {
    if (shares[i] == 0) continue;
    appearance.parts[appearance.count++] = {cover.layers()[i].material, shares[i],
                                            cover.tint_at(i, point, patch, filtering)};
  }
  return appearance;
}

}  // namespace

SurfaceTruth Scene::truth_of(const Ray& ray, const Hit& hit) const noexcept {
  if (hit.object == 0) {
    if (cover.empty()) return terrain;
    const auto shares = cover.shares_at(ground_point(*this, ray, hit));
    const auto largest =
        static_cast<std::size_t>(std::ranges::max_element(shares) - shares.begin());
    const CoverLayer& layer = cover.layers()[largest];
    return {layer.label, 0, layer.material};
  }
  const std::uint32_t model = objects.model_of(hit.object);
  const std::uint16_t surface = objects.models()[model].model().surface_of[hit.part];
  return {models[model].label, objects.instance_of(hit.object), models[model].materials[surface]};
}

bool Scene::is_plain() const noexcept {
  return cover.empty() && std::ranges::none_of(objects.models(), [](const ModelScene& scene) {
           return scene.has_albedo();
         });
}

Appearance Scene::appearance_of(const Ray& ray, const Hit& hit, double width_m,
                                Filtering filtering) const noexcept {
  if (hit.object != 0) {
    if (!objects.models()[objects.model_of(hit.object)].has_albedo(hit.part))
      return of_material(truth_of(ray, hit).material);
    return appearance_at(*this, ray, hit, model_point(objects, ray, hit, width_m), filtering);
  }
  if (cover.empty()) return of_material(terrain.material);
  const GroundCover::Point point = ground_point(*this, ray, hit);
  return appearance_at(cover, point, surface_patch(width_m, ray.direction, point.normal),
                       filtering);
}

SeenSurface Scene::look_at(const Ray& ray, const Hit& hit, double width_m,
                           Filtering filtering) const noexcept {
  if (hit.object != 0) {
    const ModelPoint at = model_point(objects, ray, hit, width_m);
    glm::dvec3 shading_normal =
        at.R_DO * at.model.shading_normal(hit.part, at.p_O, at.normal_O, at.patch_O, filtering);
    if (at.lean) shading_normal = glm::normalize(at.lean.leaning_normal(shading_normal));
    return {appearance_at(*this, ray, hit, at, filtering), shading_normal};
  }
  if (cover.empty()) return {of_material(terrain.material), glm::normalize(glm::dvec3(hit.normal))};
  const GroundCover::Point point = ground_point(*this, ray, hit);
  const SurfacePatch patch = surface_patch(width_m, ray.direction, point.normal);
  return {appearance_at(cover, point, patch, filtering),
          cover.shading_normal_at(point, patch, filtering)};
}

}  // namespace groundray
