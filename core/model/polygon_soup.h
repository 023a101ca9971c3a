#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/model/model_io.h"

namespace groundray {

/// Polygons exactly as a file states them; nothing is checked yet.
struct PolygonSoup {
  static constexpr std::uint32_t none = 0xffffffff;

  struct Corner {
    std::uint32_t position = none, uv = none, normal = none;
  };
  /// Corners [first, first + count).
  struct Polygon {
    std::size_t first = 0, count = 0;
    std::uint32_t surface = 0;
  };
  /// Surface whose images are still names, as written in the file; empty for none.
  struct Surface {
    ModelSurface looks;
    std::string albedo, normal, opacity;
  };

  std::vector<glm::dvec3> positions;
  std::vector<glm::vec2> uv;
  std::vector<glm::vec3> normals;
  std::vector<Corner> corners;
  std::vector<Polygon> polygons;
  std::vector<Surface> surfaces;
  std::size_t skipped = 0;  ///< number of points, lines and curved patches
  std::size_t faces = 0;    ///< polygons of all meshes, without repeated instances
  std::size_t omitted = 0;  ///< polygons of the file that are not here: their indices are invalid
  double rounding = 0;  ///< bound of the error of a position's coordinates that is due to floats
};

/// Returns the linear value of an sRGB-encoded colour; components are clamped to 0 to 1.
/// @see IEC 61966-2-1.
glm::vec3 linear_color(const glm::dvec3& encoded);

/// Returns the model without its surfaces' looks: polygons are triangulated, invalid ones are
/// omitted and counted, and equal vertices are merged. `surface_of` holds indices of the soup's
/// surfaces; there may be at most 2^16.
Model model_of(const PolygonSoup& soup, ModelFaults& faults);

/// Returns the mesh alone. Its vertices are all positions of the soup in their order, used or not;
/// polygons are triangulated and counted as by model_of.
TriangleMesh stored_mesh_of(const PolygonSoup& soup, ModelFaults& faults);

/// Reads Wavefront OBJ: v, vt, vn, f, usemtl and mtllib; l, p and curved patches are counted. Names
/// of materials and of .mtl files may contain " #": it begins a comment only if the full name does
/// not exist.
/// @param name      file name in error messages.
/// @param read_mtl  returns the text of the named .mtl file, or throws Error if there is none; the
///         line is added to its Errors.
/// @throws Error naming file, line and rule.
/// @see Wavefront, Advanced Visualizer, appendix B1: Object Files (.obj).
PolygonSoup parse_obj(std::string_view text, const std::string& name,
                      const std::function<std::string(const std::string&)>& read_mtl);

/// Reads the faces of a PLY file and their vertices. Properties of vertices: x, y, z; nx, ny, nz;
/// s, t or u, v or texture_u, texture_v. Lists of faces: vertex_indices or vertex_index, and
/// texcoord, which takes precedence over the vertices' uv. The comment TextureFile names the albedo
/// image.
/// @param name  file name in error messages.
/// @throws Error as parse_ply, if the file is truncated, or if it has triangle strips.
/// @see Turk, The PLY polygon file format (1994).
PolygonSoup parse_ply_faces(std::string_view bytes, const std::string& name);

/// Reads the triangles of a .stl through assimp.
/// @param bytes  of the file.
/// @throws Error if assimp cannot read the file.
PolygonSoup read_stl(const std::filesystem::path& path, std::string bytes);

/// Reads the polygons of a .gltf or .glb through assimp, in the file's axes, after check_gltf.
/// Transforms of nodes are applied in double. assimp omits triangles whose indices are out of range
/// and only logs this, so they are counted by comparison with the number in the file.
/// @param bytes  of the file.
/// @throws Error as check_gltf, or if an image inside the file cannot be decoded.
PolygonSoup read_gltf(const std::filesystem::path& path, std::string_view bytes);

/// A file that assimp reads without a crash.
struct CheckedGltf {
  std::string bytes;
  bool is_binary = false;     ///< a .glb
  std::size_t triangles = 0;  ///< declared
};

/// Checks a .gltf or .glb for faults on which assimp would crash or never return, or that it would
/// silently ignore, and removes what groundray does not use (animations, skins, cameras).
/// @param path  for messages, and to find files of buffers.
/// @throws Error if it is not JSON or is nested more than 100 deep; a chunk of the .glb exceeds the
///         file, a view exceeds its buffer, an accessor its view, or a buffer its file; an item
///         that is referred to does not exist; a name leads out of the folder; a node has itself as
///         a descendant, descendants nested more than 1000 deep, or more than 10^6 of them; an
///         accessor is sparse; or the meshes and their instances need more memory than there is.
CheckedGltf check_gltf(std::string_view bytes, const std::filesystem::path& path);

/// Returns the name of a file as a model writes it, with `/` and without percent codes, if it is in
/// the model's folder or below.
/// @throws Error if it leads out of the folder.
std::string name_beside(const std::string& written);

/// Returns the end of a message about a file without triangles.
/// @param dropped, skipped  numbers of broken polygons, and of points, lines and curved patches.
std::string why_empty(std::size_t dropped, std::size_t skipped);

}  // namespace groundray
