#include "apps/scan/column_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <span>
#include <utility>

namespace groundray {
namespace {

using Synonyms = std::span<const std::string_view>;

constexpr std::array<std::string_view, 10> x_words{
    "x", "xm", "positionx", "positions0", "position0", "posx", "pointx", "px", "xyz0", "points0"};
constexpr std::array<std::string_view, 10> y_words{
    "y", "ym", "positiony", "positions1", "position1", "posy", "pointy", "py", "xyz1", "points1"};
constexpr std::array<std::string_view, 10> z_words{
    "z", "zm", "positionz", "positions2", "position2", "posz", "pointz", "pz", "xyz2", "points2"};
constexpr std::array<std::string_view, 8> intensity_words{
    "intensity", "intensities", "reflectivity", "reflectance",
    "remission", "remissions",  "refl",         "i"};
constexpr std::array<std::string_view, 14> ring_words{
    "ring",  "rings",      "ringid", "ringindex", "channel",   "channelid", "laserid",
    "laser", "laserindex", "beam",   "beamid",    "beamindex", "scanline",  "line"};
constexpr std::array<std::string_view, 12> time_words{
    "time",       "t",       "times",   "timestamp",    "timestamps", "timeoffset",
    "offsettime", "reltime", "gpstime", "relativetime", "pointtime",  "offset"};
constexpr std::array<std::string_view, 11> return_words{
    "returnindex", "returnnumber", "returnno", "returnid", "returnnum", "return",
    "echoindex",   "echonumber",   "echoid",   "echo",     "retnum"};
constexpr std::array<std::string_view, 3> pulse_words{"pulse", "pulseid", "pulseindex"};
constexpr std::array<std::string_view, 14> label_words{
    "label",     "labels",      "classification", "class",  "classid",   "semantic",
    "semantics", "semanticid",  "semanticlabel",  "objtag", "objecttag", "category",
    "sem",       "segmentation"};
constexpr std::array<std::string_view, 3> incidence_words{"incidence", "incidencerad",
                                                          "incidenceanglerad"};
constexpr std::array<std::string_view, 6> range_words{"range",     "ranges", "distance",
                                                      "distances", "dist",   "r"};

constexpr std::array<std::string_view, 7> column_words{
    "column", "col", "columnid", "columnindex", "measurementid", "azimuthindex", "azimuthid"};
constexpr std::array<std::string_view, 6> range_sd_words{
    "rangesd", "rangesigma", "rangestd", "rangestddev", "rangestandarddeviation", "sigmarange"};

Synonyms synonyms_of(std::string_view ours) {
  const std::array<std::pair<std::string_view, Synonyms>, 13> all{{{"x", x_words},
                                                                   {"y", y_words},
                                                                   {"z", z_words},
                                                                   {"intensity", intensity_words},
                                                                   {"ring", ring_words},
                                                                   {"time", time_words},
                                                                   {"return_index", return_words},
                                                                   {"pulse", pulse_words},
                                                                   {"label", label_words},
                                                                   {"incidence", incidence_words},
                                                                   {"range", range_words},
                                                                   {"column", column_words},
                                                                   {"range_sd", range_sd_words}}};
  const auto found = std::ranges::find(all, ours, &std::pair<std::string_view, Synonyms>::first);
  return found == all.end() ? Synonyms() : found->second;
}

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
  static constexpr std::array<std::pair<std::string_view, double>, 10> units{{{"s", 1},
                                                                              {"sec", 1},
                                                                              {"secs", 1},
                                                                              {"seconds", 1},
                                                                              {"ms", 1e-3},
                                                                              {"msec", 1e-3},
                                                                              {"us", 1e-6},
                                                                              {"usec", 1e-6},
                                                                              {"ns", 1e-9},
                                                                              {"nsec", 1e-9}}};
  const std::size_t split = name.rfind('_');
  if (split == std::string_view::npos) return {name, std::nullopt};
  for (const auto& [unit, unit_s] : units) {
    if (plain(name.substr(split)) == unit) return {name.substr(0, split), unit_s};
  }
  return {name, std::nullopt};
}

}  // namespace

std::optional<NamedColumn> find_column(const std::vector<std::string>& columns,
                                       std::string_view ours) {
  const bool has_green =  // r is then red, not range
      std::ranges::any_of(columns, [](const std::string& name) { return plain(name) == "g"; });
  for (const std::string_view word : synonyms_of(ours)) {
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
