#pragma once

#include <string>
#include <string_view>

#include "core/model/polygon_soup.h"

namespace groundray {

/// Reads the faces of a PLY file and their vertices. Properties of vertices: x, y, z; nx, ny, nz;
/// s, t or u, v or texture_u, texture_v. Lists of faces: vertex_indices or vertex_index, and
/// texcoord, which takes precedence over the vertices' uv. The comment TextureFile names the albedo
/// image.
/// @param name  file name in error messages.
/// @throws Error as parse_ply, if the file is truncated, or if it has triangle strips.
/// @see Turk, The PLY polygon file format (1994).
PolygonSoup parse_ply_faces(std::string_view bytes, const std::string& name);

}  // namespace groundray
