#pragma once

#include <string>
#include <string_view>

#include "core/polygon_soup.h"

namespace groundray {

/// Reads the faces of a PLY and their vertices: x, y, z; nx, ny, nz; s, t or u, v or texture_u,
/// texture_v; lists vertex_indices or vertex_index, and texcoord, which goes before the vertices'
/// uv; and the comment TextureFile.
/// @param name  stands for the file in messages.
/// @throws Error as parse_ply, or if the file is cut short.
/// @see Turk, The PLY polygon file format (1994).
PolygonSoup parse_ply_faces(std::string_view bytes, const std::string& name);

}  // namespace groundray
