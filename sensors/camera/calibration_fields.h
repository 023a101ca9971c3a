#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "sensors/camera/lens_models.h"
#include "sensors/yaml_reader.h"

// Values of calibration files, private to this library: whatever is wrong with one is noted, and a
// value that does no harm comes back.
namespace groundray::calibration {

/// The value of a key that must be there; else null.
const yaml::Node* required(yaml::Map& map, std::string_view key, yaml::Faults& faults);

/// A text that must be there; else "".
std::string text_at(yaml::Map& map, std::string_view key, yaml::Faults& faults);

/// A list of numbers, however many; a lone number is a list of one.
std::vector<double> list_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// As many numbers as there are names; none at a fault.
std::vector<double> numbers_at(yaml::Map& map, std::string_view key,
                               std::initializer_list<const char*> names, yaml::Faults& faults);

/// A whole number of pixels; else 0.
int pixels_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// A list of width and height.
glm::ivec2 size_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// The first four; 0 for those that are not there.
std::array<double, 4> four_of(const std::vector<double>& k);

/// Notes at `node` what is out of bounds in a model.
void check(const LensModel& model, const yaml::Node& node, yaml::Faults& faults);

/// Returns a pinhole with OpenCV's coefficients; without, if all are 0.
LensModel brown_conrady(const PixelScale& scale, const std::vector<double>& k);

}  // namespace groundray::calibration
