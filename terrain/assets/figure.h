#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/model/model.h"
#include "terrain/assets/asset.h"

namespace groundray {

/// Returns the number of rigid parts of which an asset consists when it walks: 0 for kinds that
/// do not walk.
std::size_t figure_parts(AssetKind kind);

/// Generates one rigid part of an asset that walks, in the part's own frame.
/// @param part  less than figure_parts().
/// @throws Error as check_asset.
Model make_figure_part(const AssetSpec& spec, std::size_t part);

/// Height of the ground at a point of D, metres; nothing outside the DEM or in a hole.
using GroundHeight = std::function<std::optional<double>(const glm::dvec2&)>;

/// Walk of an asset over the ground.
struct WalkSpec {
  AssetSpec asset;
  std::chrono::nanoseconds spacing{5'000'000};  ///< between two poses
  glm::dvec2 origin_w_m{0};                     ///< position of D in W, for messages
  /// Interval outside of which no poses are needed.
  std::chrono::nanoseconds from = std::chrono::nanoseconds::min();
  std::chrono::nanoseconds until = std::chrono::nanoseconds::max();
};

/// Returns the trajectories, in D, of all parts of an asset that walks along a path, within its
/// times and the interval of `spec`. The path's positions in plan and its headings are followed;
/// heights are those of the ground under each foot. A foot that bears weight stands still. The
/// phase of the gait advances with the distance in plan, so a path that pauses stops the walk and
/// puts swinging feet down; the length of a stride follows from the mean speed and the slope. On a
/// path without length the asset stands.
/// @throws Error as check_asset, if the kind does not walk, if the path is too fast for a walk, if
///         the spacing is not positive, or if a foot would be outside the DEM or in a hole.
/// @see docs/reference/assets.md: the model of the gait, its sources and its errors.
std::vector<Trajectory> walk(const GroundHeight& ground, const WalkSpec& spec,
                             const Trajectory& X_DO);

}  // namespace groundray
