#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/scene/world.h"
#include "apps/view/layer.h"
#include "apps/view/recorded_sensor.h"
#include "apps/view/terrain_follower.h"
#include "apps/view/view.h"
#include "core/image.h"

namespace groundray {

enum class InputKind { Scene, Dataset, Mesh, Cloud, Dem, Picture };

/// How much of a large input is shown: what is more is thinned, with a note.
struct OpenLimits {
  std::size_t points = 20'000'000;
  std::size_t triangles = 4'000'000;               ///< of a mesh; half as many samples of a DEM
  std::size_t objects_triangles = 600'000;         ///< of all that stands in a scene
  std::size_t file_bytes = std::size_t{4} << 30U;  ///< clouds and meshes above are refused
};

/// What came of a file or folder.
struct Opened {
  InputKind kind = InputKind::Mesh;
  std::filesystem::path path;
  std::vector<Layer> layers;
  std::optional<Look> look;        ///< where it is best seen from; else View::fit serves
  std::vector<std::string> notes;  ///< for people: what was thinned or left out

  /// Of a scene, and of a DEM of one band: "terrain" is its layer for a first viewpoint.
  std::shared_ptr<TerrainFollower> follower;
  std::shared_ptr<const World> world;              ///< of a scene
  std::shared_ptr<const RecordedDataset> dataset;  ///< of a dataset
  std::shared_ptr<const RecordedRun> run;          ///< of a dataset: what it tells of all sensors
  std::shared_ptr<const Image8> picture;           ///< of a picture: 1 to 4 channels
};

/// Opens a scene (.yaml), a dataset (a folder with dataset.yaml), a mesh, a cloud, a DEM or a
/// picture, told apart by ending and content. Any thread may; nothing is drawn.
/// @param stop  asks for an end, from any thread: the certification of a terrain ends then, a file
///              that is being read is waited for.
/// @throws Error that names the path, if it is none of these or at fault, or larger than the
///         limits allow. @throws Interrupted if it was asked to stop.
Opened open_any(const std::filesystem::path& path, const OpenLimits& limits = {},
                const std::stop_token& stop = {});

/// Returns what a path seems to be, without reading all of it. @throws Error as open_any.
InputKind kind_of(const std::filesystem::path& path);

/// Returns the layer of a scan, with all its columns; its points are in D by the poses it was made
/// at. `name` becomes the layer's.
Layer scan_layer(const RecordedDataset& dataset, const RecordedLidar& lidar,
                 const RecordedFrame& frame, const std::string& name);

}  // namespace groundray
