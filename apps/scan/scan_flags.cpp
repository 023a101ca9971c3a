#include "apps/scan/scan_flags.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "apps/scan/number_checks.h"
#include "core/error.h"

namespace groundray {
namespace {

/// Converts the numbers x, y, z, qx, qy, qz, qw to a pose.
/// @param option  name of their option, for messages.
Pose sensor_pose(const std::vector<double>& numbers, const std::string& option) {
  constexpr double most_off = 1e-3;  // rounding to three decimals
  const glm::dquat rotation(numbers[6], numbers[3], numbers[4], numbers[5]);
  const double norm = glm::length(rotation);
  if (!(std::abs(norm - 1) <= most_off)) {
    throw Error(
        "{}: the length of its quaternion, the last four numbers, is {:.6g}; it must be 1: are "
        "they in the order qx,qy,qz,qw?",
        option, norm);
  }
  return {.rotation = rotation / norm, .translation_m = {numbers[0], numbers[1], numbers[2]}};
}

}  // namespace

void ScanFlags::add(CLI::App* group, const std::string& prefix) {
  whose_ = prefix;
  group->add_option("--" + prefix + "unit-m", unit_m_, "Unit of x, y and z, in metres")
      ->check(positive());
  group->add_option("--" + prefix + "time-unit-s", time_unit_s_, "Unit of time, in seconds")
      ->check(positive());
  group->add_option("--" + prefix + "time-zero-s", time_zero_s_,
                    "Clock reading at the scan's stamp, in seconds");
  auto* posed = group
                    ->add_option("--" + prefix + "sensor-pose", pose_,
                                 "x,y,z,qx,qy,qz,qw of the sensor in the frame of the points")
                    ->delimiter(',')
                    ->expected(7);
  group
      ->add_flag("--" + prefix + "viewpoint", viewpoint_,
                 "Use the VIEWPOINT of the PCD file as the pose")
      ->excludes(posed);
  group->add_option("--" + prefix + "columns", columns_, "Names of unnamed columns")
      ->delimiter(',');
}

ScanReading ScanFlags::reading() const {
  ScanReading reading{
      .unit_m = unit_m_, .time_unit_s = time_unit_s_, .X_FS = {}, .columns = columns_};
  constexpr double latest_s = 9e9;  // range of nanoseconds
  if (!(std::abs(time_zero_s_) <= latest_s)) {
    throw Error("--{}time-zero-s: {} s must be within 9e9 s of 0: is it in another unit?", whose_,
                time_zero_s_);
  }
  reading.time_zero = std::chrono::nanoseconds(std::llround(time_zero_s_ * 1e9));
  if (viewpoint_) reading.X_FS = FileViewpoint{};
  if (!pose_.empty()) reading.X_FS = sensor_pose(pose_, "--" + whose_ + "sensor-pose");
  return reading;
}

}  // namespace groundray
