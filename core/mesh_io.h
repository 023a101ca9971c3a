#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "core/mesh.h"
#include "core/point_cloud.h"

namespace groundray {

/// Where D lies, for the header of a file.
struct Georeference {
  glm::dvec3 origin_w_m{0};  ///< D's origin in W
  std::string crs_name;      ///< W's coordinate reference system, for people; empty for none
  std::string crs_wkt;       ///< the same as WKT; empty for none
};

/// Writes a mesh in the form that the name's end asks for: .ply, .obj, .stl or .glb. Appears only
/// when whole.
/// @throws Error if the name ends otherwise, and as the function for that form.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const Georeference& georeference);

/// Writes a mesh as binary little-endian PLY: vertices as doubles in D, `georeference` in comments,
/// and for each face, if the mesh has levels, its level and a colour for that.
/// @throws Error as write_whole; or if an index, the number of levels or a position is not valid.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// What else is known of a mesh: a row for each vertex and for each triangle, in their order; a
/// table without columns may have any number of rows.
struct MeshColumns {
  PointCloud vertices{}, triangles{};
};

/// As above, with a property more for each column.
/// @throws Error likewise; or if a table is not of the mesh's length, or a name is not visible
///         ASCII or taken already.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference, const MeshColumns& columns);

/// Writes a mesh as Wavefront OBJ: vertices in D with as many digits as give the same doubles back,
/// `georeference` in comments. Levels are left out.
/// @throws Error as write_ply.
void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as binary STL: corners of triangles in D, rounded to float. The header is
/// `origin_w X Y Z`, metres; it has no room for names of the CRS. Levels are left out.
/// @throws Error as write_ply; or if the origin takes more than the header's 80 characters, or
///         there are 2^32 triangles or more.
/// @see 3D Systems, StereoLithography Interface Specification (1988).
void write_stl(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as binary glTF 2.0: vertices in D rounded to float, under a node that turns D's
/// axes to glTF's (y up), `georeference` in the scene's extras. Levels are left out.
/// @throws Error as write_ply; or if the mesh has no triangle or needs more than 4 GiB, which glTF
///         cannot hold.
/// @see Khronos Group, glTF 2.0 Specification (2021): sections 3.4 and 4.4.
void write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// A mesh as read, and what was left out.
struct MeshFile {
  TriangleMesh mesh;          ///< in D; no levels
  Georeference georeference;  ///< as write_mesh wrote it; of a file without, nothing and zero
  std::size_t dropped = 0;    ///< polygons and triangles that are broken or have no area
  std::size_t skipped = 0;    ///< points, lines and curved patches
  /// Positions may differ by this much along each axis from those that the file means, for nodes
  /// moved floats; 0 where positions are as the file spells them.
  double rounding_m = 0;
};

/// Reads the triangles of a .ply, .obj, .stl, .gltf or .glb, whoever wrote it, in doubles where the
/// file has doubles. Polygons are cut into triangles; what a mesh wears is not looked at. glTF's
/// axes (y up) are turned to D's as write_glb turns them: what write_mesh wrote comes back.
/// Vertices are in the order in which triangles first name them, and joined where they are at one
/// place.
/// @throws Error if the name ends otherwise, the file cannot be read or holds no triangle, or what
///         it says of its origin is no position.
MeshFile read_mesh(const std::filesystem::path& path);

/// A mesh as its file has it.
struct StoredMesh : MeshFile {
  PointCloud vertices{};  ///< all that the file says of them, x, y and z as well
};

/// Reads a .ply as read_mesh, but with all its vertices, used or not, in their order.
/// @throws Error as read_mesh, or naming a vertex that has no finite position.
StoredMesh read_stored_mesh(const std::filesystem::path& path);

/// As read_stored_mesh, of bytes already in memory; `name` stands for the file in messages.
StoredMesh parse_stored_mesh(std::string_view bytes, const std::string& name);

}  // namespace groundray
