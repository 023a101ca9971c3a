#pragma once

// Data of a model for queries in double precision, and its Embree scene.

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "core/appearance/texture.h"
#include "core/geometry/corner_stars.h"
#include "core/tracing/embree_adapter.h"
#include "core/tracing/float_cut_out.h"
#include "core/tracing/object_tracer.h"

namespace groundray {

/// A ray in O. t counts metres in D, so the length of `direction` is 1 / scale.
struct ModelRay {
  glm::dvec3 origin{0};
  glm::dvec3 direction{0};
};

/// Intersection of a ray with a model.
struct ModelCrossing {
  double t_m = std::numeric_limits<double>::infinity();  ///< infinite for a miss
  std::uint32_t triangle = 0;
  explicit operator bool() const noexcept { return t_m < std::numeric_limits<double>::infinity(); }
  /// Orders by distance; of equally distant triangles, the first comes first.
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
    float least_alpha = 0;  // the surface is cut out where alpha is less; 0 for nowhere
    glm::vec3 mean{0};      // of albedo, by area, over all triangles with this surface
    const Texture& cut_by() const noexcept { return opacity ? *opacity : *albedo; }
  };
  std::vector<Textures> textures;  // by surface
  CornerStars stars;
  std::vector<std::uint32_t> solid, cut;  // triangles by primitive: without and with cut-outs
  FloatCutOuts cut_outs;                  // of `cut`
  glm::dvec3 low_m{0}, high_m{0};         // bounding box of all triangles
  glm::dvec3 centre_m{0};                 // its centre: the origin of the scene's float coordinates
  double radius_m = 0;                    // of a ball round O's origin that contains the box
  float slack_m = 0;                      // bound of rounding to float
  Owned<RTCScene> scene;

  const Textures& textures_of(std::uint32_t triangle) const noexcept {
    return textures[model.surface_of[triangle]];
  }
  std::uint32_t triangle_of(unsigned geometry, unsigned primitive) const noexcept {
    return geometry == 0 ? solid[primitive] : cut[primitive];
  }

  /// Returns edge functions, whose signs state on which side of each edge the line passes; edge k
  /// runs from corner k to the next. Triangles that share an edge get the same numbers except for
  /// the sign, so no line passes between them.
  glm::dvec3 edges_of(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  /// Returns the range at which the ray intersects the plane of a triangle.
  double range_m(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  glm::dvec3 normal(std::uint32_t triangle) const noexcept;  // not normalised
  /// Returns the barycentric coordinates of a point, from its edge functions.
  glm::dvec3 shares(const glm::dvec3& edges) const noexcept {
    return glm::dvec3(edges.y, edges.z, edges.x) / (edges.x + edges.y + edges.z);
  }
  glm::dvec2 uv_at(std::uint32_t triangle, const glm::dvec3& shares) const noexcept {
    const glm::uvec3& corners = model.mesh.triangles[triangle];
    return glm::dvec2(model.uv[corners.x]) * shares.x + glm::dvec2(model.uv[corners.y]) * shares.y +
           glm::dvec2(model.uv[corners.z]) * shares.z;
  }
  bool is_opaque(std::uint32_t triangle, const glm::dvec3& shares) const noexcept;

  /// Intersects a ray in double with a triangle that Embree reported, and that has no cut-out
  /// there: a miss if the ray passes beside it or starts behind it. Several triangles may be hit
  /// there at once, because all their corners coincide or the ray hits a shared edge or corner. The
  /// nearest then counts and, of equally distant ones, the first, as in exact tracing.
  ModelCrossing intersect(std::uint32_t triangle, const ModelRay& ray) const noexcept;
  /// Intersects a ray with the triangles that share a corner with one that Embree reported.
  ModelCrossing meet_beside(std::uint32_t triangle, const ModelRay& ray) const noexcept;

  void find_means();  // of albedo images
};

/// Returns true if a line passes inside all three edges of a triangle, or on them.
inline bool is_inside(const glm::dvec3& edges) noexcept {
  return (edges.x >= 0 && edges.y >= 0 && edges.z >= 0 && edges.x + edges.y + edges.z > 0) ||
         (edges.x <= 0 && edges.y <= 0 && edges.z <= 0 && edges.x + edges.y + edges.z < 0);
}

/// Double-precision data of rays in a model's scene, by lane: read by callbacks and, in exact
/// tracing, written by them.
struct ModelQuery {
  QueryContext context;             ///< first, so that Embree's pointer to it is a pointer to this
  const ModelRay* rays = nullptr;   ///< for exact tracing, and for models with cut-outs
  const double* enter_m = nullptr;  ///< start of the float rays; for exact tracing
  ModelCrossing* crossings = nullptr;  ///< nearest so far; for exact tracing
};

}  // namespace groundray
