#pragma once

#include <filesystem>

#include "core/model/polygon_soup.h"

namespace groundray {

/// Formats that are read by assimp.
enum class SceneForm { Stl, Gltf, Collada };

/// Reads the polygons of a scene file, in its own axes and, except for Collada, its own units:
/// assimp converts Collada to metres, with the unit as a float. Transforms of nodes are applied in
/// double.
/// @throws Error if assimp cannot read the file, or an image inside it cannot be decoded.
PolygonSoup read_scene_file(const std::filesystem::path& path, SceneForm form);

}  // namespace groundray
