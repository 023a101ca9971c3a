#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "core/io/point_cloud.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/echo_simulator.h"

namespace groundray {

/// Values of a row that are common to all scans.
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
};

/// Columns of a scan, to be filled row by row. Each row is written by one thread.
class ScanColumns {
 public:
  ScanColumns(PointCloud& cloud, const LidarSpec& spec, const Scene& scene);

  void write(std::size_t row, const EchoRow& echo) const noexcept;
  void write_light(std::size_t row, std::uint32_t pulse, const Echo& echo,
                   std::uint16_t second_label) const noexcept;
  void write_velocity(std::size_t row, const glm::vec3& velocity_m_s) const noexcept {
    for (std::size_t k = 0; k < 3; ++k) velocity_[k][row] = velocity_m_s[static_cast<int>(k)];
  }
  void write_bound(std::size_t row, double bound_m) const noexcept;
  void write_range_sd(std::size_t row, double sd_m) const noexcept {
    range_sd_[row] = static_cast<float>(sd_m);
  }
  bool has_bounds() const { return !error_bound_.empty(); }
  bool has_range_sd() const { return !range_sd_.empty(); }
  bool has_motion() const { return !velocity_[0].empty(); }

 private:
  std::span<float> x_, y_, z_, intensity_, time_s_;
  std::span<std::uint16_t> ring_;
  std::span<std::uint8_t> return_index_, return_count_;
  std::span<double> world_x_, world_y_, world_z_, range_true_;
  std::span<float> nx_, ny_, nz_, incidence_;
  std::span<std::uint16_t> label_;
  std::span<std::uint32_t> instance_;
  std::span<float> error_estimate_;
  // Only with light:
  std::span<std::uint32_t> pulse_;
  std::span<float> amplitude_, width_, snr_, share_, second_share_;
  std::span<std::uint8_t> kind_;
  std::span<std::uint16_t> second_label_;
  // Only with noise:
  std::span<float> range_sd_;
  // Only if objects move:
  std::array<std::span<float>, 3> velocity_;
  // Only if requested:
  std::span<float> error_bound_;
};

// Defined here to be inlined: it is called for every row.
inline void ScanColumns::write(std::size_t row, const EchoRow& echo) const noexcept {
  x_[row] = echo.point.x;
  y_[row] = echo.point.y;
  z_[row] = echo.point.z;
  intensity_[row] = echo.intensity;
  time_s_[row] = echo.time_s;
  ring_[row] = echo.ring;
  return_index_[row] = echo.return_index;
  return_count_[row] = echo.return_count;
  world_x_[row] = echo.p_DQ.x;
  world_y_[row] = echo.p_DQ.y;
  world_z_[row] = echo.p_DQ.z;
  range_true_[row] = echo.range_m;
  nx_[row] = echo.normal.x;
  ny_[row] = echo.normal.y;
  nz_[row] = echo.normal.z;
  incidence_[row] = std::atan2(echo.sin_incidence, echo.cos_incidence);
  label_[row] = echo.surface.label;
  instance_[row] = echo.surface.instance;
  // Converts the vertical deviation of the surface to a distance along the beam.
  error_estimate_[row] = echo.deviation_m == 0 ? 0
                                               : echo.deviation_m * echo.normal.z /
                                                     std::max(echo.cos_incidence, 1e-6f);
}

}  // namespace groundray
