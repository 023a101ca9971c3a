#pragma once

#include <filesystem>

#include "core/polygon_soup.h"

namespace groundray {

/// The forms that assimp reads for us.
enum class SceneForm { Stl, Gltf, Collada };

/// Reads what a scene's file says of polygons, in its own axes and, but for Collada, its own units:
/// assimp turns those to metres, with the unit as a float. Nodes' transforms are applied in double.
/// @throws Error if assimp cannot read the file, or an image inside it cannot be decoded.
PolygonSoup read_scene_file(const std::filesystem::path& path, SceneForm form);

}  // namespace groundray
