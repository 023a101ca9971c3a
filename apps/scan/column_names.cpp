#include "apps/scan/column_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <utility>

#include "core/io/text_lines.h"

namespace groundray {
namespace {

using Synonyms = std::pair<std::string_view, std::string_view>;

// Our name of each column, and its synonyms in the order of preference.
constexpr std::array<Synonyms, 13> synonyms{
    {{"x", "x xm positionx positions0 position0 posx pointx px xyz0 points0"},
     {"y", "y ym positiony positions1 position1 posy pointy py xyz1 points1"},
     {"z", "z zm positionz positions2 position2 posz pointz pz xyz2 points2"},
     {"intensity", "intensity intensities reflectivity reflectance remission remissions refl i"},
     {"ring",
      "ring rings ringid ringindex channel channelid laserid laser laserindex beam beamid "
      "beamindex scanline line"},
     {"time",
      "time t times timestamp timestamps timeoffset offsettime reltime gpstime relativetime "
      "pointtime offset"},
     {"return_index",
      "returnindex returnnumber returnno returnid returnnum return echoindex echonumber echoid "
      "echo retnum"},
     {"pulse", "pulse pulseid pulseindex"},
     {"label",
      "label labels classification class classid semantic semantics semanticid semanticlabel "
      "objtag objecttag category sem segmentation"},
     {"incidence", "incidence incidencerad incidenceanglerad"},
     {"range", "range ranges distance distances dist r"},
     {"column", "column col columnid columnindex measurementid azimuthindex azimuthid"},
     {"range_sd", "rangesd rangesigma rangestd rangestddev rangestandarddeviation sigmarange"}}};

/// Reduces a name to its letters and digits in lower case, without CloudCompare's prefix "scalar_".
std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) out += static_cast<char>(std::tolower(byte));
  }
  constexpr std::string_view prefix = "scalar";
  if (out.starts_with(prefix) && out.size() > prefix.size()) out.erase(0, prefix.size());
  return out;
}

/// Splits "time_offset_ns" into "time_offset" and the unit in seconds.
std::pair<std::string_view, std::optional<double>> without_time_unit(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, double>, 4> units{
      {{"s sec secs seconds", 1}, {"ms msec", 1e-3}, {"us usec", 1e-6}, {"ns nsec", 1e-9}}};
  const std::size_t split = name.rfind('_');
  if (split == std::string_view::npos) return {name, std::nullopt};
  const std::string word = plain(name.substr(split));
  for (const auto& [words, unit_s] : units) {
    for (const std::string_view unit : words_of(words))
      if (word == unit) return {name.substr(0, split), unit_s};
  }
  return {name, std::nullopt};
}

}  // namespace

std::optional<NamedColumn> find_column(const std::vector<std::string>& columns,
                                       std::string_view ours) {
  const bool has_green =  // r is then red, not range
      std::ranges::any_of(columns, [](const std::string& name) { return plain(name) == "g"; });
  const auto row = std::ranges::find(synonyms, ours, &Synonyms::first);
  if (row == synonyms.end()) return std::nullopt;
  for (const std::string_view word : words_of(row->second)) {
    if (word == "r" && has_green) continue;
    for (const std::string& name : columns) {
      const auto [stem, unit_s] = ours == "time"
                                      ? without_time_unit(name)
                                      : std::pair(std::string_view(name), std::optional<double>());
      if (plain(stem) == word) return NamedColumn{name, unit_s};
    }
  }
  return std::nullopt;
}

}  // namespace groundray
