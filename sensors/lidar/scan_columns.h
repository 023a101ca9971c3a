#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>

#include "core/elementary.h"
#include "core/io/point_cloud.h"
#include "core/pack.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/echo_simulator.h"

namespace groundray {

/// Row of a scan. Without light only one return per pulse exists.
struct EchoRow {
  glm::vec3 point{0};  // as reported
  float intensity = 0;
  float time_s = 0;
  std::uint16_t ring = 0;
  std::uint8_t return_index = 1;
  std::uint8_t return_count = 1;
  double range_m = 0;
  glm::dvec3 p_DQ{0};
  glm::vec3 normal{0};
  float cos_incidence = 1;
  float sin_incidence = 0;
  SurfaceTruth surface;
  float deviation_m = 0;
  // Only with light:
  std::uint32_t pulse = 0;
  float power_w = 0, width_s = 0, snr = 0;
  Echo::Kind kind = Echo::Kind::Surface;
  float share = 0, second_share = 0;
  std::uint16_t second_label = 0;
  // Only with noise, if objects move, and if requested:
  float range_sd_m = 0;
  glm::vec3 velocity_m_s{0};
  double bound_m = 0;
};

/// Returns true if a lidar reports the standard deviation of its ranges.
inline bool reports_range_sd(const LidarSpec& spec) {
  return spec.range_noise_sigma_m > 0 || (spec.light && spec.light->receiver.noise);
}

/// Columns of a scan, to be filled row by row. Each row is written by one thread.
class ScanColumns {
 public:
  ScanColumns(PointCloud& cloud, const LidarSpec& spec, const Scene& scene) {
    const auto add = [&](auto& column, const char* name, const auto& /*value*/) {
      column = cloud.add<typename std::remove_reference_t<decltype(column)>::element_type>(name);
    };
    for_common(*this, add);
    if (spec.light) for_light(*this, add);
    if (reports_range_sd(spec)) for_noise(*this, add);
    if (scene.objects.any_moves()) for_motion(*this, add);
    if (spec.error_bound == LidarSpec::ErrorBound::Report) for_bounds(*this, add);
  }

  /// Writes the values that have a column. The angle of incidence awaits complete().
  void write(std::size_t row, const EchoRow& echo) const noexcept {
    const auto set = [&](const auto& column, const char* /*name*/, const auto& value) {
      column[row] = value(echo);
    };
    for_common(*this, set);
    if (!pulse_.empty()) for_light(*this, set);
    if (!range_sd_.empty()) for_noise(*this, set);
    if (!velocity_[0].empty()) for_motion(*this, set);
    if (!error_bound_.empty()) for_bounds(*this, set);
  }

  /// Replaces the tangents of incidence that write() has left in rows [begin, end) by their angles.
  void complete(std::size_t begin, std::size_t end) const noexcept {
    const auto complete_pack = [](float* angles) {
      const Pack tangent(angles, std::experimental::element_aligned);
      const Pack acute = angle_of(abs(tangent), Pack(1.0));
      const Pack angle = select(tangent < 0.0, std::numbers::pi - acute, acute);
      select(tangent == tangent, angle, tangent)
          .copy_to(angles, std::experimental::element_aligned);
    };
    std::size_t row = begin;
    for (; row + pack_size <= end; row += pack_size) complete_pack(&incidence_[row]);
    std::array<float, pack_size> rest{};
    std::copy_n(incidence_.begin() + row, end - row, rest.begin());
    complete_pack(rest.data());
    std::copy_n(rest.begin(), end - row, incidence_.begin() + row);
  }

 private:
  using Row = const EchoRow&;

  // Each calls act(column, name, value of a row) for some columns, in the order of the file.
  template <typename Self, typename Act>
  static void for_common(Self& self, const Act& act) {
    act(self.x_, "x", [](Row row) { return row.point.x; });
    act(self.y_, "y", [](Row row) { return row.point.y; });
    act(self.z_, "z", [](Row row) { return row.point.z; });
    act(self.intensity_, "intensity", [](Row row) { return row.intensity; });
    act(self.time_s_, "time", [](Row row) { return row.time_s; });
    act(self.ring_, "ring", [](Row row) { return row.ring; });
    act(self.return_index_, "return_index", [](Row row) { return row.return_index; });
    act(self.return_count_, "return_count", [](Row row) { return row.return_count; });
    act(self.world_x_, "world_x", [](Row row) { return row.p_DQ.x; });
    act(self.world_y_, "world_y", [](Row row) { return row.p_DQ.y; });
    act(self.world_z_, "world_z", [](Row row) { return row.p_DQ.z; });
    act(self.range_true_, "range_true", [](Row row) { return row.range_m; });
    act(self.nx_, "nx", [](Row row) { return row.normal.x; });
    act(self.ny_, "ny", [](Row row) { return row.normal.y; });
    act(self.nz_, "nz", [](Row row) { return row.normal.z; });
    act(self.incidence_, "incidence",
        [](Row row) { return row.sin_incidence / row.cos_incidence; });  // see complete()
    act(self.label_, "label", [](Row row) { return row.surface.label; });
    act(self.instance_, "instance", [](Row row) { return row.surface.instance; });
    act(self.error_estimate_, "error_estimate",
        [](Row row) { return error_estimate_m(row.deviation_m, row.normal.z, row.cos_incidence); });
  }
  template <typename Self, typename Act>
  static void for_light(Self& self, const Act& act) {
    act(self.pulse_, "pulse", [](Row row) { return row.pulse; });
    act(self.amplitude_, "amplitude", [](Row row) { return row.power_w; });
    act(self.width_, "width", [](Row row) { return row.width_s; });
    act(self.snr_, "snr", [](Row row) { return row.snr; });
    act(self.kind_, "kind", [](Row row) { return static_cast<std::uint8_t>(row.kind); });
    act(self.share_, "share", [](Row row) { return row.share; });
    act(self.second_share_, "second_share", [](Row row) { return row.second_share; });
    act(self.second_label_, "second_label", [](Row row) { return row.second_label; });
  }
  template <typename Self, typename Act>
  static void for_noise(Self& self, const Act& act) {
    act(self.range_sd_, "range_sd", [](Row row) { return row.range_sd_m; });
  }
  template <typename Self, typename Act>
  static void for_motion(Self& self, const Act& act) {
    act(self.velocity_[0], "vx", [](Row row) { return row.velocity_m_s.x; });
    act(self.velocity_[1], "vy", [](Row row) { return row.velocity_m_s.y; });
    act(self.velocity_[2], "vz", [](Row row) { return row.velocity_m_s.z; });
  }
  template <typename Self, typename Act>
  static void for_bounds(Self& self, const Act& act) {
    act(self.error_bound_, "error_bound", [](Row row) {
      const auto nearest = static_cast<float>(row.bound_m);  // rounded up
      return nearest < row.bound_m ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                                   : nearest;
    });
  }

  std::span<float> x_, y_, z_, intensity_, time_s_, nx_, ny_, nz_, incidence_, error_estimate_;
  std::span<double> world_x_, world_y_, world_z_, range_true_;
  std::span<std::uint8_t> return_index_, return_count_, kind_;
  std::span<std::uint16_t> ring_, label_, second_label_;
  std::span<std::uint32_t> instance_, pulse_;
  std::span<float> amplitude_, width_, snr_, share_, second_share_, range_sd_, error_bound_;
  std::array<std::span<float>, 3> velocity_;
};

}  // namespace groundray
