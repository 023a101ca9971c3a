#pragma once

#include <cstddef>
#include <filesystem>

#include "core/mesh_io.h"
#include "reconstruction/measured_mesh.h"

namespace groundray {

/// A measured mesh as read, and what was left out.
struct MeasuredMeshFile {
  MeasuredMesh mesh;          ///< in D
  Georeference georeference;  ///< of a file that groundray did not write, nothing and zero
  std::size_t dropped = 0;    ///< polygons and triangles that are broken or have no area
  std::size_t skipped = 0;    ///< points, lines and curved patches
  double rounding_m = 0;      ///< as MeshFile has it
};

/// Writes a measured mesh in the form that the name's end asks for, as write_mesh: .ply, .obj, .stl
/// or .glb. Only a .ply holds what is known of vertices, as columns `sd_m` (float, metres), `label`
/// (ushort) and `confidence` (float). The floats of an .stl or .glb are off by 0.25 mm at 4 km: of
/// a mesh that goes beyond that, D's origin is moved to the mesh by whole metres, in the file
/// alone.
/// @throws Error as write_mesh; or if there is not one value for each vertex or none, or one is out
///         of bounds.
void write_measured_mesh(const std::filesystem::path& path, const MeasuredMesh& mesh,
                         const Georeference& georeference);

/// Reads a measured mesh of any form that read_mesh reads, whoever wrote it. Of a .ply, vertices
/// are as stored, with what the columns `sd_m`, `label` and `confidence` say, of any type of
/// number; of others as read_mesh has them, so that triangles at one place share it.
/// @throws Error as read_mesh or read_stored_mesh; or naming the vertex if a standard deviation is
///         no length, a label not whole and within 0 to 65535, or a confidence not within 0 to 1.
MeasuredMeshFile read_measured_mesh(const std::filesystem::path& path);

}  // namespace groundray
