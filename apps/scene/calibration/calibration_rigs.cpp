#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <span>

#include "apps/scene/calibration/calibration_reader.h"
#include "core/near_names.h"

// Readers of files with several cameras and their poses.
namespace groundray::yaml::calibration {
namespace {

// Reads a pose from the rows of a 4 x 4 matrix.
std::optional<Pose> pose_of(const Node& node, std::string_view key, Faults& faults) {
  glm::dmat3 turn(0);
  Pose pose;
  if (node.kind != Node::Kind::List || node.items.size() != 4) {
    faults.add(node, key, "is {}, but must be a list of 4 rows", shown(node));
    return std::nullopt;
  }
  for (int row = 0; row < 4; ++row) {
    std::array<double, 4> values{};
    if (!numbers(node.items[static_cast<std::size_t>(row)], key, values, any_number, faults))
      return std::nullopt;
    if (row == 3 && values != std::array<double, 4>{0, 0, 0, 1})
      faults.add(node.items[3], key, "must end with the row 0 0 0 1");
    if (row == 3) break;
    for (int column = 0; column < 3; ++column)
      turn[column][row] = values[static_cast<std::size_t>(column)];
    pose.translation_m[row] = values[3];
  }
  // Files often hold only a few decimals.
  const glm::dmat3 off = glm::transpose(turn) * turn - glm::dmat3(1);
  const double worst = std::max({glm::length(off[0]), glm::length(off[1]), glm::length(off[2])});
  if (!(worst < 1e-3 && glm::determinant(turn) > 0)) {
    faults.add(node, key,
               "must have a rotation in its upper left corner, but deviates from one by {:.2g}",
               worst);
    return std::nullopt;
  }
  pose.rotation = glm::normalize(glm::quat_cast(turn));
  return pose;
}

LensModel kalibr_pinhole(Map& map, Faults& faults) {
  const auto i = numbers_at(map, "intrinsics", {"f_u", "f_v", "c_u", "c_v"}, faults);
  const std::string distortion = text_at(map, "distortion_model", faults);
  const PixelScale scale = i.empty() ? PixelScale{} : PixelScale{{i[0], i[1]}, {i[2], i[3]}, 0};
  if (distortion == "none" || distortion.empty()) return Pinhole{scale};
  if (distortion == "radtan")
    return brown_conrady(scale,
                         numbers_at(map, "distortion_coeffs", {"k1", "k2", "p1", "p2"}, faults));
  if (distortion == "equidistant" || distortion == "equi")
    return KannalaBrandt{
        scale, four_of(numbers_at(map, "distortion_coeffs", {"k1", "k2", "k3", "k4"}, faults))};
  faults.add(*map.find("distortion_model", Need::Optional), "distortion_model",
             "is '{}', but must be one of radtan, equidistant, none{}", distortion,
             suggestion(distortion, {"radtan", "equidistant", "none"}));
  return Pinhole{scale};
}

LensModel kalibr_model(Map& map, Faults& faults) {
  const std::string model = text_at(map, "camera_model", faults);
  if (model.empty()) return Pinhole{};
  if (model == "pinhole") return kalibr_pinhole(map, faults);
  if (model == "omni") {
    const auto i = numbers_at(map, "intrinsics", {"xi", "f_u", "f_v", "c_u", "c_v"}, faults);
    const std::string distortion = text_at(map, "distortion_model", faults);
    std::array<double, 4> k{};
    if (distortion == "radtan") {
      k = four_of(numbers_at(map, "distortion_coeffs", {"k1", "k2", "p1", "p2"}, faults));
    } else if (!distortion.empty() && distortion != "none") {
      faults.add(*map.find("distortion_model", Need::Optional), "distortion_model",
                 "is '{}', but for omni must be radtan or none", distortion);
    }
    return i.empty() ? Mei{} : Mei{{{i[1], i[2]}, {i[3], i[4]}, 0}, i[0], k};
  }
  if (model == "eucm") {
    const auto i =
        numbers_at(map, "intrinsics", {"alpha", "beta", "f_u", "f_v", "c_u", "c_v"}, faults);
    return i.empty() ? Eucm{} : Eucm{{{i[2], i[3]}, {i[4], i[5]}, 0}, i[0], i[1]};
  }
  if (model == "ds") {
    const auto i =
        numbers_at(map, "intrinsics", {"xi", "alpha", "f_u", "f_v", "c_u", "c_v"}, faults);
    return i.empty() ? DoubleSphere{} : DoubleSphere{{{i[2], i[3]}, {i[4], i[5]}, 0}, i[0], i[1]};
  }
  faults.add(*map.find("camera_model", Need::Optional), "camera_model",
             "is '{}', but must be one of pinhole, omni, eucm, ds{}", model,
             suggestion(model, {"pinhole", "omni", "eucm", "ds"}));
  return Pinhole{};
}

LensModel basalt_model(const Node& node, Faults& faults) {
  Map map(node, "intrinsics", faults);
  const std::string type = text_at(map, "camera_type", faults);
  const Node* values = required(map, "intrinsics", faults);
  if (type.empty() || !values) return Pinhole{};
  Map intrinsics(*values, "intrinsics", faults);
  const auto value = [&](const char* key) {
    double number = 0;
    if (required(intrinsics, key, faults)) intrinsics.read_number(key, Need::Optional, number);
    return number;
  };
  const PixelScale scale{{value("fx"), value("fy")}, {value("cx"), value("cy")}, 0};
  if (type == "pinhole") return Pinhole{scale};
  if (type == "kb4")
    return KannalaBrandt{scale, {value("k1"), value("k2"), value("k3"), value("k4")}};
  if (type == "pinhole-radtan8")
    return brown_conrady(scale, {value("k1"), value("k2"), value("p1"), value("p2"), value("k3"),
                                 value("k4"), value("k5"), value("k6")});
  if (type == "ucm") return Eucm{scale, value("alpha"), 1};
  if (type == "eucm") return Eucm{scale, value("alpha"), value("beta")};
  if (type == "ds") return DoubleSphere{scale, value("xi"), value("alpha")};
  faults.add(*map.find("camera_type", Need::Optional), "camera_type",
             "is '{}', but must be one of pinhole, pinhole-radtan8, kb4, ucm, eucm, ds", type);
  return Pinhole{};
}

std::optional<Pose> basalt_pose(const Node& node, Faults& faults) {
  Map map(node, "T_imu_cam", faults);
  std::array<double, 7> v{};
  std::size_t i = 0;
  for (const char* key : {"px", "py", "pz", "qw", "qx", "qy", "qz"}) {
    if (required(map, key, faults)) map.read_number(key, Need::Optional, v[i]);
    ++i;
  }
  const glm::dquat turn(v[3], v[4], v[5], v[6]);
  if (!(std::abs(glm::length(turn) - 1) < 1e-3)) {
    faults.add(node, "T_imu_cam", "must have a quaternion of norm 1, not {}", glm::length(turn));
    return std::nullopt;
  }
  return Pose{glm::normalize(turn), {v[0], v[1], v[2]}};
}

}  // namespace

std::vector<CameraCalibration> read_kalibr(const Node& root, Faults& faults) {
  Map map(root, "", faults);
  std::vector<CameraCalibration> cameras;
  while (const Node* node = map.find(fmt::format("cam{}", cameras.size()), Need::Optional)) {
    CameraCalibration camera;
    camera.name = fmt::format("cam{}", cameras.size());
    Map entry(*node, camera.name, faults);
    const std::size_t before = faults.count();
    camera.model = kalibr_model(entry, faults);
    if (faults.count() == before) check(camera.model, *node, faults);
    if (const Node* size = required(entry, "resolution", faults))
      camera.size_px = size_of(*size, "resolution", faults);
    if (const Node* pose = entry.find("T_cam_imu", Need::Optional)) {
      if (const auto X_CI = pose_of(*pose, "T_cam_imu", faults)) camera.X_IC = inverse(*X_CI);
    } else if (const Node* back = entry.find("T_imu_cam", Need::Optional)) {
      camera.X_IC = pose_of(*back, "T_imu_cam", faults);
    }
    if (const Node* pose = entry.find("T_cn_cnm1", Need::Optional); pose && !cameras.empty()) {
      if (cameras.size() == 1) cameras[0].X_FC = Pose{};
      const auto X_CD = pose_of(*pose, "T_cn_cnm1", faults);
      if (X_CD && cameras.back().X_FC) camera.X_FC = *cameras.back().X_FC * inverse(*X_CD);
    }
    entry.read_number("timeshift_cam_imu", Need::Optional, camera.time_shift_s);
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<CameraCalibration> read_basalt(const Node& root, Faults& faults) {
  Map map(root, "", faults);
  const Node* node = required(map, "value0", faults);
  if (!node) return {};
  Map calibration(*node, "value0", faults);
  std::array<std::span<const Node>, 3> lists;
  std::size_t i = 0;
  for (const char* key : {"intrinsics", "resolution", "T_imu_cam"}) {
    if (required(calibration, key, faults)) lists[i] = calibration.list(key, Need::Optional);
    ++i;
  }
  const auto& [intrinsics, sizes, poses] = lists;
  if (intrinsics.size() != sizes.size() || intrinsics.size() != poses.size())
    faults.add(*node, "value0", "has {} intrinsics, {} resolutions and {} poses", intrinsics.size(),
               sizes.size(), poses.size());
  std::vector<CameraCalibration> cameras;
  for (std::size_t n = 0; n < std::min({intrinsics.size(), sizes.size(), poses.size()}); ++n) {
    CameraCalibration camera;
    camera.name = fmt::format("cam{}", n);
    const std::size_t before = faults.count();
    camera.model = basalt_model(intrinsics[n], faults);
    if (faults.count() == before) check(camera.model, intrinsics[n], faults);
    camera.size_px = size_of(sizes[n], "resolution", faults);
    camera.X_IC = basalt_pose(poses[n], faults);
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace groundray::yaml::calibration
