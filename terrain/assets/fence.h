#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/model/model.h"
#include "terrain/assets/asset.h"

namespace groundray {

/// Returns the places of a fence's posts along a line: one at each of its points, and between them
/// the fewest equal bays that are no longer than the `width_m` of `fence`, or its default.
/// @throws Error if the line has fewer than two points or two equal ones in a row, or if there
/// would
///         be more than 10,000 posts.
std::vector<glm::dvec2> fence_posts(const AssetSpec& fence, std::span<const glm::dvec2> line_m);

/// Generates a fence whose posts stand at given places, for example on uneven ground. Its wires run
/// straight from post to post.
/// @param fence    of the kind Fence; its `size_m` is not used.
/// @param posts_m  at least two, where the posts meet the ground. The model is in the same frame.
/// @throws Error as check_asset.
Model make_fence(const AssetSpec& fence, std::span<const glm::dvec3> posts_m);

}  // namespace groundray
