#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "apps/groundray/record/dataset.h"
#include "apps/groundray/record/images.h"
#include "apps/scene/frame_scene.h"
#include "apps/scene/world.h"
#include "core/point_cloud.h"
#include "sensors/lidar.h"

namespace groundray {

/// Which frame of a run: sensors are numbered as in dataset.yaml.
struct FrameName {
  std::uint32_t sensor = 0;
  std::int64_t number = 0;
};

/// A frame in memory.
struct MadeFrame {
  FrameName name;
  std::variant<LidarScan, MadeImage> product;
  std::chrono::duration<double> tracing{0};  ///< of rays
  std::chrono::duration<double> making{0};   ///< with the scene that they meet
};

/// Makes the frames of a run, one at a time. What a frame is depends on the run and its name alone,
/// not on which others were made before.
class FrameMaker {
 public:
  /// @param world, dataset  are to outlive this.
  FrameMaker(const World& world, const Dataset& dataset)
      : world_(world), dataset_(dataset), scene_for_(world) {}

  /// @throws Error if there is too little memory, or a scan that an image shows cannot be read;
  /// Interrupted.
  MadeFrame make(const FrameName& name);

 private:
  LidarScan make_scan(std::uint32_t lidar, std::int64_t frame,
                      std::chrono::duration<double>& tracing);
  const PointCloud& echoes_of(const ShownScan& shown);

  const World& world_;
  const Dataset& dataset_;
  FrameScene scene_for_;
  std::map<std::uint32_t, std::pair<std::int64_t, PointCloud>> shown_last_;  // by lidar: its scan
};

}  // namespace groundray
