#include "sensors/lidar/scan_boxes.h"

#include <cmath>
#include <cstddef>
#include <map>

namespace groundray {

std::vector<ScannedInstance> scanned_instances(const PointCloud& echoes, const InstanceBoxes& boxes,
                                               std::chrono::nanoseconds stamp) {
  struct Points {
    std::uint32_t count = 0;
    double sum_s = 0;
  };
  const auto instance = echoes.column<std::uint32_t>("instance");
  const auto time_s = echoes.column<float>("time");
  std::map<std::uint32_t, Points> points;
  for (std::size_t i = 0; i < echoes.rows(); ++i) {
    if (instance[i] == 0) continue;
    Points& of = points[instance[i]];
    ++of.count;
    of.sum_s += double{time_s[i]};
  }
  std::vector<ScannedInstance> scanned;
  for (const auto& [number, of] : points) {
    const double mean_ns = 1e9 * of.sum_s / of.count;
    const auto time = stamp + std::chrono::nanoseconds(std::llround(mean_ns));
    scanned.push_back({boxes.at(number, time), of.count});
  }
  return scanned;
}

}  // namespace groundray
