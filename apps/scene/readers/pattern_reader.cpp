#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

constexpr Rule elevation_deg_rule{[](double value) { return std::abs(value) <= 90; },
                                  "must be from -90 to 90"};

// Column of the beam table: its name in the file, and the conversion of its numbers to a field of
// Beam.
struct BeamColumn {
  std::string_view name;
  Rule rule;
  void (*set)(Beam& beam, double value);
  bool required;
};

constexpr Rule ring_rule{
    [](double value) { return value >= 0 && value <= 65535 && value == std::floor(value); },
    "must be a whole number from 0 to 65535"};
constexpr Rule loop_rule{
    [](double value) { return value >= 0 && value <= 255 && value == std::floor(value); },
    "must be a whole number from 0 to 255"};
constexpr std::array beam_columns{
    BeamColumn{"loop", loop_rule, [](Beam& b, double v) { b.loop = static_cast<int>(v); }, false},
    BeamColumn{"ring", ring_rule, [](Beam& b, double v) { b.ring = static_cast<std::uint16_t>(v); },
               true},
    BeamColumn{"elevation_deg", elevation_deg_rule,
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
      faults.add(item, "beam_columns", "{} is not a column of beams{}", shown(item),
                 suggestion(item.text, free));
    } else if (std::erase(free, item.text) == 0) {
      faults.add(item, "beam_columns", "{} is repeated", shown(item));
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
    if (!numbers(row, "beams", values, any_number, faults)) continue;
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

// Reads an angle in degrees.
void read_angle(Map& map, std::string_view key, Need need, double& into_rad,
                Rule rule = any_number) {
  map.read_scaled(key, need, glm::radians(1.0), into_rad, rule);
}

SpinningPattern read_spinning(Map& root, Faults& faults) {
  SpinningPattern pattern;
  if (auto rotation = root.map("rotation", Need::Required)) {
    rotation->read_number("rate_hz", Need::Required, pattern.rate_hz, positive);
    rotation->read_choice("sense", Need::Required, pattern.sense,
                          {"clockwise", "counter_clockwise"});
    read_angle(*rotation, "start_azimuth_deg", Need::Required, pattern.start_azimuth_rad);
    glm::dvec2 view_deg(0);
    if (const Node* at = rotation->read_vector("field_of_view_deg", Need::Optional, view_deg)) {
      if (view_deg.x >= view_deg.y || view_deg.y > view_deg.x + 360)
        faults.add(*at, "field_of_view_deg", "must be counter-clockwise and at most one turn wide");
      pattern.field_of_view = {glm::radians(view_deg.x), glm::radians(view_deg.y)};
    }
    rotation->close();
  }
  double period_us = 0;
  const Node* period = root.read_number("firing_period_us", Need::Required, period_us, positive);
  pattern.firing_period_s = period_us / 1e6;
  if (period) check_turn(*period, "firing_period_us", pattern, faults);
  pattern.beams = read_beams(root, pattern.firing_period_s, faults);
  return pattern;
}

LinePattern read_line(Map line) {
  LinePattern pattern;
  line.read_choice("mirror", Need::Required, pattern.mirror, {"triangle", "sine", "polygon"});
  line.read_choice("plane", Need::Required, pattern.plane, {"upright", "across"});
  glm::dvec2 view_deg(0);
  line.read_vector("field_of_view_deg", Need::Required, view_deg);
  pattern.from_rad = glm::radians(view_deg.x);
  pattern.to_rad = glm::radians(view_deg.y);
  line.read_number("line_rate_hz", Need::Required, pattern.line_rate_hz, positive);
  line.read_number("pulse_rate_hz", Need::Required, pattern.pulse_rate_hz, positive);
  std::uint16_t facets = 0;
  std::uint32_t lines = 1;
  line.read_whole("facets", Need::Optional, facets);
  line.read_whole("lines_per_sweep", Need::Optional, lines);
  pattern.facets = facets;
  pattern.lines_per_sweep = static_cast<int>(std::min(lines, 1'000'000'000u));
  line.read_number("head_rate_hz", Need::Optional, pattern.head_rate_hz);
  read_angle(line, "head_start_deg", Need::Optional, pattern.head_start_rad);
  line.close();
  return pattern;
}

RisleyPattern read_risley(Map risley, Map& root, Faults& faults) {
  RisleyPattern pattern;
  for (const Node& node : risley.list("prisms", Need::Required)) {
    Map map(node, "prisms", faults);
    WedgePrism prism;
    read_angle(map, "wedge_deg", Need::Required, prism.wedge_rad, positive);
    map.read_number("refractive_index", Need::Required, prism.refractive_index, at_least_one);
    map.read_number("rate_hz", Need::Required, prism.rate_hz);
    read_angle(map, "base_deg", Need::Optional, prism.base_rad);
    map.read_choice("tilted_face", Need::Optional, prism.tilted, {"exit", "entry"});
    map.close();
    pattern.prisms.push_back(prism);
  }
  risley.read_number("sweep_rate_hz", Need::Required, pattern.sweep_rate_hz, positive);
  risley.close();
  double period_us = 0;
  root.read_number("firing_period_us", Need::Required, period_us, positive);
  pattern.firing_period_s = period_us / 1e6;
  pattern.beams = read_beams(root, pattern.firing_period_s, faults);
  return pattern;
}

TablePattern read_pixels(Map map) {
  PixelArray pixels;
  std::uint16_t rows = 1, columns = 1;
  map.read_whole("rows", Need::Required, rows);
  map.read_whole("columns", Need::Required, columns);
  pixels.rows = rows;
  pixels.columns = columns;
  glm::dvec2 view_deg(0);
  map.read_vector("field_of_view_deg", Need::Required, view_deg, positive);
  pixels.horizontal_view_rad = glm::radians(view_deg.x);
  pixels.vertical_view_rad = glm::radians(view_deg.y);
  map.read_choice("spacing", Need::Optional, pixels.spacing, {"equal_angles", "equal_tangents"});
  double row_s = 0, column_s = 0, frame_rate_hz = 10;
  map.read_scaled("row_period_us", Need::Optional, 1e-6, row_s);
  map.read_scaled("column_period_us", Need::Optional, 1e-6, column_s);
  const bool sound = map.read_number("frame_rate_hz", Need::Required, frame_rate_hz, positive);
  map.close();
  return sound ? raster_pattern(pixels, row_s, column_s, 1 / frame_rate_hz) : TablePattern{};
}

TablePattern read_table(Map map, const fs::path& path) {
  fs::path file;
  double period_s = 0;
  const bool named = read_path(map, "csv", Need::Required, path, file);
  const bool sound = map.read_number("period_s", Need::Required, period_s, positive);
  std::uint32_t sweeps = 1;
  map.read_whole("sweeps_per_period", Need::Optional, sweeps);
  map.close();
  if (!named || !sound) return {};
  TablePattern pattern = load_table(file, period_s);
  pattern.sweeps_per_period = static_cast<int>(std::min(sweeps, 1'000'000'000u));
  return pattern;
}

}  // namespace

void check_turn(const Node& node, std::string_view key, const SpinningPattern& pattern,
                Faults& faults) {
  const double sequences = 1 / (pattern.rate_hz * pattern.firing_period_s);
  if (sequences < 1 - 1e-9 || sequences > SpinningScan::most_sequences) {
    faults.add(node, key, "yields {:.6g} firing sequences per turn, but must yield 1 to {}",
               sequences, SpinningScan::most_sequences);
  }
}

// A file has the keys of one kind of pattern; `rotation` indicates a spinning head.
PatternSpec read_pattern(Map& root, const fs::path& path, Faults& faults) {
  auto line = root.map("line", Need::Optional);
  auto risley = root.map("risley", Need::Optional);
  auto pixels = root.map("pixels", Need::Optional);
  auto table = root.map("table", Need::Optional);
  const bool spins = root.find("rotation", Need::Optional) != nullptr;
  if (spins + line.has_value() + risley.has_value() + pixels.has_value() + table.has_value() > 1) {
    faults.add(root.node(), "",
               "has several patterns: keep one of rotation, line, risley, pixels and table");
  }
  const std::size_t before = faults.count();
  const auto checked = [&](auto pattern) -> PatternSpec {
    if (faults.count() > before) return SpinningPattern{};
    try {
      ScanPattern{pattern};
    } catch (const Error& error) {
      faults.add(root.node(), "", "{}", error.what());
    }
    return pattern;
  };
  try {
    if (line) return checked(read_line(std::move(*line)));
    if (risley) return checked(read_risley(std::move(*risley), root, faults));
    if (pixels) return checked(read_pixels(std::move(*pixels)));
    if (table) return checked(read_table(std::move(*table), path));
  } catch (const Error& error) {
    faults.add(root.node(), "", "{}", error.what());
    return SpinningPattern{};
  }
  return read_spinning(root, faults);
}

}  // namespace groundray::yaml
