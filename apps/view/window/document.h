#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "apps/view/load_input.h"
#include "apps/view/recorded/timeline.h"

namespace groundray {

/// Input that is open in the window.
struct Document {
  std::filesystem::path path;
  InputKind kind = InputKind::Mesh;
  std::string name;  ///< first part of its layers' names
  std::shared_ptr<TerrainFollower> follower;
  std::string terrain;        ///< name of the terrain's layer
  bool has_one_band = false;  ///< true if a DEM's heights are shown by a follower
  std::shared_ptr<const Simulation> simulation;
  std::shared_ptr<const RecordedDataset> dataset;  ///< null for a scene
  std::shared_ptr<const Timeline> timeline;
};

/// Returns the name of the document that a layer belongs to.
inline std::string document_of(const std::string& layer) {
  return layer.substr(0, layer.find('/'));
}

}  // namespace groundray
