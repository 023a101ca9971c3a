#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "apps/scene/calibration/calibration_io.h"
#include "apps/scene/readers/scene_reader.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace {

using groundray::PatternSpec;
using groundray::ScanPattern;

void print(const ScanPattern& scan, std::int64_t sweep) {
  groundray::PulseBatch batch;
  scan.fill(sweep, 0, scan.pulses(sweep), batch);
  fmt::print("time_s,ring,dx,dy,dz,ox_m,oy_m,oz_m\n");
  for (const auto& volley : batch.volleys) {
    for (std::size_t i = volley.begin; i < volley.end; ++i) {
      const glm::dvec3& d = batch.direction[i];
      const glm::dvec3& o = batch.origin_m[i];
      fmt::print("{:.12f},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", volley.time_s,
                 batch.ring[i], d.x, d.y, d.z, o.x, o.y, o.z);
    }
  }
}

}  // namespace

// Prints the pulses of a sweep as CSV, for the checks in Python:
//   print_pulses LIDAR SWEEP [UNIT]
// LIDAR is a lidar file or the metadata of an Ouster; UNIT is a calibration that is applied to it.
int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    fmt::print(stderr, "usage: print_pulses LIDAR SWEEP [UNIT]\n");
    return 2;
  }
  try {
    const std::filesystem::path lidar(argv[1]);
    PatternSpec pattern = lidar.extension() == ".json" ? groundray::load_ouster_metadata(lidar)
                                                       : groundray::load_lidar(lidar).pattern;
    if (argc == 4) pattern = groundray::calibrated(pattern, argv[3]);
    print(ScanPattern(pattern), std::stoll(argv[2]));
  } catch (const std::exception& fault) {
    fmt::print(stderr, "{}\n", fault.what());
    return 1;
  }
  return 0;
}
