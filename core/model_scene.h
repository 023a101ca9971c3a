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
  double t_m = std::numeric_limits<double>::infinity();  ///< infinite if nowhere
  std::uint32_t triangle = 0;
  explicit operator bool() const noexcept { return t_m < std::numeric_limits<double>::infinity(); }
  /// Of triangles that are equally far the first counts.
  friend bool operator<(const ModelCrossing& a, const ModelCrossing& b) noexcept {
    return a.t_m < b.t_m || (a.t_m == b.t_m && a.triangle < b.triangle);
  }
};

struct ModelScene::Impl {
  Impl(const RayDevice& with, Model content, Tracing how);
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
  Owned<RTCScene> scene;

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

  /// Finds in double where a ray meets a triangle that Embree named: nowhere if it passes it by,
  /// begins behind it, or goes through where it is cut out. Of triangles that the ray meets there
  /// together, since all their corners are the same or it passes an edge or corner that they share,
  /// the nearest counts, and of those that are equally far the first, as in exact tracing.
  ModelCrossing meet(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  /// The same for the triangles that share a corner with one that Embree named.
  ModelCrossing meet_beside(std::uint32_t triangle, const ModelRay& ray) const noexcept;

  void find_means();  // of albedo images
};

/// Whether a line passes inside all three edges of a triangle.
inline bool is_inside(const glm::dvec3& edges) noexcept {
  return (edges.x >= 0 && edges.y >= 0 && edges.z >= 0 && edges.x + edges.y + edges.z > 0) ||
         (edges.x <= 0 && edges.y <= 0 && edges.z <= 0 && edges.x + edges.y + edges.z < 0);
}

/// The double side of rays in a model's scene, by lane: what callbacks read, and exact tracing
/// fills.
struct ModelQuery {
  QueryContext context;             ///< first, so that Embree's pointer to it is a pointer to this
  const ModelRay* rays = nullptr;   ///< of exact tracing, and of models that are cut out
  const double* enter_m = nullptr;  ///< where the float rays begin; exact tracing's
  ModelCrossing* crossings = nullptr;  ///< so far; exact tracing's
};

}  // namespace groundray
