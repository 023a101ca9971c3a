#include "sensors/camera/emitters.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>

#include "core/error.h"
#include "core/geometry/corner_stars.h"
#include "core/image/luminance.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

void check_emitters(const Scene& scene) {
  const auto materials = scene.materials.all();
  Violations broken("light");
  const auto exists = [&](const std::string& whose, std::size_t material) {
    broken.unless(material < materials.size(), "{} has material {}, but the scene has {} materials",
                  whose, material, materials.size());
    return material < materials.size();
  };
  const auto check_ground = [&](const std::string& whose, std::size_t material) {
    if (!exists(whose, material)) return;
    broken.unless(
        materials[material].emitted == glm::dvec3(0),
        "{} has material '{}', which emits light, but only objects can: place one on the ground",
        whose, materials[material].name);
  };
  if (scene.cover.empty()) check_ground("the ground", scene.terrain.material);
  for (std::size_t i = 0; i < scene.cover.layers().size(); ++i)
    check_ground(fmt::format("layer {} of the ground", i), scene.cover.layers()[i].material);
  const auto models = scene.objects.models();
  for (std::size_t m = 0; m < models.size(); ++m) {
    for (std::size_t s = 0; s < models[m].model().surfaces.size(); ++s) {
      const bool is_known = m < scene.models.size() && s < scene.models[m].materials.size();
      broken.unless(is_known, "surface {} of model {} has no material", s, m);
      if (is_known)
        exists(fmt::format("surface {} of model {}", s, m), scene.models[m].materials[s]);
    }
  }
  broken.throw_if_any();
}

bool may_be_cut_out(const ModelSurface& surface) {
  return surface.least_alpha > 0 && (surface.albedo.exists() || surface.opacity.exists());
}

// True for the first of the triangles with the same corners, which is the only one sampled.
bool is_first_twin(const CornerStars& stars, std::uint32_t triangle) {
  for (std::uint32_t i = stars.next_twin(triangle); i != triangle; i = stars.next_twin(i)) {
    if (i < triangle) return false;
  }
  return true;
}

// First corner of a triangle, and the edges from it to the others.
struct Corner {
  glm::dvec3 at, a, b;
  Corner(const TriangleMesh& mesh, std::uint32_t triangle) {
    const glm::uvec3& t = mesh.triangles[triangle];
    at = mesh.vertices_m[t.x];
    a = mesh.vertices_m[t.y] - at;
    b = mesh.vertices_m[t.z] - at;
  }
};

// Maps the unit square to barycentric coordinates; preserves areas and adjacency.
// @see Heitz, A low-distortion map between triangle and square (2019).
glm::dvec2 on_triangle(const glm::dvec2& u) {
  return u.y > u.x ? glm::dvec2(u.x / 2, u.y - u.x / 2) : glm::dvec2(u.x - u.y / 2, u.y / 2);
}

// Returns the index of the first entry whose running sum exceeds the fraction `uniform` of the
// total.
template <typename Sums, typename Sum>
auto pick(const Sums& all, double uniform, const Sum& sum) {
  const double target = uniform * sum(all.back());
  const auto after = std::ranges::upper_bound(all, target, {}, sum);
  return std::min(after, all.end() - 1) - all.begin();
}

}  // namespace

Emitters::Emitters(const Scene& scene) : objects_(scene.objects) {
  check_emitters(scene);
  const std::size_t models = objects_.models().size();
  glows_.resize(models);
  shapes_.resize(models);
  for (std::size_t m = 0; m < models; ++m) find_shape(m, scene.models, scene.materials);
  double power = 0;
  for (std::uint32_t number = 1; any_shines_ && number <= objects_.size(); ++number) {
    const auto [p_DO, R_DO, scale, model] = objects_.placed_at(number, nanoseconds(0));
    const Shape& shape = shapes_[model];
    if (shape.triangles.empty()) continue;
    power += scale * scale * shape.power_until.back();
    sources_.push_back({number, power});
  }
  for (std::vector<Glow>& surfaces : glows_) {
    for (Glow& glow : surfaces) {
      if (glow.pdf_per_m2 > 0 && power > 0) glow.pdf_per_m2 /= power;
    }
  }
}

// Stores the luminance as density; the constructor divides it by the total when that is known.
void Emitters::find_shape(std::size_t model, const std::vector<ModelTruth>& truths,
                          const Materials& materials) {
  const Model& shape = objects_.models()[model].model();
  std::vector<Glow>& glows = glows_[model];
  bool any = false;
  for (std::size_t s = 0; s < shape.surfaces.size(); ++s) {
    const Material& material = materials.all()[truths[model].materials[s]];
    glows.push_back({material.emitted, 0});
    if (material.emitted == glm::dvec3(0)) continue;
    any_shines_ = true;
    if (may_be_cut_out(shape.surfaces[s])) continue;
    glows.back().pdf_per_m2 = luminance(material.emitted);
    any = true;
  }
  if (!any) return;
  const CornerStars stars(shape.mesh);
  double power = 0;
  for (std::uint32_t i = 0; i < shape.mesh.triangles.size(); ++i) {
    const Corner corner(shape.mesh, i);
    const double area_m2 = glm::length(glm::cross(corner.a, corner.b)) / 2;
    const double more = area_m2 * glows[shape.surface_of[i]].pdf_per_m2;
    if (!(more > 0) || !is_first_twin(stars, i)) continue;
    power += more;
    shapes_[model].triangles.push_back(i);
    shapes_[model].power_until.push_back(power);
  }
}

Emitters::Glow Emitters::glow_of(const Hit& hit) const noexcept {
  if (hit.object == 0 || !any_shines_) return {};
  const std::uint32_t model = objects_.model_of(hit.object);
  return glows_[model][objects_.models()[model].model().surface_of[hit.part]];
}

Emitters::Point Emitters::draw(const glm::dvec2& which, const glm::dvec2& where,
                               nanoseconds time) const noexcept {
  const Source& source = sources_[static_cast<std::size_t>(
      pick(sources_, which.x, [](const Source& each) { return each.power_until; }))];
  const auto [p_DO, R_DO, scale, model] = objects_.placed_at(source.number, time);
  const Shape& shape = shapes_[model];
  const std::uint32_t triangle = shape.triangles[static_cast<std::size_t>(
      pick(shape.power_until, which.y, [](double sum) { return sum; }))];
  const Model& surface = objects_.models()[model].model();
  const Corner corner(surface.mesh, triangle);
  const glm::dvec2 at = on_triangle(where);
  return {p_DO + R_DO * (scale * (corner.at + at.x * corner.a + at.y * corner.b)),
          R_DO * glm::normalize(glm::cross(corner.a, corner.b)),
          glows_[model][surface.surface_of[triangle]]};
}

}  // namespace groundray
