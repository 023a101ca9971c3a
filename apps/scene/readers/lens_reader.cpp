#include "apps/scene/readers/lens_reader.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/calibration/calibration_fields.h"
#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/readers/pattern_reader.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::not_negative;
using yaml::positive;
using yaml::Rule;
using yaml::share_rule;

glm::dvec2 read_required_pair(Map& map, std::string_view key, Rule rule) {
  std::array<double, 2> pair{};
  map.read_numbers(key, Need::Required, pair, rule);
  return {pair[0], pair[1]};
}

PixelScale read_scale(Map& map) {
  PixelScale scale{read_required_pair(map, "focal_px", positive),
                   read_required_pair(map, "centre_px", yaml::any_number)};
  map.read_number("skew", Need::Optional, scale.skew);
  return scale;
}

// Returns the coefficients if their number is among `counts`, or if that is empty; none at a fault.
std::vector<double> read_coefficients(Map& map, Need need,
                                      std::initializer_list<std::size_t> counts,
                                      std::string_view order, Faults& faults) {
  constexpr std::string_view key = "coefficients";
  const Node* const node = map.find(key, need);
  if (!node) return {};
  if (node->kind != Node::Kind::List) {
    faults.add(*node, key, "is {}, but must be a list: {}", yaml::shown(*node), order);
    return {};
  }
  std::vector<double> k = calibration::list_of(*node, key, faults);
  if (k.size() != node->items.size()) return {};  // one of them is not a number
  if (counts.size() == 0 || std::ranges::count(counts, k.size()) > 0) return k;
  faults.add(*node, key, "has {} numbers, but its model has {}", k.size(), order);
  return {};
}

LensModel read_pinhole(Map& map, Faults& /*faults*/) { return Pinhole{read_scale(map)}; }

LensModel read_brown_conrady(Map& map, Faults& faults) {
  BrownConrady model{.scale = read_scale(map)};
  const auto k = read_coefficients(
      map, Need::Required, {4, 5, 8, 12, 14},
      "k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]], so 4, 5, 8, 12 or 14", faults);
  std::ranges::copy(k, model.k.begin());
  return model;
}

LensModel read_kannala_brandt(Map& map, Faults& faults) {
  const PixelScale scale = read_scale(map);
  return KannalaBrandt{scale, calibration::four_of(read_coefficients(map, Need::Required, {4},
                                                                     "4: k1 k2 k3 k4", faults))};
}

LensModel read_f_theta(Map& map, Faults& faults) {
  FTheta model{.centre_px = read_required_pair(map, "centre_px", yaml::any_number), .k = {}};
  map.read_choice<FTheta::Polynomial>("polynomial", Need::Required, model.direction,
                                      {{"angle_to_pixels", FTheta::Polynomial::AngleToPixels},
                                       {"pixels_to_angle", FTheta::Polynomial::PixelsToAngle}});
  model.k = read_coefficients(map, Need::Required, {},
                              "those of the first power, the second and so on", faults);
  std::array<double, 3> linear{1, 0, 0};
  map.read_numbers("linear", Need::Optional, linear);
  model.linear = {linear[0], linear[1], linear[2]};
  return model;
}

LensModel read_eucm(Map& map, Faults& /*faults*/) {
  Eucm model{.scale = read_scale(map)};
  map.read_number("alpha", Need::Required, model.alpha, share_rule);
  map.read_number("beta", Need::Required, model.beta, positive);
  return model;
}

LensModel read_ucm(Map& map, Faults& /*faults*/) {
  Eucm model{.scale = read_scale(map)};
  map.read_number("alpha", Need::Required, model.alpha, share_rule);
  return model;
}

LensModel read_double_sphere(Map& map, Faults& /*faults*/) {
  DoubleSphere model{.scale = read_scale(map)};
  map.read_number("xi", Need::Required, model.xi);
  map.read_number("alpha", Need::Required, model.alpha, share_rule);
  return model;
}

LensModel read_mei(Map& map, Faults& faults) {
  Mei model{.scale = read_scale(map)};
  map.read_number("xi", Need::Required, model.xi, not_negative);
  model.k =
      calibration::four_of(read_coefficients(map, Need::Optional, {4}, "4: k1 k2 p1 p2", faults));
  return model;
}

// The size is set by Lens.
LensModel read_equirectangular(Map& /*map*/, Faults& /*faults*/) { return Equirectangular{}; }

struct NamedModel {
  std::string_view name;
  LensModel (*read)(Map& map, Faults& faults);
};
constexpr std::array<NamedModel, 9> models{{{"pinhole", read_pinhole},
                                            {"brown_conrady", read_brown_conrady},
                                            {"kannala_brandt", read_kannala_brandt},
                                            {"f_theta", read_f_theta},
                                            {"eucm", read_eucm},
                                            {"ucm", read_ucm},
                                            {"double_sphere", read_double_sphere},
                                            {"mei", read_mei},
                                            {"equirectangular", read_equirectangular}}};

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
    result = model.read(*map, faults);
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
  if (!yaml::is_text(file, "calibration", faults)) return {};
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
                 fmt::join(names, ", "), yaml::suggestion(name, names));
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

}  // namespace groundray
