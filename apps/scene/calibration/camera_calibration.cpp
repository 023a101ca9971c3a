#include "apps/scene/calibration/camera_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "apps/scene/calibration/calibration_reader.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/io/text_lines.h"
#include "core/near_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
namespace calibration = yaml::calibration;
namespace kind = yaml::calibration::kind;
using yaml::Faults;
using yaml::Node;

// Model of COLMAP, with the names of its parameters.
struct ColmapModel {
  std::string_view name;
  std::string_view parameters;
  std::size_t model;
};
// Source: COLMAP, src/colmap/sensor/models.
constexpr ColmapModel colmap_models[] = {
    {"SIMPLE_PINHOLE", "f cx cy", kind::pinhole},
    {"PINHOLE", "fx fy cx cy", kind::pinhole},
    {"SIMPLE_RADIAL", "f cx cy k", kind::brown_conrady},
    {"RADIAL", "f cx cy k1 k2", kind::brown_conrady},
    {"OPENCV", "fx fy cx cy k1 k2 p1 p2", kind::brown_conrady},
    {"FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6", kind::brown_conrady},
    {"OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4", kind::kannala_brandt},
    {"SIMPLE_RADIAL_FISHEYE", "f cx cy k", kind::kannala_brandt},
    {"RADIAL_FISHEYE", "f cx cy k1 k2", kind::kannala_brandt},
    {"SIMPLE_FISHEYE", "f cx cy", kind::kannala_brandt},
    {"FISHEYE", "fx fy cx cy", kind::kannala_brandt},
    {"EUCM", "fx fy cx cy alpha beta", kind::eucm},
    {"EQUIRECTANGULAR", "w h", kind::equirectangular},
};

// COLMAP's first pixel centre is 0.5, so its principal point is half a pixel larger than
// groundray's.
LensModel colmap_lens(const ColmapModel& model, const std::vector<double>& p) {
  if (model.model == kind::equirectangular) return Equirectangular{{p[0], p[1]}};
  const std::size_t centre = model.parameters.starts_with("f ") ? 1 : 2;
  const PixelScale scale{{p[0], p[centre - 1]}, {p[centre] - 0.5, p[centre + 1] - 0.5}, 0};
  const std::vector<double> k(p.begin() + static_cast<std::ptrdiff_t>(centre) + 2, p.end());
  if (model.model == kind::pinhole) return Pinhole{scale};
  if (model.model == kind::eucm) return Eucm{scale, k[0], k[1]};
  if (model.model == kind::brown_conrady) return calibration::brown_conrady(scale, k);
  return KannalaBrandt{scale, calibration::four_of(k)};
}

// Reads a line of cameras.txt: number, model, width, height, parameters.
void read_colmap_line(const std::vector<std::string_view>& words, const Node& at,
                      std::vector<CameraCalibration>& cameras, Faults& faults) {
  const auto* const model = words.size() < 2
                                ? std::end(colmap_models)
                                : std::ranges::find(colmap_models, words[1], &ColmapModel::name);
  if (model == std::end(colmap_models)) {
    std::vector<std::string> names;
    for (const ColmapModel& known : colmap_models) names.emplace_back(known.name);
    const std::string word(words.size() < 2 ? "" : words[1]);
    return faults.add(at, "", "the model '{}' must be one of {}{}", word, fmt::join(names, ", "),
                      suggestion(word, names));
  }
  const std::size_t count = words_of(model->parameters).size();
  std::vector<double> numbers;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto number = number_of<double>(words[i]);
    if (!number || !std::isfinite(*number))
      return faults.add(at, "", "'{}' must be a finite number", words[i].substr(0, 40));
    numbers.push_back(*number);
  }
  if (numbers.size() != count + 2)
    return faults.add(at, "", "{} has {} numbers, but must have {}: width height {}", model->name,
                      numbers.size(), count + 2, model->parameters);
  CameraCalibration camera{.name = std::string(words[0])};
  camera.size_px = {numbers[0], numbers[1]};
  if (!(numbers[0] >= 1 && numbers[1] >= 1 &&
        glm::dvec2(camera.size_px) == glm::dvec2(numbers[0], numbers[1])))
    return faults.add(at, "", "the size {} x {} must be whole numbers of pixels", numbers[0],
                      numbers[1]);
  camera.model = colmap_lens(*model, {numbers.begin() + 2, numbers.end()});
  calibration::check(camera.model, at, faults);
  cameras.push_back(camera);
}

std::vector<CameraCalibration> read_colmap(std::string_view text, Faults& faults) {
  std::vector<CameraCalibration> cameras;
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const auto words = words_of(*line);
    if (words.empty() || words[0].starts_with('#')) continue;
    Node at;
    at.line = static_cast<int>(lines.number());
    read_colmap_line(words, at, cameras, faults);
  }
  return cameras;
}

// True if the first line that is not a comment begins with a number and a word in capitals.
bool is_colmap(std::string_view text) {
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const auto words = words_of(*line);
    if (words.empty() || words[0].starts_with('#')) continue;
    return words.size() >= 4 && number_of<int>(words[0]) &&
           words[1].find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789") ==
               std::string_view::npos;
  }
  return false;
}

// Returns the tree of an element; blanks separate the items of a list.
Node tree_of(const tinyxml2::XMLElement& element) {
  Node node;
  node.line = element.GetLineNum();
  for (const auto* child = element.FirstChildElement(); child;
       child = child->NextSiblingElement()) {
    node.kind = Node::Kind::Map;
    node.items.push_back(
        {.kind = Node::Kind::Plain, .line = child->GetLineNum(), .text = child->Name()});
    node.items.push_back(tree_of(*child));
  }
  if (node.kind == Node::Kind::Map) return node;
  std::string text = element.GetText() ? element.GetText() : "";
  std::ranges::replace(text, '\n', ' ');
  for (const std::string_view word : words_of(text))
    node.items.push_back({.kind = Node::Kind::Plain, .line = node.line, .text = std::string(word)});
  if (node.items.size() == 1) return Node(node.items[0]);
  if (!node.items.empty()) node.kind = Node::Kind::List;
  return node;
}

std::vector<CameraCalibration> read_xml(std::string_view text, const fs::path& path,
                                        Faults& faults) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw Error("{}:{}: not XML: {}", path.string(), document.ErrorLineNum(), document.ErrorName());
  const tinyxml2::XMLElement* root = document.FirstChildElement("opencv_storage");
  if (!root)
    throw Error("{}: the element opencv_storage is missing: is it a file of OpenCV?",
                path.string());
  return calibration::read_opencv(tree_of(*root), faults);
}

std::vector<CameraCalibration> read_tree(std::string text, const fs::path& path, Faults& faults) {
  // OpenCV's directive has a colon, which YAML does not allow.
  const bool is_opencv = text.starts_with("%YAML:");
  if (is_opencv) text[0] = '#';
  const Node root = yaml::parse(text, path);
  const auto has = [&](std::string_view key) {
    if (root.kind != Node::Kind::Map) return false;
    for (std::size_t i = 0; i < root.items.size(); i += 2)
      if (root.items[i].text == key) return true;
    return false;
  };
  if (has("cam0")) return calibration::read_kalibr(root, faults);
  if (has("value0")) return calibration::read_basalt(root, faults);
  if (has("distortion_model")) return calibration::read_ros(root, faults);
  if (is_opencv || text.find("!!opencv-matrix") != std::string::npos)
    return calibration::read_opencv(root, faults);
  faults.add(root, "",
             "not a camera calibration: it has none of the keys cam0 (Kalibr), value0 (basalt), "
             "distortion_model (ROS), and is not of OpenCV or COLMAP");
  return {};
}

}  // namespace

std::vector<CameraCalibration> parse_camera_calibrations(std::string_view text,
                                                         const fs::path& path) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  Faults faults(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) throw Error("{}:1:1: the file is empty", path.string());
  auto cameras = text[first] == '<' ? read_xml(text, path, faults)
                 : is_colmap(text)  ? read_colmap(text, faults)
                                    : read_tree(std::string(text), path, faults);
  faults.throw_if_any();
  return cameras;
}

std::vector<CameraCalibration> load_camera_calibrations(const fs::path& path) {
  return parse_camera_calibrations(yaml::read_file(path), path);
}

}  // namespace groundray
