#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "apps/groundray/record/dataset_writer.h"
#include "apps/groundray/record/images.h"
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

/// Frame in memory.
struct MadeFrame {
  FrameName name;
  std::variant<LidarScan, MadeImage> product;
  std::vector<std::vector<ImagedEcho>> echoes;  ///< of an image: per lidar that its camera shows
  std::chrono::duration<double> tracing{0};     ///< duration of ray tracing
  std::chrono::duration<double> making{0};      ///< duration including the preparation of the scene
};

/// Generator of a run's frames, one at a time. A frame depends only on the run and on its name, not
/// on the frames made before.
class FrameMaker {
 public:
  /// @param simulation, dataset  must outlive this.
  FrameMaker(const Simulation& simulation, const DatasetWriter& dataset)
      : simulation_(simulation), dataset_(dataset), scene_for_(simulation) {}

  /// Makes a frame.
  /// @throws Error if there is too little memory, or a scan that an image shows cannot be read;
  ///         Interrupted.
  MadeFrame make(const FrameName& name);

 private:
  LidarScan trace_scan(std::uint32_t lidar, std::int64_t frame,
                       std::chrono::duration<double>& tracing);
  const PointCloud& echoes_of(const OverlaidScan& shown);

  const Simulation& simulation_;
  const DatasetWriter& dataset_;
  FrameSceneBuilder scene_for_;
  std::map<std::uint32_t, std::pair<std::int64_t, PointCloud>> shown_last_;  // last scan by lidar
};

}  // namespace groundray
