#include "apps/dataset/recorded_calibration.h"

#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "apps/scene/readers/readers.h"

namespace groundray {
namespace {

using yaml::Need;

constexpr yaml::Rule pixels_rule{
    [](double value) { return value >= 1 && value <= 65536 && value == std::floor(value); },
    "must be a whole number from 1 to 65536"};
constexpr yaml::Rule time_rule{[](double value) { return value >= 0 && value <= 3600; },
                               "must be a number of seconds from 0 to 3600"};

}  // namespace

Pose read_mount(yaml::Map& root, std::string_view key, yaml::Faults& faults) {
  Pose pose;
  auto mount = root.map(key, Need::Optional);
  if (!mount) return pose;
  std::array<double, 3> p_m{};
  std::array<double, 4> q{0, 0, 0, 1};
  mount->read_numbers("translation_m", Need::Required, p_m);
  mount->read_numbers("rotation_xyzw", Need::Required, q);
  mount->close_partly();
  const glm::dquat rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(glm::length(rotation) - 1) > 1e-6) {
    faults.add(mount->node(), "rotation_xyzw", "must have length 1, but has {}",
               glm::length(rotation));
  }
  return {rotation, {p_m[0], p_m[1], p_m[2]}};
}

RecordedCalibration read_camera_calibration(const std::filesystem::path& path) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  RecordedCalibration told;
  std::array<double, 2> size_px{};
  root.read_text("model", Need::Optional, told.model);
  told.X_BC = read_mount(root, "X_BC", faults);
  root.read_numbers("size_px", Need::Required, size_px, pixels_rule);
  root.read_number("exposure_s", Need::Required, told.exposure_s, time_rule);
  root.read_number("row_s", Need::Required, told.row_s, time_rule);
  if (const yaml::Node* lens = root.find("lens", Need::Required))
    told.lens = read_lens(*lens, path, faults).model;
  root.close_partly();
  faults.throw_if_any();
  told.size_px = {static_cast<int>(size_px[0]), static_cast<int>(size_px[1])};
  return told;
}

}  // namespace groundray
