#include "core/model/model.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

/// Returns the index of the first element that breaks a rule, or the number of elements.
template <typename T, typename Rule>
std::size_t first_breach(const std::vector<T>& all, const Rule& holds) {
  return static_cast<std::size_t>(std::ranges::find_if_not(all, holds) - all.begin());
}

}  // namespace

void check_model(const Model& model, const std::string& name) {
  const TriangleMesh& mesh = model.mesh;
  const auto& uv = model.uv;
  const auto& normals = model.normals;
  const auto& surface_of = model.surface_of;
  const auto& surfaces = model.surfaces;
  const std::size_t vertices = mesh.vertices_m.size(), triangles = mesh.triangles.size();
  constexpr double most_m = 1e9;  // as for objects
  const std::size_t bad_vertex =
      first_breach(mesh.vertices_m, [](const glm::dvec3& p) { return glm::length(p) <= most_m; });
  const std::size_t bad_triangle = first_breach(mesh.triangles, [&](const glm::uvec3& t) {
    return std::max({t.x, t.y, t.z}) < vertices;
  });
  const std::size_t bad_uv =
      first_breach(uv, [](const glm::vec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  const std::size_t bad_normal = first_breach(
      normals, [](const glm::vec3& n) { return std::abs(glm::length(n) - 1) <= 1e-3f; });
  const std::size_t bad_surface =
      first_breach(surface_of, [&](std::uint16_t s) { return s < surfaces.size(); });
  Violations broken(name);
  broken.unless(triangles > 0, "there is no triangle");
  broken.unless(!surfaces.empty(), "there is no surface");
  broken.unless(mesh.levels.empty(), "a model must not have levels");
  broken.unless(
      bad_vertex == vertices,
      "vertex {} must have a finite position within {:.0e} m of the origin: is it in metres?",
      bad_vertex, most_m);
  broken.unless(bad_triangle == triangles, "triangle {} refers to a vertex beyond the last of {}",
                bad_triangle, vertices);
  broken.unless(uv.empty() || uv.size() == vertices, "there are {} uv for {} vertices", uv.size(),
                vertices);
  broken.unless(bad_uv == uv.size(), "vertex {} must have finite uv", bad_uv);
  broken.unless(normals.empty() || normals.size() == vertices,
                "there are {} normals for {} vertices", normals.size(), vertices);
  broken.unless(bad_normal == normals.size(), "vertex {} must have a normal of length 1",
                bad_normal);
  broken.unless(surface_of.size() == triangles, "there are {} surfaces for {} triangles",
                surface_of.size(), triangles);
  broken.unless(bad_surface == surface_of.size(),
                "triangle {} refers to a surface beyond the last of {}", bad_surface,
                surfaces.size());
  broken.throw_if_any();
}

ModelBounds bounds_of(const TriangleMesh& mesh) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  ModelBounds bounds{glm::dvec3(infinity), glm::dvec3(-infinity)};
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      bounds.low_m = glm::min(bounds.low_m, mesh.vertices_m[t[k]]);
      bounds.high_m = glm::max(bounds.high_m, mesh.vertices_m[t[k]]);
    }
  }
  return bounds;
}

}  // namespace groundray
