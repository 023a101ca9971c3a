#include "apps/scene/calibration/calibration_io.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/json_fault.h"
#include "core/io/text_lines.h"
#include "core/math.h"
#include "sensors/lidar/pattern/table_pattern.h"

namespace groundray {
namespace {

using nlohmann::json;

using std::numbers::pi;

// Reads keys of a metadata file of either layout, and records every fault.
class OusterReader {
 public:
  OusterReader(const json& root, Violations& broken) : root_(root), broken_(broken) {}

  // Returns the value of a key at the top level or in one of the sections of the nested layout;
  // null if it is missing.
  const json* find(const char* key) const {
    for (const char* section : {"", "beam_intrinsics", "lidar_intrinsics", "lidar_data_format",
                                "data_format", "config_params"}) {
      const json* place = &root_;
      if (*section != '\0') {
        const auto nested = root_.find(section);
        if (nested == root_.end() || !nested->is_object()) continue;
        place = &*nested;
      }
      if (const auto value = place->find(key); value != place->end()) return &*value;
    }
    return nullptr;
  }

  // Returns the numbers of a list; none if it is missing or invalid.
  std::vector<double> numbers(const char* key, bool required, std::size_t count) const {
    const json* list = find(key);
    if (!list) {
      broken_.unless(!required, "key '{}' is missing: is this the metadata of an Ouster?", key);
      return {};
    }
    std::vector<double> values;
    bool sound = list->is_array() && !list->empty() && (count == 0 || list->size() == count);
    for (std::size_t i = 0; sound && i < list->size(); ++i) {
      sound = (*list)[i].is_number() && std::isfinite((*list)[i].get<double>());
      if (sound) values.push_back((*list)[i].get<double>());
    }
    broken_.unless(sound, "key '{}' must be a list of {} finite numbers", key,
                   count == 0 ? "one or more" : std::to_string(count));
    return sound ? values : std::vector<double>{};
  }

 private:
  const json& root_;
  Violations& broken_;
};

// Reads columns per turn and turns per second, such as "1024x10".
std::pair<int, int> read_mode(const OusterReader& reader, Violations& broken) {
  const json* mode = reader.find("lidar_mode");
  const std::string text = mode && mode->is_string() ? mode->get<std::string>() : "";
  const std::size_t cross = text.find('x');
  const auto columns = number_of<int>(std::string_view(text).substr(0, cross));
  const auto rate_hz =
      number_of<int>(cross == std::string::npos ? "" : std::string_view(text).substr(cross + 1));
  const bool sound =
      columns && rate_hz && *columns >= 1 && *columns <= 65536 && *rate_hz >= 1 && *rate_hz <= 1000;
  broken.unless(sound, "key 'lidar_mode' must be a text such as \"1024x10\": columns x rate");
  return sound ? std::pair(*columns, *rate_hz) : std::pair(1, 1);
}

// Returns the origin of the beams in H, m, without the height of the lidar frame above S.
glm::dvec3 read_beam_origin_m(const OusterReader& reader, Violations& broken) {
  if (reader.find("beam_to_lidar_transform")) {
    const auto matrix = reader.numbers("beam_to_lidar_transform", true, 16);
    if (matrix.empty()) return glm::dvec3(0);
    return glm::dvec3(matrix[3], matrix[7], matrix[11]) / 1000.;
  }
  const json* offset_mm = reader.find("lidar_origin_to_beam_origin_mm");
  const bool sound = offset_mm && offset_mm->is_number();
  broken.unless(sound,
                "key 'lidar_origin_to_beam_origin_mm' must be a number, or there must be a "
                "'beam_to_lidar_transform'");
  return {sound ? offset_mm->get<double>() / 1000 : 0, 0, 0};
}

// Applies the pose of the lidar frame, whose x axis is the encoder's zero, in the sensor frame.
void place_in_sensor(const std::vector<double>& matrix, SpinningPattern& pattern,
                     Violations& broken) {
  if (matrix.empty()) return;
  constexpr double tolerance = 1e-6;  // files have at least six decimals
  const bool upright = std::abs(matrix[10] - 1) < tolerance &&
                       std::abs(matrix[0] - matrix[5]) < tolerance &&
                       std::abs(matrix[1] + matrix[4]) < tolerance &&
                       std::abs(math::hypot(matrix[0], matrix[4]) - 1) < tolerance;
  broken.unless(upright && matrix[3] == 0 && matrix[7] == 0,
                "key 'lidar_to_sensor_transform' must be a rotation about z and a translation "
                "along z, in mm, row by row");
  pattern.start_azimuth_rad = math::atan2(matrix[4], matrix[0]);
  for (Beam& beam : pattern.beams) beam.origin_m.z += matrix[11] / 1000;
}

// Returns the field of view of a column window. Its ends are half a column outside the window, so
// that rounding never decides about a column.
std::optional<AzimuthInterval> view_of(const std::vector<double>& window, int columns,
                                       double start_azimuth_rad, Violations& broken) {
  if (window.empty()) return std::nullopt;
  const double first = window[0];
  const double last = window[1];
  const auto column = [&](double c) { return c >= 0 && c < columns && c == std::floor(c); };
  broken.unless(column(first) && column(last),
                "key 'column_window' = [{}, {}] must be two columns from 0 to {}", first, last,
                columns - 1);
  const double count = last - first + (last < first ? columns : 0) + 1;
  if (count >= columns) return std::nullopt;
  const double to_rad = start_azimuth_rad - 2 * pi * (first - 0.5) / columns;
  return AzimuthInterval{to_rad - 2 * pi * count / columns, to_rad};
}

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

SpinningPattern parse_ouster_metadata(std::string_view text, const std::filesystem::path& path) {
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& fault) {
    throw Error("{}: {}", path.string(), fault_in_words(fault));
  }
  if (!root.is_object()) throw Error("{}: must be a JSON object of keys and values", path.string());
  Violations broken(path.string());
  const OusterReader reader(root, broken);
  const std::vector<double> altitudes_deg = reader.numbers("beam_altitude_angles", true, 0);
  const std::vector<double> azimuths_deg =
      reader.numbers("beam_azimuth_angles", true, altitudes_deg.size());
  const auto [columns, rate_hz] = read_mode(reader, broken);
  const glm::dvec3 origin_m = read_beam_origin_m(reader, broken);
  broken.unless(altitudes_deg.size() <= most_beams, "key 'beam_altitude_angles' has {} beams",
                altitudes_deg.size());
  SpinningPattern pattern;
  pattern.rate_hz = rate_hz;
  pattern.firing_period_s = 1. / (columns * rate_hz);
  for (std::size_t row = 0; row < std::min(altitudes_deg.size(), azimuths_deg.size()); ++row) {
    broken.unless(std::abs(altitudes_deg[row]) <= 90,
                  "key 'beam_altitude_angles': {} must be from -90 to 90", altitudes_deg[row]);
    Beam beam;
    beam.elevation_rad = glm::radians(altitudes_deg[row]);
    beam.azimuth_offset_rad = -glm::radians(azimuths_deg[row]);
    beam.origin_m = origin_m;
    beam.ring = static_cast<std::uint16_t>(row);
    pattern.beams.push_back(beam);
  }
  place_in_sensor(reader.numbers("lidar_to_sensor_transform", true, 16), pattern, broken);
  pattern.field_of_view = view_of(reader.numbers("column_window", false, 2), columns,
                                  pattern.start_azimuth_rad, broken);
  broken.throw_if_any();
  return pattern;
}

SpinningPattern load_ouster_metadata(const std::filesystem::path& path) {
  return parse_ouster_metadata(read_text(path), path);
}

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
  if (extension == ".xml")
    return with_calibration(*spinning, parse_velodyne_xml(read_text(file), file));
  if (extension == ".csv")
    return with_calibration(*spinning, parse_hesai_csv(read_text(file), file));
  if (extension == ".yaml" || extension == ".yml")
    return with_calibration(*spinning, load_velodyne_yaml(file));
  throw Error(
      "{}: must be .xml, .yaml or .yml of a Velodyne, .csv of a Hesai or .json of an Ouster",
      file.string());
}

}  // namespace groundray
