#pragma once

#include <string>

#include "apps/groundray/voxels/label_voxels.h"
#include "apps/scene/scene_spec.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Returns the labels in files of a scene's labels: its own, or by their classes those of a label
/// set in data/labels.
/// @param set  name of the set, or the beginning of one name; empty for the scene's own labels.
/// @throws Error if there is no such set; if a label has no class, or its class no number in the
///         set; or if a surface would have label 0, which stands for empty voxels.
VoxelLabelMap voxel_labels(const SceneSpec& spec, const Scene& scene, const std::string& set);

}  // namespace groundray
