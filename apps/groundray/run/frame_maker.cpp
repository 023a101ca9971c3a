#include "apps/groundray/run/frame_maker.h"

#include <cstddef>

#include "apps/dataset/dataset_listing.h"
#include "apps/scene/interruption.h"
#include "core/io/ply_io.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

MadeFrame FrameMaker::make(const FrameName& name) {
  const auto begin = Clock::now();
  MadeFrame made{.name = name, .product = {}};
  if (name.sensor < simulation_.lidars.size()) {
    made.product = trace_scan(name.sensor, name.number, made.tracing);
  } else {
    const std::size_t camera = name.sensor - simulation_.lidars.size();
    for (const OverlaidScan& shown : shown_scans(simulation_, camera, name.number)) {
      const PointCloud& cloud = echoes_of(shown);
      const Scene& scene = scene_for_(exposed(simulation_.lidars[shown.lidar], shown.scan));
      made.echoes.push_back(show_echoes(simulation_, camera, name.number, shown, cloud, scene));
    }
    const Scene& scene = scene_for_(exposed(simulation_.cameras[camera], name.number));
    const auto traced_from = Clock::now();
    made.product = make_image(simulation_, camera, name.number, scene, stop_if_interrupted);
    made.tracing = Clock::now() - traced_from;
  }
  made.making = Clock::now() - begin;
  return made;
}

LidarScan FrameMaker::trace_scan(std::uint32_t sensor, std::int64_t frame,
                                 std::chrono::duration<double>& tracing) {
  const Scene& scene = scene_for_(exposed(simulation_.lidars[sensor], frame));
  const auto begin = Clock::now();
  LidarScan scan = make_scan(simulation_, sensor, frame, scene);
  tracing += Clock::now() - begin;
  return scan;
}

// Returns the echoes from their file, or makes the scan again if it belongs to another shard.
const PointCloud& FrameMaker::echoes_of(const OverlaidScan& shown) {
  const auto last = shown_last_.find(shown.lidar);
  if (last != shown_last_.end() && last->second.first == shown.scan) return last->second.second;
  std::chrono::duration<double> tracing{0};
  PointCloud echoes =
      dataset_.has(shown.lidar, shown.scan)
          ? read_ply(dataset_.product_path(shown.lidar, shown.scan, scan_suffix)).cloud
          : trace_scan(shown.lidar, shown.scan, tracing).echoes;
  return shown_last_.insert_or_assign(shown.lidar, std::pair(shown.scan, std::move(echoes)))
      .first->second.second;
}

}  // namespace groundray
