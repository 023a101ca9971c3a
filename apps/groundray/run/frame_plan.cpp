#include "apps/groundray/run/frame_plan.h"

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace groundray {
namespace {

// Returns the interval of the run in which a frame is made. An image is never in an earlier
// interval than the scans it shows.
std::int64_t part_of(const Simulation& simulation, const FrameName& name) {
  constexpr std::chrono::seconds part(10);
  const std::size_t lidars = simulation.lidars.size();
  if (name.sensor < lidars)
    return simulation.lidars[name.sensor].lidar.pattern().stamp(name.number) / part;
  const PlacedCamera& camera = simulation.cameras[name.sensor - lidars];
  return (camera.begins[static_cast<std::size_t>(name.number)] + camera.camera.duration() / 2) /
         part;
}

}  // namespace

FramePlan plan_frames(const Simulation& simulation, const DatasetWriter& dataset,
                      const std::optional<Shard>& shard) {
  FramePlan plan;
  for (std::uint32_t sensor = 0; sensor < dataset.sensor_count(); ++sensor) {
    const std::int64_t count = dataset.frames(sensor);
    for (std::int64_t number = 0; number < count; ++number) {
      if (shard && !shard->has(sensor, number, count)) continue;
      ++(sensor < simulation.lidars.size() ? plan.scans : plan.images);
      if (!dataset.has(sensor, number)) plan.frames.push_back({sensor, number});
    }
  }
  std::ranges::stable_sort(plan.frames, {},
                           [&](const FrameName& name) { return part_of(simulation, name); });
  return plan;
}

}  // namespace groundray
