#pragma once

#include <cstddef>
#include <filesystem>

#include "core/io/mesh_io.h"
#include "core/model/mesh_reader.h"
#include "reconstruction/mesh/measured_mesh.h"

namespace groundray {

/// Measured mesh as read from a file, and counts of omitted elements.
struct MeasuredMeshFile {
  MeasuredMesh mesh;          ///< in frame D
  Georeference georeference;  ///< empty, with origin zero, if groundray did not write the file
  std::size_t dropped = 0;    ///< polygons and triangles that are invalid or have no area
  std::size_t skipped = 0;    ///< points, lines and curved patches
  double rounding_m = 0;      ///< as MeshFile::rounding_m
};

/// Writes a measured mesh in the format given by the extension, as write_mesh: .ply, .obj, .stl or
/// .glb. Only .ply stores the attributes of vertices, as columns `sd_m` (float, metres), `label`
/// (ushort) and `confidence` (float). The single-precision positions of .stl and .glb are off by
/// 0.25 mm at 4 km. If the mesh extends beyond that, D's origin is moved to the mesh by whole
/// metres, in the file only.
/// @throws Error as write_mesh; or if an attribute does not have one value per vertex or none, or a
///         value is out of bounds.
void write_measured_mesh(const std::filesystem::path& path, const MeasuredMesh& mesh,
                         const Georeference& georeference);

/// Reads a measured mesh in any format that read_mesh reads, from any program. The vertices of a
/// .ply are kept as stored, with attributes from the columns `sd_m`, `label` and `confidence` of
/// any numeric type. Other formats are read as by read_mesh, so that triangles share vertices at
/// equal positions.
/// @throws Error as read_mesh or read_stored_mesh; or naming the vertex if a standard deviation is
///         negative or not finite, a label not whole and within 0 to 65535, or a confidence not
///         within 0 to 1.
MeasuredMeshFile read_measured_mesh(const std::filesystem::path& path);

}  // namespace groundray
