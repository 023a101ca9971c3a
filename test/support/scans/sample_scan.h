#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "apps/scan/scan.h"

namespace groundray::testing {

/// One return of a synthetic scan. Its numbers are doubles, so that known differences stay exact.
struct SampleReturn {
  glm::dvec3 direction{1, 0, 0};
  double range_m = 1;
  double ring = 0;
  double time_s = 0;
  double return_index = 1;
  double intensity = 0;
  double label = 0;
  double incidence_rad = 0;
};

using SampleReturns = std::vector<SampleReturn>;

inline glm::dvec3 direction_of(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad),
          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

/// One turn of 8 rings, 0.03 rad apart, each with 90 pulses: ring 0 is the lowest.
inline SampleReturns sample_returns() {
  constexpr int rings = 8, steps = 90;
  SampleReturns returns;
  for (int step = 0; step < steps; ++step) {
    for (int ring = 0; ring < rings; ++ring) {
      const double azimuth_rad = 2 * std::numbers::pi * step / steps;
      returns.push_back({.direction = direction_of(azimuth_rad, 0.03 * ring - 0.1),
                         .range_m = 8 + 3 * std::sin(azimuth_rad) + ring,
                         .ring = static_cast<double>(ring),
                         .time_s = (step + ring / 16.) * 1e-3,
                         .intensity = 10. + ring + step % 7,
                         .label = static_cast<double>(ring % 3),
                         .incidence_rad = 0.2 * ring});
    }
  }
  return returns;
}

/// Returns a file with the columns x, y, z and the requested ones of ring, time, return_index,
/// intensity, label, incidence.
inline CloudFile file_of(const SampleReturns& returns, const std::vector<std::string>& names) {
  CloudFile file{.form = "made up", .cloud = PointCloud(returns.size())};
  const auto add = [&](const std::string& name, const auto& value_of) {
    const auto values = file.cloud.add<double>(name);
    for (std::size_t i = 0; i < returns.size(); ++i) values[i] = value_of(returns[i]);
  };
  add("x", [](const SampleReturn& r) { return r.direction.x * r.range_m; });
  add("y", [](const SampleReturn& r) { return r.direction.y * r.range_m; });
  add("z", [](const SampleReturn& r) { return r.direction.z * r.range_m; });
  const std::vector<std::pair<std::string, double SampleReturn::*>> members{
      {"ring", &SampleReturn::ring},
      {"time", &SampleReturn::time_s},
      {"return_index", &SampleReturn::return_index},
      {"intensity", &SampleReturn::intensity},
      {"label", &SampleReturn::label},
      {"incidence", &SampleReturn::incidence_rad}};
  for (const std::string& name : names) {
    for (const auto& entry : members) {
      if (entry.first == name) add(name, [&](const SampleReturn& r) { return r.*(entry.second); });
    }
  }
  return file;
}

inline Scan scan_of(const SampleReturns& returns, const std::vector<std::string>& names) {
  return groundray::scan_of(file_of(returns, names), "sample", {});
}

}  // namespace groundray::testing
