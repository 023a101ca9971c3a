#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/model/model_io.h"

/// Checks for faults on which assimp would crash or never return, or that it would silently ignore.
namespace groundray {

/// Checks a .gltf or .glb and returns the number of triangles that it declares.
/// @param name  file name in error messages.
/// @throws Error if it is not JSON or is nested more than 100 deep, a chunk of the .glb exceeds the
///         file, a view exceeds its buffer or an accessor its view, an item that is referred to
///         does not exist, or nodes are nested as for check_collada.
std::size_t check_gltf(std::string_view bytes, const std::string& name);

struct ColladaAsset {
  double metres_per_unit = 1;
  UpAxis up = UpAxis::Y;
};

/// Checks a .dae and returns its unit and up axis.
/// @throws Error if it is not XML, the unit is not positive, numbers are malformed or have no
///         count, or a node has itself as a part, directly or by `instance_node`, parts nested more
///         than 1000 deep, or more than 10^6 of them.
ColladaAsset check_collada(std::string_view text, const std::string& name);

}  // namespace groundray
