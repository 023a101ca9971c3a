#include "apps/scene/calibration/calibration_io.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <map>
#include <optional>
#include <set>

#include "apps/scene/calibration/calibration_limits.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
#include "sensors/lidar/pattern/csv_cells.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return result;
}

struct HesaiColumns {
  std::size_t channel, elevation, azimuth;
};

// Returns the columns if a line is the header; nullopt otherwise.
std::optional<HesaiColumns> hesai_header(const std::vector<std::string_view>& cells) {
  std::map<std::string, std::size_t> at;
  for (std::size_t i = 0; i < cells.size(); ++i) at.emplace(lower(cells[i]), i);
  const auto channel = at.contains("channel") ? at.find("channel") : at.find("laser id");
  const auto elevation = at.find("elevation");
  const auto azimuth = at.find("azimuth");
  if (channel == at.end() || elevation == at.end() || azimuth == at.end()) return std::nullopt;
  return HesaiColumns{channel->second, elevation->second, azimuth->second};
}

Beam hesai_beam(const std::vector<std::string_view>& cells, const HesaiColumns& columns) {
  const auto value = [&](std::size_t column, const char* name) {
    if (column >= cells.size()) throw Error("it has no {}", name);
    const auto number = number_of<double>(cells[column]);
    if (!number || !std::isfinite(*number)) {
      throw Error("{} = '{}' must be a finite number", name, cells[column].substr(0, 40));
    }
    return *number;
  };
  const double channel = value(columns.channel, "Channel");
  const double elevation_deg = value(columns.elevation, "Elevation");
  if (!(channel >= 1 && channel <= most_beams && channel == std::floor(channel))) {
    throw Error("Channel = {} must be a whole number from 1 to {}", channel, most_beams);
  }
  if (!(std::abs(elevation_deg) <= 90)) {
    throw Error("Elevation = {} must be from -90 to 90: are its columns swapped?", elevation_deg);
  }
  Beam beam;
  beam.elevation_rad = glm::radians(elevation_deg);
  // Hesai adds the offset to an azimuth that counts clockwise.
  beam.azimuth_offset_rad = -glm::radians(value(columns.azimuth, "Azimuth"));
  beam.ring = static_cast<std::uint16_t>(channel - 1);
  return beam;
}

}  // namespace

std::vector<Beam> parse_hesai_csv(std::string_view text, const fs::path& path) {
  constexpr std::size_t most_faults = 100;
  std::optional<HesaiColumns> columns;
  std::vector<Beam> beams;
  std::set<std::uint16_t> rings;
  std::vector<std::string> faults;
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const auto cells = cells_of(*line);
    if (line->empty() || (cells.size() == 1 && cells[0].empty())) continue;
    if (!columns) {  // newer files begin with one or two other lines
      columns = hesai_header(cells);
      continue;
    }
    if (lower(cells[0]).find_first_not_of("0123456789abcdef") == std::string::npos &&
        cells.size() == 1) {
      continue;  // the checksum at the end
    }
    try {
      beams.push_back(hesai_beam(cells, *columns));
      if (!rings.insert(beams.back().ring).second) {
        throw Error("Channel {} is repeated", beams.back().ring + 1);
      }
    } catch (const Error& rule) {
      faults.push_back(fmt::format("{}:{}: {}", path.string(), lines.number(), rule.what()));
      if (faults.size() == most_faults) break;
    }
  }
  if (!columns) {
    throw Error(
        "{}: no line has the column names Channel,Elevation,Azimuth: is it an angle correction "
        "file of Hesai?",
        path.string());
  }
  if (!faults.empty()) throw Error("{}", fmt::join(faults, "\n"));
  if (beams.empty()) throw Error("{}: it contains no channel", path.string());
  std::ranges::sort(beams, {}, &Beam::ring);
  return beams;
}

std::vector<Beam> load_hesai_csv(const fs::path& path) {
  return parse_hesai_csv(read_text(path), path);
}

SpinningPattern with_calibration(SpinningPattern pattern, std::span<const Beam> unit) {
  const bool loops = std::ranges::any_of(pattern.beams, [](const Beam& b) { return b.loop > 0; });
  std::set<std::uint16_t> rings;
  for (const Beam& beam : pattern.beams) rings.insert(beam.ring);
  const std::size_t beams = loops ? rings.size() : pattern.beams.size();
  if (beams != unit.size()) {
    throw Error("calibration: it has {} beams, but the pattern has {}: is it for another model?",
                unit.size(), beams);
  }
  for (std::size_t i = 0; i < pattern.beams.size(); ++i) {
    Beam& beam = pattern.beams[i];
    const auto own = loops ? std::ranges::find(unit, beam.ring, &Beam::ring)
                           : unit.begin() + static_cast<std::ptrdiff_t>(i);
    if (own == unit.end()) throw Error("calibration: it has no ring {}", beam.ring);
    beam.elevation_rad = own->elevation_rad;
    beam.azimuth_offset_rad = own->azimuth_offset_rad;
    beam.origin_m = own->origin_m;
    beam.ring = own->ring;
  }
  return pattern;
}

PatternSpec calibrated(const PatternSpec& pattern, const fs::path& file) {
  const std::string extension = lower(file.extension().string());
  if (extension == ".json") return load_ouster_metadata(file);
  const auto* spinning = std::get_if<SpinningPattern>(&pattern);
  if (!spinning)
    throw Error("{}: only spinning heads have calibrations of single units", file.string());
  if (extension == ".xml") return with_calibration(*spinning, load_velodyne_xml(file));
  if (extension == ".csv") return with_calibration(*spinning, load_hesai_csv(file));
  if (extension == ".yaml" || extension == ".yml")
    return with_calibration(*spinning, load_velodyne_yaml(file));
  throw Error(
      "{}: must be .xml, .yaml or .yml of a Velodyne, .csv of a Hesai or .json of an Ouster",
      file.string());
}

}  // namespace groundray
