#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/geometry/mesh.h"
#include "core/io/mesh_io.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// A mesh as read, and the numbers of omitted parts.
struct MeshFile {
  TriangleMesh mesh;          ///< in D; no levels
  Georeference georeference;  ///< as write_mesh wrote it; empty and zero if the file has none
  std::size_t dropped = 0;    ///< invalid polygons, and triangles without area
  std::size_t skipped = 0;    ///< points, lines and curved patches
  /// Bound of the rounding error of each coordinate if positions came as floats, including that of
  /// nodes' transforms; 0 if they came as doubles.
  double rounding_m = 0;
};

/// Reads the triangles of any .ply, .obj, .stl, .gltf or .glb, as doubles where the file has
/// doubles. Polygons are triangulated; materials and textures are ignored. glTF's axes (y up) are
/// rotated to D's, the inverse of write_glb, so a mesh from write_mesh is restored. Vertices are in
/// the order in which triangles first refer to them, and merged if their positions are equal.
/// @throws Error for other extensions, if the file cannot be read or has no triangle, or if its
///         origin is not a position.
MeshFile read_mesh(const std::filesystem::path& path);

/// A mesh with the vertices of its file.
struct StoredMesh : MeshFile {
  PointCloud vertices{};  ///< all properties of the vertices, including x, y and z
};

/// Reads a .ply as read_mesh does, but with all its vertices, used or not, in their order.
/// @throws Error as read_mesh, or stating a vertex without a finite position.
StoredMesh read_stored_mesh(const std::filesystem::path& path);

/// Decodes a .ply in memory as read_stored_mesh does; `name` identifies it in messages.
StoredMesh parse_stored_mesh(std::string_view bytes, const std::string& name);

}  // namespace groundray
