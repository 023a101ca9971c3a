#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>

#include "core/geometry/mesh.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Position of D, for the header of a file.
struct Georeference {
  glm::dvec3 origin_w_m{0};  ///< D's origin in W
  std::string crs_name;      ///< name of W's coordinate reference system; empty for none
  std::string crs_wkt;       ///< the same as WKT; empty for none
};

/// Writes a mesh in the format of the file extension: .ply, .obj, .stl or .glb, in lower case. The
/// file appears only when complete.
/// @throws Error for other extensions, and as the function for the format.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const Georeference& georeference);

/// Additional data of a mesh: a row for each vertex and for each triangle, in their order. A table
/// without columns may have any number of rows.
struct MeshColumns {
  PointCloud vertices{}, triangles{};
};

/// Writes a mesh as binary little-endian PLY: vertices as doubles in D, `georeference` in comments
/// and, if the mesh has levels, the level of each face and a colour for it; and a property for each
/// column.
/// @throws Error as write_whole; if an index, the number of levels or a position is invalid; or if
///         a table's length differs from the mesh's, or a name is not visible ASCII or in use.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference, const MeshColumns& columns = {});

/// Writes a mesh as Wavefront OBJ: vertices in D with enough digits to restore the doubles,
/// `georeference` in comments. Levels are omitted.
/// @throws Error as write_ply.
void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as binary STL: corners of triangles in D, rounded to float. The header is
/// `origin_w X Y Z`, metres; it has no space for the CRS. Levels are omitted.
/// @throws Error as write_ply; or if the origin takes more than the header's 80 characters, or
///         there are 2^32 triangles or more.
/// @see 3D Systems, StereoLithography Interface Specification (1988).
void write_stl(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as binary glTF 2.0: vertices in D rounded to float, under a node that rotates D's
/// axes to glTF's (y up), `georeference` in the scene's extras. Levels are omitted.
/// @throws Error as write_ply; or if the mesh has no triangle or needs more than 4 GiB, which glTF
///         does not support.
/// @see Khronos Group, glTF 2.0 Specification (2021): sections 3.4 and 4.4.
void write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

}  // namespace groundray
