#pragma once

// A model as double arithmetic looks things up, and its scene.

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "core/corner_stars.h"
#include "core/embree_adapter.h"
#include "core/object_tracer.h"
#include "core/texture.h"

namespace groundray {

/// A ray in O: t counts metres in D, so that `direction` is 1 / scale long.
struct ModelRay {
  glm::dvec3 origin{0};
  glm::dvec3 direction{0};
};

/// Where a ray meets a model.
struct ModelCrossing {
  double t_m = std::numeric_limits<double>::infinity();
  std::uint32_t triangle = 0;
};

struct ModelScene::Impl {
  Impl(const RayDevice& with, Model content, Tracing how);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  RayDevice device;
  Model model;
  Tracing tracing = Tracing::Fast;
  struct Textures {
    std::optional<Texture> albedo, normal, opacity;
    float least_alpha = 0;  // below it the surface is cut out; 0 for nowhere
    glm::vec3 mean{0};      // of albedo over all triangles that wear it
  };
  std::vector<Textures> textures;  // by surface
  CornerStars stars;
  std::vector<std::uint32_t> solid, cut;  // triangles by primitive: without and with an alpha
  glm::dvec3 low_m{0}, high_m{0};         // their box
  glm::dvec3 centre_m{0};                 // of it: the origin of the scene's floats
  double radius_m = 0;                    // of a ball round O that holds it
  float slack_m = 0;                      // covers rounding to floats
  RTCScene scene = nullptr;

  const Textures& textures_of(std::uint32_t triangle) const noexcept {
    return textures[model.surface_of[triangle]];
  }
  std::uint32_t triangle_of(unsigned geometry, unsigned primitive) const noexcept {
    return geometry == 0 ? solid[primitive] : cut[primitive];
  }

  /// Decides by sign which side of each edge a line passes: edge k runs from corner k to the next.
  /// Triangles that share an edge get the same numbers but for the sign, so no line slips between.
  glm::dvec3 edges_of(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  /// Where the ray meets the plane of a triangle.
  double range_m(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  glm::dvec3 normal(std::uint32_t triangle) const noexcept;  // not of unit length
  /// The corners' shares of a point in the plane of a triangle.
  glm::dvec3 shares(const glm::dvec3& edges) const noexcept {
    return glm::dvec3(edges.y, edges.z, edges.x) / (edges.x + edges.y + edges.z);
  }
  glm::dvec2 uv_at(std::uint32_t triangle, const glm::dvec3& shares) const noexcept {
    const glm::uvec3& corners = model.mesh.triangles[triangle];
    return glm::dvec2(model.uv[corners.x]) * shares.x + glm::dvec2(model.uv[corners.y]) * shares.y +
           glm::dvec2(model.uv[corners.z]) * shares.z;
  }
  bool is_opaque(std::uint32_t triangle, const glm::dvec3& shares) const noexcept;

  /// Finds in double where a ray meets the surface by a triangle that Embree named: that one, or
  /// the nearest of those that share a corner with it. Nothing if it passes them all by, begins
  /// behind them, or goes through where they are cut out.
  std::optional<ModelCrossing> settle(std::uint32_t triangle, const ModelRay& ray) const noexcept;

  void find_means();  // of albedo images

 private:
  std::optional<double> meet(std::uint32_t triangle, const ModelRay& ray) const noexcept;
};

/// Whether a line passes inside all three edges of a triangle.
inline bool is_inside(const glm::dvec3& edges) noexcept {
  return (edges.x >= 0 && edges.y >= 0 && edges.z >= 0 && edges.x + edges.y + edges.z > 0) ||
         (edges.x <= 0 && edges.y <= 0 && edges.z <= 0 && edges.x + edges.y + edges.z < 0);
}

/// The double side of rays in a model's scene: what exact tracing reads and fills, by lane.
struct ModelQuery {
  QueryContext context;  ///< first, so that Embree's pointer to it is a pointer to this
  const ModelRay* rays = nullptr;
  const double* enter_m = nullptr;     ///< where the float rays begin
  ModelCrossing* crossings = nullptr;  ///< so far
};

}  // namespace groundray
