#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "apps/python/binding/mesh.h"
#include "apps/python/terrain_model.h"
#include "apps/scene/scene_spec.h"
#include "core/io/temporary_folder.h"

namespace groundray::python {

/// Origin of a scene besides the text of its file and its seed.
struct SceneSource {
  std::filesystem::path path;  ///< names the file in messages; its folder is that of other files
  std::shared_ptr<TerrainModel> terrain;  ///< replaces the DEM; null for none
  // By the names by which the text refers to them:
  std::map<std::string, Mesh> meshes;               ///< in the frames O of models
  std::map<std::string, std::string> trajectories;  ///< in TUM format
};

/// Puts the meshes and trajectories of a scene in the place of the files that `spec` names.
/// @throws Error naming a mesh that is not valid as a model or has keys that only files may have.
void use_given(const SceneSource& source, SceneSpec& spec);

/// Puts a file of the terrain of a scene, if it has one, in the place of the DEM.
/// @return the folder of that file, or null. Terrain too large to be traced as a whole is read from
///         it as long as the scene exists.
/// @throws Error if it cannot be written.
std::shared_ptr<const TemporaryFolder> use_terrain(const SceneSource& source, SceneSpec& spec);

}  // namespace groundray::python
