#pragma once

#include <vector>

#include "sensors/camera/calibration.h"
#include "sensors/yaml_reader.h"

// Understands the trees of calibration files, private to this library. Keys that say nothing of the
// lens or its place are left aside.
namespace groundray::calibration {

std::vector<CameraCalibration> read_ros(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_opencv(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_kalibr(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_basalt(const yaml::Node& root, yaml::Faults& faults);

}  // namespace groundray::calibration
