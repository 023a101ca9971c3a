#include "sensors/lidar/scan_columns.h"

#include <cmath>
#include <limits>

namespace groundray {
namespace {

float rounded_up(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest < value ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                         : nearest;
}

}  // namespace

ScanColumns::ScanColumns(PointCloud& cloud, const LidarSpec& spec, const Scene& scene)
    : x_(cloud.add<float>("x")),
      y_(cloud.add<float>("y")),
      z_(cloud.add<float>("z")),
      intensity_(cloud.add<float>("intensity")),
      time_s_(cloud.add<float>("time")),
      ring_(cloud.add<std::uint16_t>("ring")),
      return_index_(cloud.add<std::uint8_t>("return_index")),
      return_count_(cloud.add<std::uint8_t>("return_count")),
      world_x_(cloud.add<double>("world_x")),
      world_y_(cloud.add<double>("world_y")),
      world_z_(cloud.add<double>("world_z")),
      range_true_(cloud.add<double>("range_true")),
      nx_(cloud.add<float>("nx")),
      ny_(cloud.add<float>("ny")),
      nz_(cloud.add<float>("nz")),
      incidence_(cloud.add<float>("incidence")),
      label_(cloud.add<std::uint16_t>("label")),
      instance_(cloud.add<std::uint32_t>("instance")),
      error_estimate_(cloud.add<float>("error_estimate")) {
  if (spec.light) {
    pulse_ = cloud.add<std::uint32_t>("pulse");
    amplitude_ = cloud.add<float>("amplitude");
    width_ = cloud.add<float>("width");
    snr_ = cloud.add<float>("snr");
    kind_ = cloud.add<std::uint8_t>("kind");
    share_ = cloud.add<float>("share");
    second_share_ = cloud.add<float>("second_share");
    second_label_ = cloud.add<std::uint16_t>("second_label");
  }
  if (spec.range_noise_sigma_m > 0 || (spec.light && spec.light->receiver.noise))
    range_sd_ = cloud.add<float>("range_sd");
  if (scene.objects.any_moves()) {
    velocity_ = {cloud.add<float>("vx"), cloud.add<float>("vy"), cloud.add<float>("vz")};
  }
  if (spec.error_bound == LidarSpec::ErrorBound::Report)
    error_bound_ = cloud.add<float>("error_bound");
}

void ScanColumns::write_light(std::size_t row, std::uint32_t pulse, const Echo& echo,
                              std::uint16_t second_label) const noexcept {
  pulse_[row] = pulse;
  amplitude_[row] = static_cast<float>(echo.detection.power_w);
  width_[row] = static_cast<float>(echo.detection.width_s);
  snr_[row] = static_cast<float>(echo.detection.snr);
  kind_[row] = static_cast<std::uint8_t>(echo.kind);
  share_[row] = echo.share;
  second_share_[row] = echo.second_share;
  second_label_[row] = second_label;
}

void ScanColumns::write_bound(std::size_t row, double bound_m) const noexcept {
  error_bound_[row] = rounded_up(bound_m);
}

}  // namespace groundray
