#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/image/image.h"

namespace groundray {

/// An image of a model: a file, or pixels from within the model's file.
struct ModelImage {
  std::filesystem::path file;  ///< empty if there is no image, or if `pixels` has it
  Image8 pixels;
  bool exists() const { return !file.empty() || pixels.width() > 0; }
};

/// A surface of a model, with the name from its file.
struct ModelSurface {
  std::string name;
  glm::vec3 color{1};  ///< linear sRGB, multiplies `albedo`
  ModelImage albedo;   ///< sRGB; its alpha, if any, cuts the surface out
  ModelImage normal;   ///< tangent space, OpenGL's convention: green points along increasing v
  ModelImage opacity;  ///< its alpha, or else its first channel, replaces albedo's alpha
  float least_alpha = 0.5f;  ///< the surface is cut out where alpha is less; 0 for nowhere
};

/// Shape of an object in its own frame O (x forward, y left, z up), metres, with the data for its
/// textures.
struct Model {
  TriangleMesh mesh;                      ///< positions in O; no levels
  std::vector<glm::vec2> uv;              ///< by vertex, v up from the image's last row; or empty
  std::vector<glm::vec3> normals;         ///< by vertex, unit, for shading; or empty
  std::vector<std::uint16_t> surface_of;  ///< by triangle, index in `surfaces`
  std::vector<ModelSurface> surfaces;     ///< at least one
};

/// @throws Error, beginning with `name`, listing every rule that the model breaks: there is a
///         triangle and a surface; indices of vertices and surfaces are valid; positions are finite
///         and within 1e9 m of the origin; uv are finite and normals unit to 1e-3, one for each
///         vertex or none; every triangle has a surface; and there are no levels.
void check_model(const Model& model, const std::string& name);

/// An axis-aligned box; if empty, `low_m` exceeds `high_m`.
struct ModelBounds {
  glm::dvec3 low_m, high_m;
};

/// Returns the bounding box of the vertices that triangles of the mesh use, in its frame.
ModelBounds bounds_of(const TriangleMesh& mesh);

}  // namespace groundray
