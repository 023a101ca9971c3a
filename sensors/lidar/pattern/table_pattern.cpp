#include "sensors/lidar/pattern/table_pattern.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
#include "core/math.h"
#include "sensors/lidar/pattern/spinning_pattern.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr int most_sweeps = 1'000'000;

void check_shot(const TablePattern& pattern, std::size_t i, Violations& broken) {
  const TablePattern::Shot& shot = pattern.shots[i];
  broken.unless(shot.time_s >= 0 && shot.time_s < pattern.period_s,
                "shots[{}].time_s = {} must be in [0, period_s = {})", i, shot.time_s,
                pattern.period_s);
  broken.unless(
      i == 0 || !(shot.time_s < pattern.shots[i - 1].time_s),
      "shots[{}].time_s = {} is earlier than {} of the previous shot: sort the shots by time", i,
      shot.time_s, pattern.shots[i == 0 ? 0 : i - 1].time_s);
  broken.unless(std::isfinite(shot.azimuth_rad), "shots[{}].azimuth_rad = {} must be finite", i,
                shot.azimuth_rad);
  broken.unless(std::abs(shot.elevation_rad) <= pi / 2,
                "shots[{}].elevation_rad = {} must be in [-pi/2, pi/2]: is it in degrees?", i,
                shot.elevation_rad);
  const glm::dvec3& p = shot.origin_m;
  broken.unless(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z),
                "shots[{}].origin_m = ({}, {}, {}) must be finite", i, p.x, p.y, p.z);
}

void check_table_pattern(const TablePattern& pattern) {
  Violations broken("TablePattern");
  broken.unless(pattern.period_s > 0 && std::isfinite(pattern.period_s),
                "period_s = {} must be positive and finite", pattern.period_s);
  broken.unless(pattern.sweeps_per_period >= 1 && pattern.sweeps_per_period <= most_sweeps,
                "sweeps_per_period = {} must be from 1 to {}", pattern.sweeps_per_period,
                most_sweeps);
  broken.unless(
      !pattern.shots.empty() && pattern.shots.size() <= std::size_t{TableScan::most_shots},
      "shots: there are {}, but there must be 1 to {}", pattern.shots.size(),
      TableScan::most_shots);
  for (std::size_t i = 0; i < pattern.shots.size(); ++i) {
    check_shot(pattern, i, broken);
    if (i % 1000 == 999) broken.throw_if_any();  // a table in wrong units has a fault in every line
  }
  broken.throw_if_any();
}

FiringCycle table_cycle(const TablePattern& pattern) {
  check_table_pattern(pattern);
  std::vector<FiringCycle::Firing> firings;
  firings.reserve(pattern.shots.size());
  for (const TablePattern::Shot& shot : pattern.shots) {
    firings.push_back(firing_towards(shot.azimuth_rad, shot.elevation_rad));
    firings.back().firing_time_s = shot.time_s;
    firings.back().shot.origin_m = shot.origin_m;
    firings.back().shot.ring = shot.ring;
  }
  return {std::move(firings), pattern.period_s, {}};
}

// Returns the text without leading and trailing blanks.
std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

constexpr std::array<std::string_view, 4> column_names{"time_s", "azimuth_deg", "elevation_deg",
                                                       "channel"};
// Position of each column in a row; empty if the header does not name it.
struct Columns {
  std::array<std::optional<std::size_t>, column_names.size()> at;
  std::size_t count = 0;
};

Columns read_header(std::string_view line) {
  Columns columns;
  for (const std::string_view cell : cells_of(line)) {
    const auto name = std::ranges::find(column_names, cell);
    if (name == column_names.end()) {
      throw Error("column '{}' is unknown; the first line must be {}", cell.substr(0, 40),
                  fmt::join(column_names, ","));
    }
    auto& at = columns.at[static_cast<std::size_t>(name - column_names.begin())];
    if (at) throw Error("column '{}' is repeated", cell);
    at = columns.count++;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!columns.at[i]) {
      throw Error("column '{}' is missing; the first line must be {}", column_names[i],
                  fmt::join(column_names, ","));
    }
  }
  return columns;
}

TablePattern::Shot read_row(std::string_view line, const Columns& columns, double period_s,
                            double last_time_s) {
  const std::vector<std::string_view> cells = cells_of(line);
  if (cells.size() != columns.count) {
    throw Error("it has {} values, but must have {}, as the first line", cells.size(),
                columns.count);
  }
  std::array<double, column_names.size()> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!columns.at[i]) continue;
    const std::string_view cell = cells[*columns.at[i]];
    const auto value = number_of<double>(cell);
    if (!value || !std::isfinite(*value)) {
      throw Error("{} = '{}' must be a finite number", column_names[i], cell.substr(0, 40));
    }
    values[i] = *value;
  }
  const auto [time_s, azimuth_deg, elevation_deg, channel] = values;
  if (!(time_s >= 0 && time_s < period_s)) {
    throw Error("time_s = {} must be in [0, {}), the period: is it in seconds?", time_s, period_s);
  }
  if (time_s < last_time_s) {
    throw Error("time_s = {} is earlier than {} in a line above: sort the lines by time", time_s,
                last_time_s);
  }
  if (!(std::abs(elevation_deg) <= 90)) {
    throw Error("elevation_deg = {} must be from -90 to 90: is it a zenith angle?", elevation_deg);
  }
  if (!(channel >= 0 && channel <= 65535 && channel == std::floor(channel))) {
    throw Error("channel = {} must be a whole number from 0 to 65535", channel);
  }
  return {.time_s = time_s,
          .azimuth_rad = glm::radians(azimuth_deg),
          .elevation_rad = glm::radians(elevation_deg),
          .ring = static_cast<std::uint16_t>(channel)};
}

void check_pixel_array(const PixelArray& pixels, Violations& broken) {
  const bool plane = pixels.spacing == PixelArray::Spacing::EqualTangents;
  constexpr int most = 65536;  // rings have 16 bits
  broken.unless(
      pixels.rows >= 1 && pixels.rows <= most && pixels.columns >= 1 && pixels.columns <= most &&
          std::int64_t{pixels.rows} * pixels.columns <= std::int64_t{TableScan::most_shots},
      "{} rows and {} columns: each must be from 1 to {}, their product at most {}", pixels.rows,
      pixels.columns, most, TableScan::most_shots);
  broken.unless(pixels.horizontal_view_rad >= 0 && (plane ? pixels.horizontal_view_rad < pi
                                                          : pixels.horizontal_view_rad <= 2 * pi),
                "horizontal_view_rad = {} must be in [0, {}", pixels.horizontal_view_rad,
                plane ? "pi) for a plane" : "2 pi]");
  broken.unless(pixels.vertical_view_rad >= 0 &&
                    (plane ? pixels.vertical_view_rad < pi : pixels.vertical_view_rad <= pi),
                "vertical_view_rad = {} must be in [0, pi{}", pixels.vertical_view_rad,
                plane ? ") for a plane" : "]");
}

void check_times(const PixelArray& pixels, double row_period_s, double column_period_s,
                 double frame_period_s, Violations& broken) {
  const std::array<std::pair<const char*, double>, 2> periods{
      {{"row_period_s", row_period_s}, {"column_period_s", column_period_s}}};
  for (const auto& [name, value] : periods) {
    broken.unless(value >= 0 && std::isfinite(value), "{} = {} must be finite and not negative",
                  name, value);
  }
  const double last_s = (pixels.rows - 1) * row_period_s + (pixels.columns - 1) * column_period_s;
  broken.unless(last_s < frame_period_s,
                "the last pixel fires at {} s, but the frame lasts {} s: is the period in seconds?",
                last_s, frame_period_s);
}

// Returns the position of a cell's centre, from +1/2 (outer edge of the first cell) to -1/2 (that
// of the last).
double centre(int index, int count) { return 0.5 - (index + 0.5) / count; }

TablePattern::Shot pixel_shot(const PixelArray& pixels, int row, int column) {
  const double left = centre(column, pixels.columns);
  const double up = centre(row, pixels.rows);
  TablePattern::Shot shot;
  shot.ring = static_cast<std::uint16_t>(row);
  if (pixels.spacing == PixelArray::Spacing::EqualAngles) {
    shot.azimuth_rad = left * pixels.horizontal_view_rad;
    shot.elevation_rad = up * pixels.vertical_view_rad;
  } else {
    const double y = 2 * left * math::tan(pixels.horizontal_view_rad / 2);
    const double z = 2 * up * math::tan(pixels.vertical_view_rad / 2);
    shot.azimuth_rad = math::atan(y);
    shot.elevation_rad = math::atan(z / math::hypot(1, y));
  }
  return shot;
}

}  // namespace

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

TablePattern raster_pattern(const PixelArray& pixels, double row_period_s, double column_period_s,
                            double frame_period_s) {
  Violations broken("raster");
  check_pixel_array(pixels, broken);
  check_times(pixels, row_period_s, column_period_s, frame_period_s, broken);
  broken.throw_if_any();
  TablePattern table;
  table.period_s = frame_period_s;
  for (int row = 0; row < pixels.rows; ++row) {
    for (int column = 0; column < pixels.columns; ++column) {
      table.shots.push_back(pixel_shot(pixels, row, column));
      table.shots.back().time_s = row * row_period_s + column * column_period_s;
    }
  }
  std::ranges::stable_sort(table.shots, {}, &TablePattern::Shot::time_s);
  return table;
}

TablePattern load_table(const std::filesystem::path& path, double period_s) {
  return parse_table(read_text(path), path.string(), period_s);
}

TablePattern parse_table(std::string_view text, const std::string& name, double period_s) {
  constexpr std::size_t most_faults = 100;
  TablePattern table;
  table.period_s = period_s;
  std::optional<Columns> columns;
  std::string faults;
  std::size_t bad_lines = 0;
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const std::string_view row = trimmed(*line);
    if (row.empty() || row.starts_with('#')) continue;
    try {
      if (!columns) {
        columns = read_header(row);
        continue;
      }
      const double last_time_s = table.shots.empty() ? 0 : table.shots.back().time_s;
      table.shots.push_back(read_row(row, *columns, period_s, last_time_s));
    } catch (const Error& rule) {
      if (!columns) throw Error("{}:{}: {}", name, lines.number(), rule.what());
      if (++bad_lines > most_faults) continue;
      faults +=
          fmt::format("{}{}:{}: {}", bad_lines == 1 ? "" : "\n", name, lines.number(), rule.what());
    }
  }
  if (bad_lines > most_faults) faults += fmt::format("\nand {} more", bad_lines - most_faults);
  if (bad_lines > 0) throw Error(faults);
  if (table.shots.empty()) {
    throw Error("{}: it contains no pulse; the first line must be {} and each other line a pulse",
                name, fmt::join(column_names, ","));
  }
  return table;
}

TableScan::TableScan(const TablePattern& pattern) : cycle_(table_cycle(pattern)) {
  const double sweep_s = pattern.period_s / pattern.sweeps_per_period;
  for (int sweep = 0; sweep < pattern.sweeps_per_period; ++sweep) {
    // Times are decimal figures that doubles only approximate: up to 1e-9 of a sweep early counts
    // as on time.
    const auto first = std::ranges::lower_bound(pattern.shots, (sweep - 1e-9) * sweep_s, {},
                                                &TablePattern::Shot::time_s);
    begins_.push_back(first - pattern.shots.begin());
  }
  for (std::size_t sweep = 0; sweep < begins_.size(); ++sweep) {
    const std::int64_t end =
        sweep + 1 < begins_.size() ? begins_[sweep + 1] : cycle_.cycle_pulses();
    if (begins_[sweep] == end) {
      throw Error("TablePattern: sweep {} of {} has no pulse: reduce sweeps_per_period", sweep,
                  begins_.size());
    }
  }
}

}  // namespace groundray
