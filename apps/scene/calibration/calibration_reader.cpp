#include "apps/scene/calibration/calibration_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/error.h"
#include "core/near_names.h"

namespace groundray::yaml::calibration {
namespace {

constexpr const char* order_words =
    "k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]], so 4, 5, 8, 12 or 14";

// Returns the data of a matrix, which is a map of rows, cols and data; empty at a fault.
std::vector<double> matrix_at(Map& map, std::string_view key, Faults& faults) {
  const Node* node = map.find(key, Need::Optional);
  if (!node) return {};
  Map matrix(*node, key, faults);
  double rows = 0, columns = 0;
  if (node->kind == Node::Kind::Map) {
    if (required(matrix, "rows", faults)) matrix.read_number("rows", Need::Optional, rows);
    if (required(matrix, "cols", faults)) matrix.read_number("cols", Need::Optional, columns);
  }
  const Node* data = required(matrix, "data", faults);
  if (!data) return {};
  std::vector<double> values = list_of(*data, "data", faults);
  if (static_cast<double>(values.size()) == rows * columns) return values;
  faults.add(*data, "data", "has {} numbers, but its rows and cols are {} x {}", values.size(),
             rows, columns);
  return {};
}

enum class Skew { Refused, Kept };

// Returns the scale of a camera matrix.
PixelScale scale_at(Map& map, std::string_view key, Skew skew, Faults& faults) {
  const std::size_t before = faults.count();
  const Node* node = required(map, key, faults);
  const std::vector<double> k = matrix_at(map, key, faults);
  if (!node || faults.count() > before) return {};
  if (k.size() != 9 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    faults.add(*node, key, "must be 3 x 3: f_u 0 c_u, 0 f_v c_v, 0 0 1");
    return {};
  }
  if (skew == Skew::Refused && k[1] != 0)
    faults.add(*node, key, "has a skew of {}, which OpenCV does not support in this model", k[1]);
  return {{k[0], k[4]}, {k[2], k[5]}, k[1] / k[0]};
}

// Returns true if a model can have `count` coefficients; records a fault otherwise.
bool have_count(const Node& node, std::string_view key, std::size_t count,
                std::initializer_list<std::size_t> counts, std::string_view order, Faults& faults) {
  if (std::ranges::count(counts, count) > 0) return true;
  faults.add(node, key, "has {} coefficients, but its model has {}", count, order);
  return false;
}

LensModel ros_model(Map& map, const PixelScale& scale, Faults& faults) {
  const std::vector<double> k = matrix_at(map, "distortion_coefficients", faults);
  const Node* node = required(map, "distortion_coefficients", faults);
  const std::string model = text_at(map, "distortion_model", faults);
  if (!node || model.empty()) return Pinhole{scale};
  constexpr const char* key = "distortion_coefficients";
  if (model == "plumb_bob") {
    if (have_count(*node, key, k.size(), {4, 5}, "5: k1 k2 p1 p2 k3", faults))
      return brown_conrady(scale, k);
  } else if (model == "rational_polynomial") {
    if (have_count(*node, key, k.size(), {8, 12, 14}, "8: k1 k2 p1 p2 k3 k4 k5 k6", faults))
      return brown_conrady(scale, k);
  } else if (model == "equidistant") {
    if (have_count(*node, key, k.size(), {4}, "4: k1 k2 k3 k4", faults))
      return KannalaBrandt{scale, four_of(k)};
  } else {
    faults.add(*map.find("distortion_model", Need::Optional), "distortion_model",
               "is '{}', but must be one of plumb_bob, rational_polynomial, equidistant{}", model,
               suggestion(model, {"plumb_bob", "rational_polynomial", "equidistant"}));
  }
  return Pinhole{scale};
}

// Returns the first of the keys that is present, or "".
std::string_view present(Map& map, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (map.find(key, Need::Optional)) return key;
  }
  return "";
}

CameraCalibration opencv_camera(Map& map, std::string_view matrix_key,
                                std::string_view coefficients_key, Faults& faults) {
  CameraCalibration camera;
  double is_fisheye = 0, xi = 0;
  map.read_number("fisheye_model", Need::Optional, is_fisheye);
  const bool is_omni = map.read_number("xi", Need::Optional, xi);
  const PixelScale scale = scale_at(map, matrix_key, is_omni ? Skew::Kept : Skew::Refused, faults);
  camera.model = Pinhole{scale};
  if (coefficients_key.empty()) return camera;
  const std::vector<double> k = matrix_at(map, coefficients_key, faults);
  const Node& node = *map.find(coefficients_key, Need::Optional);
  if (is_omni) {
    if (have_count(node, coefficients_key, k.size(), {4}, "4: k1 k2 p1 p2", faults))
      camera.model = Mei{scale, xi, four_of(k)};
  } else if (is_fisheye != 0) {
    if (have_count(node, coefficients_key, k.size(), {4}, "4: k1 k2 k3 k4", faults))
      camera.model = KannalaBrandt{scale, four_of(k)};
  } else if (have_count(node, coefficients_key, k.size(), {0, 4, 5, 8, 12, 14}, order_words,
                        faults)) {
    camera.model = brown_conrady(scale, k);
  }
  return camera;
}

}  // namespace

const Node* required(Map& map, std::string_view key, Faults& faults) {
  const Node* node = map.find(key, Need::Optional);
  if (!node && map.node().kind == Node::Kind::Map) faults.add(map.node(), key, "missing");
  return node;
}

std::string text_at(Map& map, std::string_view key, Faults& faults) {
  const Node* node = required(map, key, faults);
  return node && is_text(*node, key, faults) ? node->text : "";
}

std::vector<double> list_of(const Node& node, std::string_view key, Faults& faults) {
  std::vector<double> values;
  const std::span<const Node> items =
      node.kind == Node::Kind::List ? std::span(node.items) : std::span(&node, 1);
  if (node.kind == Node::Kind::Null) return values;
  for (const Node& item : items) {
    const auto value = number(item, key, any_number, faults);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

std::vector<double> numbers_at(Map& map, std::string_view key,
                               std::initializer_list<const char*> names, Faults& faults) {
  const Node* node = required(map, key, faults);
  if (!node) return {};
  const std::size_t before = faults.count();
  std::vector<double> values = list_of(*node, key, faults);
  if (values.size() == names.size() || faults.count() > before)
    return values.size() == names.size() ? values : std::vector<double>();
  faults.add(*node, key, "has {} numbers, but must have {}: {}", values.size(), names.size(),
             fmt::join(names, " "));
  return {};
}

int pixels_of(const Node& node, std::string_view key, Faults& faults) {
  const auto value = number(node, key, positive, faults);
  if (!value) return 0;
  if (*value == std::floor(*value) && *value <= 1e6) return static_cast<int>(*value);
  faults.add(node, key, "is {}, but must be a whole number of pixels", node.text);
  return 0;
}

glm::ivec2 size_of(const Node& node, std::string_view key, Faults& faults) {
  if (node.kind == Node::Kind::List && node.items.size() == 2)
    return {pixels_of(node.items[0], key, faults), pixels_of(node.items[1], key, faults)};
  faults.add(node, key, "is {}, but must be a list of width and height", shown(node));
  return {};
}

std::array<double, 4> four_of(const std::vector<double>& k) {
  std::array<double, 4> four{};
  std::copy_n(k.begin(), std::min<std::size_t>(4, k.size()), four.begin());
  return four;
}

void check(const LensModel& model, const Node& node, Faults& faults) {
  Violations broken("lens");
  check_lens(model, broken);
  try {
    broken.throw_if_any();
  } catch (const Error& fault) {
    faults.add(node, "", "{}", fault.what());
  }
}

LensModel brown_conrady(const PixelScale& scale, const std::vector<double>& k) {
  if (std::ranges::all_of(k, [](double value) { return value == 0; })) return Pinhole{scale};
  BrownConrady model{.scale = scale};
  std::ranges::copy(k, model.k.begin());
  return model;
}

std::vector<CameraCalibration> read_ros(const Node& root, Faults& faults) {
  Map map(root, "", faults);
  CameraCalibration camera;
  camera.name = "camera";
  map.read_text("camera_name", Need::Optional, camera.name);
  if (const Node* node = required(map, "image_width", faults))
    camera.size_px.x = pixels_of(*node, "image_width", faults);
  if (const Node* node = required(map, "image_height", faults))
    camera.size_px.y = pixels_of(*node, "image_height", faults);
  const PixelScale scale = scale_at(map, "camera_matrix", Skew::Refused, faults);
  camera.model = ros_model(map, scale, faults);
  if (faults.count() == 0) check(camera.model, root, faults);
  return {camera};
}

std::vector<CameraCalibration> read_opencv(const Node& root, Faults& faults) {
  Map map(root, "", faults);
  glm::ivec2 size_px(0);
  const auto width = present(map, {"image_width", "image_Width", "width"});
  const auto height = present(map, {"image_height", "image_Height", "height"});
  if (!width.empty()) size_px.x = pixels_of(*map.find(width, Need::Optional), width, faults);
  if (!height.empty()) size_px.y = pixels_of(*map.find(height, Need::Optional), height, faults);
  std::vector<CameraCalibration> cameras;
  const auto add = [&](std::string_view matrix, std::string_view coefficients, const char* name) {
    if (matrix.empty()) return;
    cameras.push_back(opencv_camera(map, matrix, coefficients, faults));
    cameras.back().name = name;
    cameras.back().size_px = size_px;
    if (faults.count() == 0) check(cameras.back().model, *map.find(matrix, Need::Optional), faults);
  };
  add(present(map, {"camera_matrix", "Camera_Matrix", "cameraMatrix", "K"}),
      present(map, {"distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D"}),
      "camera");
  add(present(map, {"M1", "K1"}), present(map, {"D1"}), "camera1");
  add(present(map, {"M2", "K2"}), present(map, {"D2"}), "camera2");
  if (cameras.empty())
    faults.add(root, "",
               "contains no camera: none of the matrices camera_matrix, cameraMatrix, K, M1 or M2");
  return cameras;
}

}  // namespace groundray::yaml::calibration
