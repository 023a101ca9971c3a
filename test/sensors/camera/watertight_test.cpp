// Camera rays aimed at edges and vertices of surfaces: no ray slips between facets.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "test/support/scans/camera_scene.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::watertight_test {
namespace {

using groundray::testing::plane_ground;
using groundray::testing::proof_size;
using groundray::testing::scene_of;

constexpr int cells = 64;  // along each side of the plane
constexpr double side_m = 16;
const glm::dvec3 eye(3.3, -1.7, 7.9);

enum class Aim { Edges, EdgesAndVertices };

// Point on the plane at which a ray is aimed: on an edge along either side, on a diagonal, or at a
// vertex. Steps of the vertices are binary fractions, so floats represent them exactly.
glm::dvec3 place(Aim aim, std::size_t ray) {
  const std::size_t kinds = aim == Aim::Edges ? 3 : 4, kind = ray % kinds;
  constexpr std::size_t all_cells = std::size_t{cells} * cells;
  const std::size_t cell = ray / kinds % all_cells, turn = ray / kinds / all_cells;
  const std::size_t column = cell % cells, row = cell / cells;
  const double step_m = side_m / cells;
  const double x = static_cast<double>(column), y = static_cast<double>(row);
  // Multiples of the golden ratio fill the edge evenly.
  const double golden = 0.6180339887498949 * static_cast<double>(turn + 1);
  const double along = golden - std::floor(golden);
  const glm::dvec2 at = kind == 0   ? glm::dvec2(x + along, y + 1)
                        : kind == 1 ? glm::dvec2(x + 1, y + along)
                        : kind == 2 ? glm::dvec2(x + along, y + 1 - along)
                                    : glm::dvec2(x + 1, y + 1);
  return {at * step_m - side_m / 2, 0};
}

// Number of rays to such points that miss the surface there. `object` is the expected hit.
std::size_t leaks(const Scene& scene, const glm::dvec3& normal, std::uint32_t object, Aim aim,
                  std::size_t count) {
  constexpr std::size_t batch = 4096;
  std::atomic<std::size_t> sum = 0;
  tbb::parallel_for(std::size_t{0}, (count + batch - 1) / batch, [&](std::size_t number) {
    std::vector<Ray> rays;
    for (std::size_t i = number * batch; i < std::min(count, (number + 1) * batch); ++i) {
      glm::dvec3 p = place(aim, i);
      p.z = -(normal.x * p.x + normal.y * p.y) / normal.z;
      rays.push_back({eye, glm::normalize(p - eye)});
    }
    std::vector<Hit> hits(rays.size());
    scene.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double range_m = -glm::dot(normal, eye) / glm::dot(normal, rays[i].direction);
      const bool is_met =
          hits[i].object == object && std::abs(hits[i].range_m - range_m) <= 1e-9 * range_m + 1e-9;
      sum += !is_met;
    }
  });
  return sum;
}

// The plane n p = 0 over the square and some cells beyond it, so that no ray is aimed at its
// boundary.
HeightGrid plane_grid(const glm::dvec3& normal) {
  constexpr int samples = cells + 3;
  const double step_m = side_m / cells, first_m = -side_m / 2 - step_m;
  std::vector<float> heights_m;
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column)
      heights_m.push_back(static_cast<float>(
          -(normal.x * (first_m + column * step_m) + normal.y * (first_m + row * step_m)) /
          normal.z));
  }
  return {{samples, samples}, {first_m, first_m}, {step_m, step_m}, std::move(heights_m)};
}

Model plane_model(const glm::dvec3& normal) {
  const HeightGrid grid = plane_grid(normal);
  constexpr unsigned samples = cells + 3;
  const double step_m = side_m / cells, first_m = -side_m / 2 - step_m;
  Model model;
  for (unsigned i = 0; i < samples * samples; ++i) {
    const unsigned column = i % samples, row = i / samples;
    model.mesh.vertices_m.emplace_back(first_m + column * step_m, first_m + row * step_m,
                                       grid.heights_m()[i]);
  }
  for (unsigned row = 0; row + 1 < samples; ++row) {
    for (unsigned column = 0; column + 1 < samples; ++column) {
      const unsigned a = row * samples + column, b = a + 1, c = a + samples, d = c + 1;
      model.mesh.triangles.emplace_back(a, b, c);
      model.mesh.triangles.emplace_back(b, d, c);
    }
  }
  model.surface_of.resize(model.mesh.triangles.size());
  model.surfaces.resize(1);
  return model;
}

// A million rays in total, 10^8 in a proof run.
std::size_t rays_each() { return proof_size(125'000, 12'500'000); }

TEST(WatertightProof, NoRayPassesThroughEdgesOrVerticesOfTheGround) {
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    for (const glm::dvec3& normal : {glm::dvec3(0, 0, 1), glm::dvec3(-0.25, 0.5, 1)}) {
      const Scene scene = scene_of(plane_grid(normal), {}, {}, {}, tracing);
      EXPECT_EQ(leaks(scene, normal, 0, Aim::EdgesAndVertices, rays_each()), 0u);
    }
  }
}

TEST(WatertightProof, NoRayPassesThroughEdgesOrVerticesOfObjects) {
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    for (const glm::dvec3& normal : {glm::dvec3(0, 0, 1), glm::dvec3(-0.25, 0.5, 1)}) {
      const Scene scene =
          scene_of(plane_ground(0, 0, -50), {plane_model(normal)}, {{}}, {}, tracing);
      EXPECT_EQ(leaks(scene, normal, 1, Aim::EdgesAndVertices, rays_each()), 0u);
    }
  }
}

}  // namespace
}  // namespace groundray::watertight_test
