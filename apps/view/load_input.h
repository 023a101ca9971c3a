#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/scene/simulation.h"
#include "apps/view/layers/terrain_follower.h"
#include "apps/view/recorded/recorded_sensor.h"
#include "apps/view/rendering/layer.h"
#include "apps/view/rendering/view.h"
#include "core/image/image.h"

namespace groundray {

enum class InputKind { Scene, Dataset, Mesh, Cloud, Dem, Picture };

/// Limits on displayed data: larger inputs are thinned, with a note.
struct OpenLimits {
  std::size_t points = 20'000'000;
  /// Limit for a mesh; half as many samples of a DEM with several bands.
  std::size_t triangles = 4'000'000;
  std::size_t objects_triangles = 600'000;         ///< limit for all objects in a scene
  std::size_t file_bytes = std::size_t{4} << 30U;  ///< larger clouds and meshes are rejected
};

/// Content of an opened file or folder.
struct Opened {
  InputKind kind = InputKind::Mesh;
  std::filesystem::path path;
  std::vector<Layer> layers;
  std::optional<Look> look;        ///< recommended viewpoint; otherwise View::fit() is used
  std::vector<std::string> notes;  ///< messages for the user: thinning and omissions

  /// Set for a scene, and for a DEM of one band or in geographic coordinates. Its layer in `layers`
  /// is that for a first viewpoint.
  std::shared_ptr<TerrainFollower> follower;
  std::shared_ptr<const Simulation> simulation;    ///< of a scene
  std::shared_ptr<const RecordedDataset> dataset;  ///< of a dataset
  std::shared_ptr<const RecordedRun> run;          ///< metadata of all sensors, of a dataset
  std::shared_ptr<const Image8> picture;           ///< of a picture: 1 to 4 channels
};

/// Opens a scene (.yaml), a dataset (folder with dataset.yaml), mesh, cloud, DEM or picture,
/// distinguished by extension and content. Thread-safe; nothing is drawn.
/// @param stop  requests a stop, from any thread: the certification of a terrain ends at once, but
///              the reading of a file is completed first.
/// @throws Error that names the path, if the type is unknown, or the file is invalid or exceeds the
///         limits.
/// @throws Interrupted if a stop is requested.
Opened open_any(const std::filesystem::path& path, const OpenLimits& limits = {},
                const std::stop_token& stop = {});

/// Origin for the coordinates of meshes and clouds whose files state none.
struct FrameOrigin {
  std::string text;   ///< as requested, for messages
  std::string input;  ///< path or file name; empty for all inputs that state no origin
  glm::dvec3 origin_w_m{0};
};

/// Moves the layer of a mesh or cloud to the origin, if the request applies to the input.
/// @return true if it does: without a name, to meshes and clouds whose file states no origin.
/// @throws Error as move_frame.
bool place_input(Opened& opened, const FrameOrigin& origin);

/// Returns the type of an input without reading all of it. @throws Error as open_any.
InputKind kind_of(const std::filesystem::path& path);

/// Returns the layer of a scan with all its columns and, if missing, "range". Points are
/// transformed to D by the poses at which they were measured.
/// @param name  name of the layer.
Layer scan_layer(const RecordedDataset& dataset, const RecordedLidar& lidar,
                 const RecordedFrame& frame, const std::string& name);

}  // namespace groundray
