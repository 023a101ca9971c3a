#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/mesh.h"

namespace groundray {

/// An image that a model wears: a file, or pixels that came with the model.
struct ModelImage {
  std::filesystem::path file;  ///< empty for none, or where `pixels` are the image
  Image8 pixels;
  bool exists() const { return !file.empty() || pixels.width() > 0; }
};

/// One kind of surface of a model, by the name that its file gives it.
struct ModelSurface {
  std::string name;
  glm::vec3 color{1};        ///< linear sRGB, multiplies `albedo`
  ModelImage albedo;         ///< sRGB; its alpha, if it has any, cuts the surface out
  ModelImage normal;         ///< tangent space, OpenGL's sense: green points along increasing v
  ModelImage opacity;        ///< its alpha, else its first channel, goes before albedo's alpha
  float least_alpha = 0.5f;  ///< the surface is cut out where its alpha is below; 0 for nowhere
};

/// The shape of an object in its own frame O (x forward, y left, z up), metres, and what textures
/// need to lie on it.
struct Model {
  TriangleMesh mesh;               ///< positions in O; no levels
  std::vector<glm::vec2> uv;       ///< of each vertex, v up from the image's last row; or empty
  std::vector<glm::vec3> normals;  ///< of each vertex, unit, for shading; or empty
  std::vector<std::uint16_t> surface_of;  ///< of each triangle, index among `surfaces`
  std::vector<ModelSurface> surfaces;     ///< at least one
};

/// @throws Error, with `name` at its head, naming every rule that the model breaks: there is a
///         triangle and a surface; vertices and surfaces that are named exist; positions are finite
///         and within 1e9 m of the origin; uv are finite and normals unit to 1e-3, one for each
///         vertex or none; every triangle has a surface; and there are no levels.
void check_model(const Model& model, const std::string& name);

/// A box along the axes; of nothing, `low_m` exceeds `high_m`.
struct ModelBounds {
  glm::dvec3 low_m, high_m;
};

/// Returns the least box round those vertices that a triangle of the mesh has, in its frame.
ModelBounds bounds_of(const TriangleMesh& mesh);

}  // namespace groundray
