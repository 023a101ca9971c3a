#pragma once

#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/yaml_reader.h"

// Readers of the trees of calibration files, private to this library. Keys that do not concern the
// lens or its pose are ignored.
namespace groundray::calibration {

std::vector<CameraCalibration> read_ros(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_opencv(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_kalibr(const yaml::Node& root, yaml::Faults& faults);
std::vector<CameraCalibration> read_basalt(const yaml::Node& root, yaml::Faults& faults);

}  // namespace groundray::calibration
