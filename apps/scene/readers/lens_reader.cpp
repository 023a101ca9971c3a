#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>

#include "apps/scene/calibration/calibration_reader.h"
#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/readers/readers.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

// Reads the keys of a lens model.
class LensKeys {
 public:
  LensKeys(Map& map, Faults& faults) : map_(map), faults_(faults) {}

  void scale(PixelScale& scale) {
    pair("focal_px", scale.focal_px, positive);
    pair("centre_px", scale.centre_px, any_number);
    map_.read_number("skew", Need::Optional, scale.skew);
  }
  void number(std::string_view key, double& value, Rule rule) {
    map_.read_number(key, Need::Required, value, rule);
  }
  void pair(std::string_view key, glm::dvec2& value, Rule rule) {
    map_.read_vector(key, Need::Required, value, rule);
  }
  void linear(glm::dvec3& value) { map_.read_vector("linear", Need::Optional, value); }
  void polynomial(FTheta::Polynomial& value) {
    map_.read_choice("polynomial", Need::Required, value, {"angle_to_pixels", "pixels_to_angle"});
  }
  // Reads coefficients whose number must be among `counts`.
  template <std::size_t n>
  void coefficients(std::array<double, n>& k, Need need, std::initializer_list<std::size_t> counts,
                    std::string_view order) {
    std::ranges::copy(read_coefficients(need, counts, order), k.begin());
  }
  void coefficients(std::vector<double>& k, Need need, std::initializer_list<std::size_t> counts,
                    std::string_view order) {
    k = read_coefficients(need, counts, order);
  }

 private:
  // Returns none at a fault. Any number of coefficients is valid if `counts` is empty.
  std::vector<double> read_coefficients(Need need, std::initializer_list<std::size_t> counts,
                                        std::string_view order) {
    constexpr std::string_view key = "coefficients";
    const Node* const node = map_.find(key, need);
    if (!node) return {};
    if (node->kind != Node::Kind::List) {
      faults_.add(*node, key, "is {}, but must be a list: {}", shown(*node), order);
      return {};
    }
    std::vector<double> k = calibration::list_of(*node, key, faults_);
    if (k.size() != node->items.size()) return {};  // one of them is not a number
    if (counts.size() == 0 || std::ranges::count(counts, k.size()) > 0) return k;
    faults_.add(*node, key, "has {} numbers, but its model has {}", k.size(), order);
    return {};
  }

  Map& map_;
  Faults& faults_;
};

// Writes the keys of a lens model.
class LensText {
 public:
  void scale(const PixelScale& scale) {
    pair("focal_px", scale.focal_px);
    pair("centre_px", scale.centre_px);
    number("skew", scale.skew);
  }
  void number(std::string_view key, double value, Rule = any_number) {
    keys_.push_back(fmt::format("{}: {}", key, value));
  }
  void pair(std::string_view key, const glm::dvec2& value, Rule = any_number) {
    keys_.push_back(fmt::format("{}: [{}, {}]", key, value.x, value.y));
  }
  void linear(const glm::dvec3& value) {
    keys_.push_back(fmt::format("linear: [{}, {}, {}]", value.x, value.y, value.z));
  }
  void polynomial(FTheta::Polynomial value) {
    const bool from_angle = value == FTheta::Polynomial::AngleToPixels;
    keys_.push_back(
        fmt::format("polynomial: {}", from_angle ? "angle_to_pixels" : "pixels_to_angle"));
  }
  void coefficients(std::span<const double> k, Need, std::initializer_list<std::size_t>,
                    std::string_view) {
    keys_.push_back(fmt::format("coefficients: [{}]", fmt::join(k, ", ")));
  }
  std::string text(std::string_view name) const {
    return fmt::format("{}: {{{}}}", name, fmt::join(keys_, ", "));
  }

 private:
  std::vector<std::string> keys_;
};

// Lists the keys of each model, in the order in which they are written.
template <typename Keys>
struct ListKeys {
  Keys& keys;

  void operator()(Pinhole& lens) const { keys.scale(lens.scale); }
  void operator()(BrownConrady& lens) const {
    keys.scale(lens.scale);
    keys.coefficients(
        lens.k, Need::Required, {4, 5, 8, 12, 14},
        "k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]], so 4, 5, 8, 12 or 14");
  }
  void operator()(KannalaBrandt& lens) const {
    keys.scale(lens.scale);
    keys.coefficients(lens.k, Need::Required, {4}, "4: k1 k2 k3 k4");
  }
  void operator()(FTheta& lens) const {
    keys.pair("centre_px", lens.centre_px, any_number);
    keys.polynomial(lens.direction);
    keys.coefficients(lens.k, Need::Required, {}, "those of the first power, the second and so on");
    keys.linear(lens.linear);
  }
  void operator()(Eucm& lens) const {
    keys.scale(lens.scale);
    keys.number("alpha", lens.alpha, share_rule);
    keys.number("beta", lens.beta, positive);
  }
  void operator()(DoubleSphere& lens) const {
    keys.scale(lens.scale);
    keys.number("xi", lens.xi, any_number);
    keys.number("alpha", lens.alpha, share_rule);
  }
  void operator()(Mei& lens) const {
    keys.scale(lens.scale);
    keys.number("xi", lens.xi, not_negative);
    keys.coefficients(lens.k, Need::Optional, {4}, "4: k1 k2 p1 p2");
  }
  void operator()(Equirectangular& /*lens*/) const {}  // its size is set by Lens
};

template <typename Model>
LensModel read_keys(LensKeys& keys) {
  Model model;
  ListKeys<LensKeys>{keys}(model);
  return model;
}

LensModel read_ucm(LensKeys& keys) {
  Eucm model;
  keys.scale(model.scale);
  keys.number("alpha", model.alpha, share_rule);
  return model;
}

struct NamedModel {
  std::string_view name;
  LensModel (*read)(LensKeys& keys);
};
constexpr std::array<NamedModel, 9> models{{{"pinhole", read_keys<Pinhole>},
                                            {"brown_conrady", read_keys<BrownConrady>},
                                            {"kannala_brandt", read_keys<KannalaBrandt>},
                                            {"f_theta", read_keys<FTheta>},
                                            {"eucm", read_keys<Eucm>},
                                            {"ucm", read_ucm},
                                            {"double_sphere", read_keys<DoubleSphere>},
                                            {"mei", read_keys<Mei>},
                                            {"equirectangular", read_keys<Equirectangular>}}};

// Reads the one model of a map, and marks the names of all models as known keys.
LensModel read_lens_model(Map& lens, Faults& faults) {
  LensModel result;
  std::vector<std::string_view> found, names;
  for (const NamedModel& model : models) {
    names.push_back(model.name);
    const std::size_t before = faults.count();
    auto map = lens.map(model.name, Need::Optional);
    if (!map) continue;
    found.push_back(model.name);
    LensKeys keys(*map, faults);
    result = model.read(keys);
    map->close();
    Violations broken("its model");
    check_lens(result, broken);
    try {
      if (faults.count() == before) broken.throw_if_any();
    } catch (const Error& fault) {
      faults.add(map->node(), model.name, "{}", fault.what());
    }
  }
  // If there is no model but another key, close() reports that key as unknown instead.
  if (found.size() > 1 || lens.node().items.empty()) {
    faults.add(lens.node(), "lens",
               "has {} models, but must have exactly one of {}, or 'calibration'", found.size(),
               fmt::join(names, ", "));
  }
  return result;
}

CameraFileLens read_calibrated(Map& lens, const Node& file, const fs::path& path, Faults& faults) {
  std::string name;
  const Node* const named = lens.read_text("camera", Need::Optional, name);
  if (!is_text(file, "calibration", faults)) return {};
  try {
    const auto cameras = load_camera_calibrations(beside(path, file.text));
    std::vector<std::string> names;
    for (const CameraCalibration& camera : cameras) {
      if (camera.name == name || (!named && cameras.size() == 1))
        return {camera.model, camera.size_px};
      names.push_back(camera.name);
    }
    if (named) {
      faults.add(*named, "camera", "is '{}', but the calibration has {}{}", name,
                 fmt::join(names, ", "), suggestion(name, names));
    } else {
      faults.add(file, "calibration", "has {} cameras: choose one with 'camera': {}",
                 cameras.size(), fmt::join(names, ", "));
    }
  } catch (const Error& fault) {
    faults.add(file, "calibration", "cannot be read:\n{}", fault.what());
  }
  return {};
}

}  // namespace

CameraFileLens read_lens(const Node& node, const fs::path& path, Faults& faults) {
  Map lens(node, "lens", faults);
  if (node.kind != Node::Kind::Map) return {};
  CameraFileLens result;
  if (const Node* file = lens.find("calibration", Need::Optional)) {
    result = read_calibrated(lens, *file, path, faults);
  } else {
    result.model = read_lens_model(lens, faults);
  }
  lens.close();
  return result;
}

}  // namespace groundray::yaml

namespace groundray {

std::string lens_text(const LensModel& lens) {
  return std::visit(
      []<typename Model>(Model kind) {
        yaml::LensText keys;
        yaml::ListKeys<yaml::LensText>{keys}(kind);
        LensModel (*const read)(yaml::LensKeys&) = yaml::read_keys<Model>;
        return keys.text(std::ranges::find(yaml::models, read, &yaml::NamedModel::read)->name);
      },
      lens);
}

}  // namespace groundray
