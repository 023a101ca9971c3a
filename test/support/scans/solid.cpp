#include "test/support/scans/solid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <utility>

namespace groundray::testing {
namespace {

Model model_of(TriangleMesh mesh) {
  Model model;
  model.surface_of.assign(mesh.triangles.size(), 0);
  model.mesh = std::move(mesh);
  model.surfaces.resize(1);
  return model;
}

}  // namespace

Model box_model(const glm::dvec3& sides_m) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices_m.push_back(
        glm::dvec3((k & 1) - 0.5, ((k >> 1) & 1) - 0.5, ((k >> 2) & 1) - 0.5) * sides_m);
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return model_of(std::move(mesh));
}

Model icosphere(double radius_m, int splits) {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<unsigned, unsigned>, unsigned> middles;
    const auto middle = [&](unsigned a, unsigned b) {
      const auto [place, fresh] = middles.try_emplace(
          std::pair(std::min(a, b), std::max(a, b)), static_cast<unsigned>(mesh.vertices_m.size()));
      if (fresh)
        mesh.vertices_m.push_back(glm::normalize(mesh.vertices_m[a]) +
                                  glm::normalize(mesh.vertices_m[b]));
      return place->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& t : mesh.triangles) {
      const unsigned a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
      finer.insert(finer.end(), {{t.x, a, c}, {t.y, b, a}, {t.z, c, b}, {a, b, c}});
    }
    mesh.triangles = std::move(finer);
  }
  for (glm::dvec3& vertex_m : mesh.vertices_m) vertex_m = radius_m * glm::normalize(vertex_m);
  return model_of(std::move(mesh));
}

Model cylinder(double radius_m, double height_m, int sides) {
  TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {0, 0, height_m}};
  const auto corner = [&](int k, int lid) {
    return static_cast<unsigned>(2 + 2 * (k % sides) + lid);
  };
  for (int k = 0; k < sides; ++k) {
    const double angle_rad = 2 * std::numbers::pi * k / sides;
    for (const double z_m : {0.0, height_m})
      mesh.vertices_m.emplace_back(radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad),
                                   z_m);
    mesh.triangles.insert(mesh.triangles.end(), {{0, corner(k + 1, 0), corner(k, 0)},
                                                 {1, corner(k, 1), corner(k + 1, 1)},
                                                 {corner(k, 0), corner(k + 1, 0), corner(k + 1, 1)},
                                                 {corner(k, 0), corner(k + 1, 1), corner(k, 1)}});
  }
  return model_of(std::move(mesh));
}

}  // namespace groundray::testing
