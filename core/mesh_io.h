#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>

#include "core/mesh.h"

namespace groundray {

/// Where D lies, for the header of a file.
struct Georeference {
  glm::dvec3 origin_w_m{0};  ///< D's origin in W
  std::string crs_name;      ///< W's coordinate reference system, for people; empty for none
  std::string crs_wkt;       ///< the same as WKT; empty for none
};

/// Writes a mesh in the form that the name's end asks for: .ply, .obj or .glb. Appears only when
/// whole.
/// @throws Error if the name ends otherwise, and as the function for that form.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const Georeference& georeference);

/// Writes a mesh as binary little-endian PLY: vertices as doubles in D, `georeference` in comments,
/// and for each face, if the mesh has levels, its level and a colour for that.
/// @throws Error as write_whole; or if an index, the number of levels or a position is not valid.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as Wavefront OBJ: vertices in D with as many digits as give the same doubles back,
/// `georeference` in comments. Levels are left out.
/// @throws Error as write_ply.
void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

/// Writes a mesh as binary glTF 2.0: vertices in D rounded to float, under a node that turns D's
/// axes to glTF's (y up), `georeference` in the scene's extras. Levels are left out.
/// @throws Error as write_ply; or if the mesh has no triangle or needs more than 4 GiB, which glTF
///         cannot hold.
/// @see Khronos Group, glTF 2.0 Specification (2021): sections 3.4 and 4.4.
void write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference);

}  // namespace groundray
