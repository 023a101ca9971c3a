#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/yaml_reader.h"
#include "sensors/camera/lens/lens_models.h"

// Values of calibration files, private to this library. Each function records every fault and then
// returns a harmless value.
namespace groundray::calibration {

/// Returns the value of a required key; null, with a fault, if it is missing.
const yaml::Node* required(yaml::Map& map, std::string_view key, yaml::Faults& faults);

/// Returns the text at a required key; "" at a fault.
std::string text_at(yaml::Map& map, std::string_view key, yaml::Faults& faults);

/// Returns the numbers of a list of any length; a single number counts as a list of one. Empty at a
/// fault.
std::vector<double> list_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// Returns exactly as many numbers as there are names; empty at a fault.
std::vector<double> numbers_at(yaml::Map& map, std::string_view key,
                               std::initializer_list<const char*> names, yaml::Faults& faults);

/// Returns a whole number of pixels; 0 at a fault.
int pixels_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// Returns the size that a list of width and height gives; 0 at a fault.
glm::ivec2 size_of(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// Returns the first four coefficients; missing ones are 0.
std::array<double, 4> four_of(const std::vector<double>& k);

/// Records at `node` every parameter of a model that is out of bounds.
void check(const LensModel& model, const yaml::Node& node, yaml::Faults& faults);

/// Returns a BrownConrady lens with OpenCV's coefficients, or a Pinhole if all of them are 0.
LensModel brown_conrady(const PixelScale& scale, const std::vector<double>& k);

}  // namespace groundray::calibration
