#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "apps/dataset/write/dataset_writer.h"
#include "apps/dataset/write/frame_files.h"
#include "apps/scene/frames.h"
#include "apps/scene/simulation.h"
#include "core/io/point_cloud.h"
#include "sensors/lidar/lidar.h"

namespace groundray {

/// Identifier of a frame in a run; sensors are numbered as in dataset.yaml.
struct FrameName {
  std::uint32_t sensor = 0;
  std::int64_t number = 0;
};

/// Work of a run, or of a part of it.
struct FramePlan {
  /// Frames that are not finished, in the order of their making. The first frame of each sensor
  /// comes first: it shows how long the others will take. All frames of each interval of 10 s are
  /// made before the next interval, so that the remaining frames take as long as the finished
  /// ones. Within an interval, frames are ordered by sensor, because its surroundings change
  /// little, with lidars first, because images may show their echoes.
  std::vector<FrameName> frames;
  std::size_t scans = 0, images = 0;  ///< total numbers, including finished frames
};

/// Plans the work of a run whose dataset may have finished frames.
FramePlan plan_frames(const Simulation& simulation, const DatasetWriter& dataset);

/// Frame in memory.
struct MadeFrame {
  FrameName name;
  std::variant<LidarScan, MadeImage> product;
  std::vector<std::vector<ImagedEcho>> echoes;  ///< of an image: per lidar that its camera shows
  std::chrono::duration<double> tracing{0};     ///< duration of ray tracing
  std::chrono::duration<double> making{0};      ///< duration including the preparation of the scene
};

/// Progress callback: receives the frame that is being made and the fraction of it that has begun.
/// Called by any thread, and by several at a time.
using FrameWatch = std::function<void(const FrameName& frame, double share)>;

/// Generator of a run's frames, one at a time. A frame depends only on the run and on its name, not
/// on the frames made before.
class FrameMaker {
 public:
  /// @param simulation, dataset  must outlive this.
  /// @param watch  progress callback; may be empty.
  FrameMaker(const Simulation& simulation, const DatasetWriter& dataset, FrameWatch watch = {})
      : simulation_(simulation),
        dataset_(dataset),
        watch_(std::move(watch)),
        scene_for_(simulation) {}

  /// Makes a frame.
  /// @throws Error if there is too little memory, or a scan that an image shows cannot be read;
  ///         Interrupted.
  MadeFrame make(const FrameName& name);
  /// Returns the exposure time and gain that `make` gives an image with light.
  /// @throws Error as make.
  ExposureSetting exposure_of(const FrameName& image);

 private:
  LidarScan trace_scan(std::uint32_t lidar, std::int64_t frame,
                       std::chrono::duration<double>& tracing);
  const PointCloud& echoes_of(const OverlaidScan& shown);

  const Simulation& simulation_;
  const DatasetWriter& dataset_;
  FrameWatch watch_;
  FrameSceneBuilder scene_for_;
  std::map<std::uint32_t, std::pair<std::int64_t, PointCloud>> shown_last_;  // last scan by lidar
};

/// Result of writing a frame.
struct WrittenFrame {
  std::uint64_t bytes = 0;  ///< size of its files
  ImageFigures image;       ///< if it is an image
  std::chrono::duration<double> writing{0};
  std::chrono::duration<double> writing_cpu{0};  ///< processor time of the writing thread
};

/// Writes all files of a frame, and records it in the dataset.
/// @throws Error if a file cannot be written.
WrittenFrame write_frame(const Simulation& simulation, DatasetWriter& dataset,
                         const MadeFrame& made);

/// Makes frames in the given order, and records them in the dataset. Each is written while the next
/// one is made, so that at most two are in memory. Stops between two frames if an end is requested.
/// @param written  called for each frame after it has been written, by one thread at a time.
/// @param watch  progress callback of the frame that is being made; may be empty.
/// @throws Error as FrameMaker and if a file cannot be written; Interrupted. All frames passed to
///         `written` are finished even then.
void make_frames(const Simulation& simulation, DatasetWriter& dataset,
                 const std::vector<FrameName>& frames,
                 const std::function<void(const MadeFrame&, const WrittenFrame&)>& written,
                 const FrameWatch& watch = {});

}  // namespace groundray
