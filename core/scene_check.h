#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/model_io.h"

/// What is wrong in a file that assimp would crash on, wait for ever on, or pass over in silence.
namespace groundray {

/// Returns how many triangles a .gltf or .glb announces.
/// @param name  stands for the file in messages.
/// @throws Error if it is no JSON or is nested more than 100 deep, a chunk of the .glb goes beyond
///         its end, a view goes beyond its buffer or an accessor beyond its view, what is named
///         does not exist, or nodes are nested as below.
std::size_t check_gltf(std::string_view bytes, const std::string& name);

struct ColladaAsset {
  double metres_per_unit = 1;
  UpAxis up = UpAxis::Y;
};

/// Returns the unit and the axis of a .dae.
/// @throws Error if it is no XML, the unit is not positive, numbers are spelt otherwise or have no
///         count, or a node has itself as a part, directly or by `instance_node`, parts more than
///         1000 deep, or more than 10^6 of them.
ColladaAsset check_collada(std::string_view text, const std::string& name);

}  // namespace groundray
