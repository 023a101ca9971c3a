#include "apps/groundray/run/frame_maker.h"

#include <cstddef>

#include "apps/dataset/dataset_listing.h"
#include "core/ply_io.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

MadeFrame FrameMaker::make(const FrameName& name) {
  const auto begin = Clock::now();
  MadeFrame made{.name = name, .product = {}};
  if (name.sensor < world_.lidars.size()) {
    made.product = make_scan(name.sensor, name.number, made.tracing);
  } else {
    const std::size_t camera = name.sensor - world_.lidars.size();
    std::vector<std::vector<ImagedEcho>> echoes;
    for (const ShownScan& shown : shown_scans(world_, camera, name.number)) {
      const PointCloud& cloud = echoes_of(shown);
      const Scene& scene = scene_for_(exposed(world_.lidars[shown.lidar], shown.scan));
      echoes.push_back(show_echoes(world_, camera, name.number, shown, cloud, scene));
    }
    const Scene& scene = scene_for_(exposed(world_.cameras[camera], name.number));
    const auto traced_from = Clock::now();
    MadeImage image = make_image(world_, camera, name.number, scene);
    made.tracing = Clock::now() - traced_from;
    image.echoes = std::move(echoes);
    made.product = std::move(image);
  }
  made.making = Clock::now() - begin;
  return made;
}

LidarScan FrameMaker::make_scan(std::uint32_t sensor, std::int64_t frame,
                                std::chrono::duration<double>& tracing) {
  const PlacedLidar& lidar = world_.lidars[sensor];
  const Scene& scene = scene_for_(exposed(lidar, frame));
  const auto begin = Clock::now();
  LidarScan scan = lidar.lidar.scan(scene, lidar.X_DS, frame, world_.spec.seed, sensor);
  tracing += Clock::now() - begin;
  return scan;
}

// From its file, or, where that is another shard's, made once more.
const PointCloud& FrameMaker::echoes_of(const ShownScan& shown) {
  const auto last = shown_last_.find(shown.lidar);
  if (last != shown_last_.end() && last->second.first == shown.scan) return last->second.second;
  std::chrono::duration<double> tracing{0};
  PointCloud echoes =
      dataset_.has(shown.lidar, shown.scan)
          ? read_ply(dataset_.product_path(shown.lidar, shown.scan, scan_suffix)).cloud
          : make_scan(shown.lidar, shown.scan, tracing).echoes;
  return shown_last_.insert_or_assign(shown.lidar, std::pair(shown.scan, std::move(echoes)))
      .first->second.second;
}

}  // namespace groundray
