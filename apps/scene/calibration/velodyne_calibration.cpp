#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "apps/scene/calibration/calibration_io.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
#include "core/math.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

using std::numbers::pi;

struct Laser {
  double id = 0;
  double rotation_rad = 0;
  double elevation_rad = 0;
  double up_m = 0;
  double left_m = 0;
};

// Returns the beam along which the ROS driver computes points: see docs/reference/sensors.md.
Beam beam_of(const Laser& laser) {
  const double a = laser.rotation_rad;
  const double back_m = laser.up_m * math::sin(laser.elevation_rad);
  Beam beam;
  beam.elevation_rad = laser.elevation_rad;
  beam.azimuth_offset_rad = a;
  beam.origin_m = {-back_m * math::cos(a) - laser.left_m * math::sin(a),
                   -back_m * math::sin(a) + laser.left_m * math::cos(a),
                   laser.up_m * math::cos(laser.elevation_rad)};
  return beam;
}

// Sorts lasers by number, and counts rings up from the lowest.
std::vector<Beam> beams_of(std::vector<Laser> lasers) {
  std::ranges::sort(lasers, {}, &Laser::id);
  std::vector<Beam> beams;
  for (const Laser& laser : lasers) beams.push_back(beam_of(laser));
  std::vector<Beam*> rising;
  for (Beam& beam : beams) rising.push_back(&beam);
  std::ranges::stable_sort(rising, {}, [](const Beam* beam) { return beam->elevation_rad; });
  for (std::uint16_t ring = 0; Beam * beam : rising) beam->ring = ring++;
  return beams;
}

constexpr yaml::Rule elevation_rad_rule{[](double value) { return std::abs(value) <= pi / 2; },
                                        "must be in [-pi/2, pi/2]: is it in degrees?"};
constexpr yaml::Rule number_rule{
    [](double value) { return value >= 0 && value < most_beams && value == std::floor(value); },
    "must be a whole number from 0 to 65535"};

// Returns the number in a child element of `px`; 0 if it is missing or invalid.
double read_field(const tinyxml2::XMLElement& px, const char* name, bool required,
                  Violations& broken) {
  const tinyxml2::XMLElement* field = px.FirstChildElement(name);
  if (!field) {
    broken.unless(!required, "line {}: {} is missing in a laser's <px>", px.GetLineNum(), name);
    return 0;
  }
  const char* text = field->GetText();
  const auto words = words_of(text ? text : "");
  const auto value = words.size() == 1 ? number_of<double>(words[0]) : std::nullopt;
  const bool sound = value && std::isfinite(*value);
  broken.unless(sound, "line {}: {} must be a finite number", field->GetLineNum(), name);
  return sound ? *value : 0;
}

// Returns the lasers that `enabled_` switches off.
std::set<double> disabled_lasers(const tinyxml2::XMLElement& db) {
  std::set<double> disabled;
  const tinyxml2::XMLElement* list = db.FirstChildElement("enabled_");
  if (!list) return disabled;
  double laser = 0;
  for (const auto* item = list->FirstChildElement("item"); item;
       item = item->NextSiblingElement("item"), ++laser) {
    if (item->IntText(1) == 0) disabled.insert(laser);
  }
  return disabled;
}

Laser read_px(const tinyxml2::XMLElement& px, Violations& broken) {
  constexpr double metres_per_cm = 0.01;
  Laser laser;
  laser.id = read_field(px, "id_", true, broken);
  laser.rotation_rad = glm::radians(read_field(px, "rotCorrection_", true, broken));
  laser.elevation_rad = glm::radians(read_field(px, "vertCorrection_", true, broken));
  laser.up_m = metres_per_cm * read_field(px, "vertOffsetCorrection_", false, broken);
  laser.left_m = metres_per_cm * read_field(px, "horizOffsetCorrection_", false, broken);
  broken.unless(number_rule.holds(laser.id), "line {}: id_ = {} {}", px.GetLineNum(), laser.id,
                number_rule.words);
  broken.unless(elevation_rad_rule.holds(laser.elevation_rad),
                "line {}: vertCorrection_ must be from -90 to 90 degrees", px.GetLineNum());
  return laser;
}

}  // namespace

std::vector<Beam> parse_velodyne_yaml(std::string_view text, const fs::path& path) {
  const yaml::Node document = yaml::parse(std::string(text), path);
  yaml::Faults faults(path);
  yaml::Map root(document, "", faults);
  const auto items = root.list("lasers", yaml::Need::Required);
  if (const yaml::Node* at = root.find("lasers", yaml::Need::Optional); !at) {
    faults.add(document, "lasers", "missing: is this the calibration of a Velodyne?");
  } else if (items.empty() || items.size() > most_beams) {
    faults.add(*at, "lasers", "has {} lasers, but must have 1 to {}", items.size(), most_beams);
  }
  std::vector<Laser> lasers;
  std::set<double> ids;
  for (const yaml::Node& item : items) {
    Laser laser;
    yaml::Map map(item, "lasers", faults);
    const auto read = [&](const char* key, yaml::Need need, double& into, yaml::Rule rule) {
      if (need == yaml::Need::Required && item.kind == yaml::Node::Kind::Map &&
          !map.find(key, yaml::Need::Optional)) {
        faults.add(item, key, "missing in a laser");
      }
      return map.read_number(key, need, into, rule);
    };
    using enum yaml::Need;
    const yaml::Node* id = read("laser_id", Required, laser.id, number_rule);
    if (id && !ids.insert(laser.id).second) faults.add(*id, "laser_id", "{} is repeated", laser.id);
    read("rot_correction", Required, laser.rotation_rad, yaml::any_number);
    read("vert_correction", Required, laser.elevation_rad, elevation_rad_rule);
    read("vert_offset_correction", Optional, laser.up_m, yaml::any_number);
    read("horiz_offset_correction", Optional, laser.left_m, yaml::any_number);
    lasers.push_back(laser);
  }
  faults.throw_if_any();
  return beams_of(std::move(lasers));
}

std::vector<Beam> parse_velodyne_xml(std::string_view text, const fs::path& path) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw Error("{}:{}: not XML: {}", path.string(), document.ErrorLineNum(), document.ErrorName());
  }
  const tinyxml2::XMLElement* root = document.RootElement();
  const tinyxml2::XMLElement* db = root ? root->FirstChildElement("DB") : nullptr;
  const tinyxml2::XMLElement* points = db ? db->FirstChildElement("points_") : nullptr;
  if (!points) {
    throw Error("{}: the element DB with points_ is missing: is this the db.xml of a Velodyne?",
                path.string());
  }
  Violations broken(path.string());
  const std::set<double> disabled = disabled_lasers(*db);
  std::vector<Laser> lasers;
  std::set<double> ids;
  for (const auto* item = points->FirstChildElement("item"); item;
       item = item->NextSiblingElement("item")) {
    const tinyxml2::XMLElement* px = item->FirstChildElement("px");
    broken.unless(px, "line {}: an item of points_ has no <px>", item->GetLineNum());
    if (!px) continue;
    const Laser laser = read_px(*px, broken);
    broken.unless(ids.insert(laser.id).second, "line {}: id_ {} is repeated", px->GetLineNum(),
                  laser.id);
    if (!disabled.contains(laser.id)) lasers.push_back(laser);
  }
  broken.unless(!lasers.empty(), "points_ has no enabled laser");
  broken.throw_if_any();
  return beams_of(std::move(lasers));
}

std::vector<Beam> load_velodyne_yaml(const fs::path& path) {
  return parse_velodyne_yaml(read_text(path), path);
}

}  // namespace groundray
