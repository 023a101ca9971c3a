#pragma once

#include <array>
#include <cstddef>
#include <glm/vec2.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/yaml_reader.h"
#include "sensors/camera/lens/lens_models.h"

// Readers of the trees of calibration files and of their values, private to this library. Each
// function that reads a value records every fault and then returns a harmless value. Keys that do
// not concern the lens or its pose are ignored.
namespace groundray::yaml::calibration {

/// Indices in LensModel.
namespace kind {
inline constexpr std::size_t pinhole = 0, brown_conrady = 1, kannala_brandt = 2, eucm = 4,
                             double_sphere = 5, mei = 6, equirectangular = 7;
template <std::size_t index, typename Model>
inline constexpr bool is = std::is_same_v<std::variant_alternative_t<index, LensModel>, Model>;
static_assert(is<pinhole, Pinhole> && is<brown_conrady, BrownConrady> &&
              is<kannala_brandt, KannalaBrandt> && is<eucm, Eucm> &&
              is<double_sphere, DoubleSphere> && is<mei, Mei> &&
              is<equirectangular, Equirectangular>);
}  // namespace kind

/// Returns the value of a required key; null, with a fault, if it is missing.
const Node* required(Map& map, std::string_view key, Faults& faults);

/// Returns the text at a required key; "" at a fault.
std::string text_at(Map& map, std::string_view key, Faults& faults);

/// Returns the numbers of a list of any length; a single number counts as a list of one. Empty at a
/// fault.
std::vector<double> list_of(const Node& node, std::string_view key, Faults& faults);

/// Returns exactly as many numbers as there are names; empty at a fault.
std::vector<double> numbers_at(Map& map, std::string_view key,
                               std::initializer_list<const char*> names, Faults& faults);

/// Returns a whole number of pixels; 0 at a fault.
int pixels_of(const Node& node, std::string_view key, Faults& faults);

/// Returns the size that a list of width and height gives; 0 at a fault.
glm::ivec2 size_of(const Node& node, std::string_view key, Faults& faults);

/// Returns the first four coefficients; missing ones are 0.
std::array<double, 4> four_of(const std::vector<double>& k);

/// Records at `node` every parameter of a model that is out of bounds.
void check(const LensModel& model, const Node& node, Faults& faults);

/// Returns a BrownConrady lens with OpenCV's coefficients, or a Pinhole if all of them are 0.
LensModel brown_conrady(const PixelScale& scale, const std::vector<double>& k);

std::vector<CameraCalibration> read_ros(const Node& root, Faults& faults);
std::vector<CameraCalibration> read_opencv(const Node& root, Faults& faults);
std::vector<CameraCalibration> read_kalibr(const Node& root, Faults& faults);
std::vector<CameraCalibration> read_basalt(const Node& root, Faults& faults);

}  // namespace groundray::yaml::calibration
