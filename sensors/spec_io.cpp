#include "sensors/spec_io.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <glm/vec3.hpp>
#include <iterator>
#include <set>

#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::any_number;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::not_negative;
using yaml::positive;
using yaml::Rule;

constexpr Rule duration_rule{[](double value) { return value > 0 && value <= 1e6; },
                             "must be > 0 and at most 1e6"};
constexpr Rule elevation_rule{[](double value) { return std::abs(value) <= 90; },
                              "must be from -90 to 90"};

std::string read_file(const fs::path& path) {
  constexpr std::uintmax_t largest_file_bytes = 16u << 20;
  std::error_code fault;
  if (!fs::is_regular_file(path, fault)) throw Error("{}: there is no such file", path.string());
  if (fs::file_size(path, fault) > largest_file_bytes) {
    throw Error("{}: larger than any file of groundray (16 MiB)", path.string());
  }
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw Error("{}: cannot be read", path.string());
  return text;
}

void check_version(Map& root, std::string_view key, Faults& faults) {
  std::uint64_t version = 1;
  if (const Node* at = root.read_whole(key, Need::Required, version); at && version != 1) {
    faults.add(*at, key, "is {}, but this groundray reads format 1 alone", version);
  }
}

void check_turn(const Node& node, std::string_view key, const SpinningPattern& pattern,
                Faults& faults) {
  const double sequences = 1 / (pattern.rate_hz * pattern.firing_period_s);
  if (sequences < 1 - 1e-9 || sequences > ScanPattern::most_sequences) {
    faults.add(node, key, "makes {:.6g} firing sequences in a turn, but must make 1 to {}",
               sequences, ScanPattern::most_sequences);
  }
}

// A column of the beam table: where its number goes, and in which unit the file gives it.
struct BeamColumn {
  std::string_view name;
  Rule rule;
  void (*set)(Beam& beam, double value);
  bool required;
};

constexpr Rule ring_rule{
    [](double value) { return value >= 0 && value <= 65535 && value == std::floor(value); },
    "must be a whole number from 0 to 65535"};
constexpr std::array beam_columns{
    BeamColumn{"ring", ring_rule, [](Beam& b, double v) { b.ring = static_cast<std::uint16_t>(v); },
               true},
    BeamColumn{"elevation_deg", elevation_rule,
               [](Beam& b, double v) { b.elevation_rad = glm::radians(v); }, true},
    BeamColumn{"azimuth_offset_deg", any_number,
               [](Beam& b, double v) { b.azimuth_offset_rad = glm::radians(v); }, false},
    BeamColumn{"origin_x_m", any_number, [](Beam& b, double v) { b.origin_m.x = v; }, false},
    BeamColumn{"origin_y_m", any_number, [](Beam& b, double v) { b.origin_m.y = v; }, false},
    BeamColumn{"origin_z_m", any_number, [](Beam& b, double v) { b.origin_m.z = v; }, false},
    BeamColumn{"firing_time_us", not_negative, [](Beam& b, double v) { b.firing_time_s = v / 1e6; },
               true},
};

std::vector<BeamColumn> read_columns(Map& root, Faults& faults) {
  std::vector<std::string> free;
  free.reserve(beam_columns.size());
  for (const BeamColumn& column : beam_columns) free.emplace_back(column.name);
  std::vector<BeamColumn> columns;
  for (const Node& item : root.list("beam_columns", Need::Required)) {
    const auto column = std::ranges::find(beam_columns, item.text, &BeamColumn::name);
    if (column == beam_columns.end()) {
      faults.add(item, "beam_columns", "{} is not a column of beams{}", yaml::shown(item),
                 yaml::suggestion(item.text, free));
    } else if (std::erase(free, item.text) == 0) {
      faults.add(item, "beam_columns", "{} is repeated", yaml::shown(item));
    } else {
      columns.push_back(*column);
    }
  }
  return columns;
}

std::vector<Beam> read_beams(Map& root, double period_s, Faults& faults) {
  const Node* names = root.find("beam_columns", Need::Optional);
  const std::vector<BeamColumn> columns = read_columns(root, faults);
  const auto rows = root.list("beams", Need::Required);
  if (const Node* at = root.find("beams", Need::Optional); at && rows.empty()) {
    faults.add(*at, "beams", "has no rows, but a lidar needs at least one beam");
  }
  if (!names || columns.size() != names->items.size() || columns.empty()) return {};
  for (const BeamColumn& column : beam_columns) {
    if (column.required && std::ranges::count(columns, column.name, &BeamColumn::name) == 0) {
      faults.add(*names, "beam_columns", "lacks {}", column.name);
    }
  }
  std::vector<Beam> beams;
  std::vector<double> values(columns.size());
  for (const Node& row : rows) {
    if (!yaml::numbers(row, "beams", values, any_number, faults)) continue;
    Beam beam;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!columns[i].rule.holds(values[i])) {
        faults.add(row.items[i], columns[i].name, "is {}, but {}", values[i],
                   columns[i].rule.words);
      } else {
        columns[i].set(beam, values[i]);
      }
    }
    if (period_s > 0 && beam.firing_time_s >= period_s) {
      faults.add(row, "beams", "firing_time_us must be less than firing_period_us");
    }
    beams.push_back(beam);
  }
  return beams;
}

LidarSpec read_lidar(const Node& node, Faults& faults) {
  LidarSpec lidar;
  SpinningPattern& pattern = lidar.pattern;
  Map root(node, "", faults);
  check_version(root, "groundray_lidar", faults);
  root.read_text("model", Need::Required, lidar.model);
  if (auto rotation = root.map("rotation", Need::Required)) {
    rotation->read_number("rate_hz", Need::Required, pattern.rate_hz, positive);
    rotation->read_choice<SpinningPattern::Sense>(
        "sense", Need::Required, pattern.sense,
        {{"clockwise", SpinningPattern::Sense::Clockwise},
         {"counter_clockwise", SpinningPattern::Sense::CounterClockwise}});
    double start_azimuth_deg = 0;
    rotation->read_number("start_azimuth_deg", Need::Required, start_azimuth_deg);
    pattern.start_azimuth_rad = glm::radians(start_azimuth_deg);
    rotation->close();
  }
  double period_us = 0;
  const Node* period = root.read_number("firing_period_us", Need::Required, period_us, positive);
  pattern.firing_period_s = period_us / 1e6;
  if (period) check_turn(*period, "firing_period_us", pattern, faults);
  if (auto gate = root.map("range_gate_m", Need::Optional)) {
    gate->read_number("near", Need::Optional, lidar.gate.near_m, not_negative);
    gate->read_number("far", Need::Optional, lidar.gate.far_m, positive);
    if (lidar.gate.near_m >= lidar.gate.far_m) {
      faults.add(gate->node(), "range_gate_m", "near must be less than far: are they swapped?");
    }
    gate->close();
  }
  pattern.beams = read_beams(root, pattern.firing_period_s, faults);
  if (const Node* sources = root.find("sources", Need::Optional)) {
    const Map texts(*sources, "sources", faults);
    for (std::size_t i = 1; sources->kind == Node::Kind::Map && i < sources->items.size(); i += 2) {
      yaml::is_text(sources->items[i], sources->items[i - 1].text, faults);
    }
  }
  root.close();
  return lidar;
}

// Names that GDAL knows how to open but that are no paths (/vsizip/..., NETCDF:"..."), stay as they
// are.
fs::path beside(const fs::path& file, const std::string& relative) {
  const std::size_t colon = relative.find(':');
  if (relative.starts_with("/vsi") || (colon != std::string::npos && colon < relative.find('/')))
    return relative;
  return (file.parent_path() / relative).lexically_normal();
}

TerrainSpec read_terrain(Map terrain, const fs::path& path, Faults& faults) {
  TerrainSpec spec;
  std::string dem;
  if (terrain.read_text("dem", Need::Required, dem)) spec.dem = beside(path, dem);
  double nodata = 0;
  if (terrain.read_number("nodata", Need::Optional, nodata)) spec.options.nodata = nodata;
  terrain.read_text("reproject_to", Need::Optional, spec.options.reproject_to);
  terrain.read_whole("label", Need::Optional, spec.label);
  terrain.read_number("tolerance_m", Need::Optional, spec.detail.tolerance_m, not_negative);
  double tolerance_mrad = 0;
  terrain.read_number("tolerance_mrad", Need::Optional, tolerance_mrad, not_negative);
  spec.detail.tolerance_rad = tolerance_mrad / 1000;
  if (const Node* at = terrain.read_whole("memory_mib", Need::Optional, spec.detail.memory_mib);
      at && spec.detail.memory_mib == 0) {
    faults.add(*at, "memory_mib", "is 0, but must be at least 1");
  }
  terrain.close();
  return spec;
}

DrivenPath read_drive(Map drive, Faults& faults) {
  DrivenPath path;
  const auto waypoints = drive.list("waypoints_m", Need::Required);
  for (const Node& waypoint : waypoints) {
    std::array<double, 2> p{};
    if (yaml::numbers(waypoint, "waypoints_m", p, any_number, faults)) {
      path.waypoints_m.emplace_back(p[0], p[1]);
    }
  }
  if (const Node* at = drive.find("waypoints_m", Need::Optional); at && waypoints.size() < 2) {
    faults.add(*at, "waypoints_m", "has {} points, but a drive needs at least two",
               waypoints.size());
  }
  drive.read_number("speed_m_s", Need::Required, path.speed_m_s, positive);
  drive.read_number("height_m", Need::Required, path.height_m, not_negative);
  std::array<double, 2> footprint{path.footprint_m.x, path.footprint_m.y};
  drive.read_numbers("footprint_m", Need::Optional, footprint, positive);
  path.footprint_m = {footprint[0], footprint[1]};
  drive.close();
  return path;
}

std::variant<RecordedPath, DrivenPath> read_platform(Map platform, const fs::path& path,
                                                     Faults& faults) {
  std::variant<RecordedPath, DrivenPath> result;
  std::string tum;
  if (platform.read_text("trajectory", Need::Optional, tum)) {
    result = RecordedPath{beside(path, tum)};
  }
  auto drive = platform.map("drive", Need::Optional);
  const bool recorded = platform.find("trajectory", Need::Optional) != nullptr;
  if (recorded == drive.has_value() && platform.node().kind == Node::Kind::Map) {
    faults.add(platform.node(), "platform", "must have exactly one of 'trajectory' and 'drive'");
  }
  if (drive) result = read_drive(std::move(*drive), faults);
  platform.close();
  return result;
}

Pose read_mount(Map mount) {
  Pose X_BS;
  std::array<double, 3> translation{};
  mount.read_numbers("translation_m", Need::Optional, translation);
  X_BS.translation_m = {translation[0], translation[1], translation[2]};
  glm::dvec3 angles_deg(0);
  mount.read_number("yaw_deg", Need::Optional, angles_deg.x);
  mount.read_number("pitch_deg", Need::Optional, angles_deg.y);
  mount.read_number("roll_deg", Need::Optional, angles_deg.z);
  mount.close();
  const glm::dvec3 angles_rad = glm::radians(angles_deg);
  X_BS.rotation = rotation_from_yaw_pitch_roll(angles_rad.x, angles_rad.y, angles_rad.z);
  return X_BS;
}

// Reads the lidar that a scene's entry names by `preset` or `file`.
void read_source(Map& entry, const fs::path& path, const fs::path& preset_folder,
                 MountedLidar& mounted, Faults& faults) {
  const Node* preset = entry.find("preset", Need::Optional);
  const Node* file = entry.find("file", Need::Optional);
  if (!preset == !file) {
    faults.add(entry.node(), "lidars", "must have exactly one of 'preset' and 'file'");
    return;
  }
  const Node& node = preset ? *preset : *file;
  const std::string_view key = preset ? "preset" : "file";
  if (!yaml::is_text(node, key, faults)) return;
  mounted.source = node.text;
  try {
    const auto names = preset ? preset_names(preset_folder) : std::vector{node.text};
    if (std::ranges::count(names, node.text) == 0) {
      faults.add(node, key, "{} is not in {}{}; it has {}", yaml::shown(node),
                 preset_folder.string(), yaml::suggestion(node.text, names),
                 fmt::join(names, ", "));
      return;
    }
    mounted.lidar =
        load_lidar(preset ? preset_folder / (node.text + ".yaml") : beside(path, node.text));
  } catch (const Error& fault) {
    faults.add(node, key, "the lidar cannot be read:\n{}", fault.what());
  }
}

bool is_file_name(std::string_view name) {
  return std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
}

MountedLidar read_mounted(Map entry, const fs::path& path, const fs::path& preset_folder,
                          Faults& faults) {
  MountedLidar mounted;
  if (const Node* at = entry.read_text("name", Need::Required, mounted.name);
      at && !is_file_name(mounted.name)) {
    faults.add(*at, "name", "is {}, but names files: use letters, digits, '_' and '-' alone",
               yaml::shown(*at));
  }
  read_source(entry, path, preset_folder, mounted, faults);
  if (auto mount = entry.map("mount", Need::Required)) mounted.X_BS = read_mount(std::move(*mount));
  LidarSpec& lidar = mounted.lidar;
  const Node* rate = entry.read_number("rate_hz", Need::Optional, lidar.pattern.rate_hz, positive);
  if (rate && lidar.pattern.firing_period_s > 0) {
    check_turn(*rate, "rate_hz", lidar.pattern, faults);
  }
  std::array<double, 2> gate{};
  if (const Node* at = entry.read_numbers("range_gate_m", Need::Optional, gate, not_negative)) {
    if (gate[0] >= gate[1]) {
      faults.add(*at, "range_gate_m", "[{}, {}] is empty: are near and far swapped?", gate[0],
                 gate[1]);
    }
    lidar.gate = {gate[0], gate[1]};
  }
  entry.read_number("range_noise_sigma_m", Need::Optional, lidar.range_noise_sigma_m, not_negative);
  entry.read_choice<LidarSpec::ErrorBound>(
      "error_bound", Need::Optional, lidar.error_bound,
      {{"omit", LidarSpec::ErrorBound::Omit}, {"report", LidarSpec::ErrorBound::Report}});
  entry.close();
  return mounted;
}

std::vector<MountedLidar> read_lidars(Map& root, const fs::path& path,
                                      const fs::path& preset_folder, Faults& faults) {
  std::vector<MountedLidar> lidars;
  std::set<std::string> names;
  const auto entries = root.list("lidars", Need::Required);
  for (const Node& entry : entries) {
    lidars.push_back(read_mounted(Map(entry, "lidars", faults), path, preset_folder, faults));
    const std::string& name = lidars.back().name;
    if (!name.empty() && !names.insert(name).second) {
      faults.add(entry, "name", "'{}' is taken by an earlier lidar: names must differ", name);
    }
  }
  if (const Node* node = root.find("lidars", Need::Optional);
      node && node->kind == Node::Kind::List && entries.empty()) {
    faults.add(*node, "lidars", "is an empty list, but a scene needs at least one lidar");
  }
  return lidars;
}

}  // namespace

SceneSpec load_scene(const fs::path& path, const fs::path& preset_folder) {
  return parse_scene(read_file(path), path, preset_folder);
}

SceneSpec parse_scene(const std::string& text, const fs::path& path,
                      const fs::path& preset_folder) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  SceneSpec scene;
  scene.text = text;
  Map root(node, "", faults);
  check_version(root, "groundray", faults);
  root.read_whole("seed", Need::Required, scene.seed.value);
  root.read_number("duration_s", Need::Required, scene.duration_s, duration_rule);
  root.read_choice<Tracing>("tracing", Need::Optional, scene.tracing,
                            {{"fast", Tracing::Fast}, {"exact", Tracing::Exact}});
  if (auto terrain = root.map("terrain", Need::Required)) {
    scene.terrain = read_terrain(std::move(*terrain), path, faults);
  }
  if (auto platform = root.map("platform", Need::Required)) {
    scene.platform = read_platform(std::move(*platform), path, faults);
  }
  scene.lidars = read_lidars(root, path, preset_folder, faults);
  root.close();
  faults.throw_if_any();
  return scene;
}

LidarSpec load_lidar(const fs::path& path) { return parse_lidar(read_file(path), path); }

LidarSpec parse_lidar(const std::string& text, const fs::path& path) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  LidarSpec lidar = read_lidar(node, faults);
  faults.throw_if_any();
  return lidar;
}

std::vector<std::string> preset_names(const fs::path& preset_folder) {
  std::vector<std::string> names;
  std::error_code fault;
  for (const fs::directory_entry& entry : fs::directory_iterator(preset_folder, fault)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  if (fault) {
    throw Error("{}: the folder of presets cannot be read: {}", preset_folder.string(),
                fault.message());
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace groundray
