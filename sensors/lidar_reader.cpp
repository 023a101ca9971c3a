#include "sensors/lidar_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <string>
#include <utility>

#include "core/error.h"
#include "sensors/calibration_io.h"

namespace groundray {
namespace {

using yaml::any_number;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::not_negative;
using yaml::positive;
using yaml::Rule;

namespace fs = std::filesystem;

constexpr Rule elevation_rule{[](double value) { return std::abs(value) <= 90; },
                              "must be from -90 to 90"};

constexpr Rule share_rule{[](double value) { return value > 0 && value <= 1; },
                          "must be > 0 and at most 1"};
constexpr Rule at_least_one{[](double value) { return value >= 1; }, "must be 1 or more"};

void check_turn(const Node& node, std::string_view key, const SpinningPattern& pattern,
                Faults& faults) {
  const double sequences = 1 / (pattern.rate_hz * pattern.firing_period_s);
  if (sequences < 1 - 1e-9 || sequences > SpinningScan::most_sequences) {
    faults.add(node, key, "makes {:.6g} firing sequences in a turn, but must make 1 to {}",
               sequences, SpinningScan::most_sequences);
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
constexpr Rule loop_rule{
    [](double value) { return value >= 0 && value <= 255 && value == std::floor(value); },
    "must be a whole number from 0 to 255"};
constexpr std::array beam_columns{
    BeamColumn{"loop", loop_rule, [](Beam& b, double v) { b.loop = static_cast<int>(v); }, false},
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

const Node* read_scaled(Map& map, std::string_view key, Need need, double scale, double& into,
                        Rule rule = not_negative) {
  double value = into / scale;
  const Node* node = map.read_number(key, need, value, rule);
  if (node) into = value * scale;
  return node;
}

void read_pair(Map& map, std::string_view key, double scale, glm::dvec2& into) {
  std::array<double, 2> pair{};
  if (map.read_numbers(key, Need::Optional, pair, not_negative))
    into = glm::dvec2(pair[0], pair[1]) * scale;
}

SpinningPattern read_spinning(Map& root, Faults& faults) {
  SpinningPattern pattern;
  if (auto rotation = root.map("rotation", Need::Required)) {
    rotation->read_number("rate_hz", Need::Required, pattern.rate_hz, positive);
    rotation->read_choice<SpinningPattern::Sense>(
        "sense", Need::Required, pattern.sense,
        {{"clockwise", SpinningPattern::Sense::Clockwise},
         {"counter_clockwise", SpinningPattern::Sense::CounterClockwise}});
    double start_azimuth_deg = 0;
    rotation->read_number("start_azimuth_deg", Need::Required, start_azimuth_deg);
    pattern.start_azimuth_rad = glm::radians(start_azimuth_deg);
    std::array<double, 2> view_deg{};
    if (const Node* at = rotation->read_numbers("field_of_view_deg", Need::Optional, view_deg)) {
      if (view_deg[0] >= view_deg[1] || view_deg[1] > view_deg[0] + 360)
        faults.add(*at, "field_of_view_deg", "must go counter-clockwise, by one turn at most");
      pattern.field_of_view = {glm::radians(view_deg[0]), glm::radians(view_deg[1])};
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
  line.read_choice<LinePattern::Mirror>("mirror", Need::Required, pattern.mirror,
                                        {{"triangle", LinePattern::Mirror::Triangle},
                                         {"sine", LinePattern::Mirror::Sine},
                                         {"polygon", LinePattern::Mirror::Polygon}});
  line.read_choice<LinePattern::Plane>(
      "plane", Need::Required, pattern.plane,
      {{"upright", LinePattern::Plane::Upright}, {"across", LinePattern::Plane::Across}});
  std::array<double, 2> view_deg{};
  line.read_numbers("field_of_view_deg", Need::Required, view_deg);
  pattern.from_rad = glm::radians(view_deg[0]);
  pattern.to_rad = glm::radians(view_deg[1]);
  line.read_number("line_rate_hz", Need::Required, pattern.line_rate_hz, positive);
  line.read_number("pulse_rate_hz", Need::Required, pattern.pulse_rate_hz, positive);
  std::uint16_t facets = 0;
  std::uint32_t lines = 1;
  line.read_whole("facets", Need::Optional, facets);
  line.read_whole("lines_per_sweep", Need::Optional, lines);
  pattern.facets = facets;
  pattern.lines_per_sweep = static_cast<int>(std::min(lines, 1'000'000u));
  line.read_number("head_rate_hz", Need::Optional, pattern.head_rate_hz);
  double start_deg = 0;
  line.read_number("head_start_deg", Need::Optional, start_deg);
  pattern.head_start_rad = glm::radians(start_deg);
  line.close();
  return pattern;
}

RisleyPattern read_risley(Map risley, Map& root, Faults& faults) {
  RisleyPattern pattern;
  for (const Node& node : risley.list("prisms", Need::Required)) {
    Map map(node, "prisms", faults);
    WedgePrism prism;
    double wedge_deg = 0, base_deg = 0;
    map.read_number("wedge_deg", Need::Required, wedge_deg, positive);
    map.read_number("refractive_index", Need::Required, prism.refractive_index, at_least_one);
    map.read_number("rate_hz", Need::Required, prism.rate_hz);
    map.read_number("base_deg", Need::Optional, base_deg);
    map.read_choice<WedgePrism::Tilted>(
        "tilted_face", Need::Optional, prism.tilted,
        {{"exit", WedgePrism::Tilted::Exit}, {"entry", WedgePrism::Tilted::Entry}});
    prism.wedge_rad = glm::radians(wedge_deg);
    prism.base_rad = glm::radians(base_deg);
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
  std::array<double, 2> view_deg{};
  map.read_numbers("field_of_view_deg", Need::Required, view_deg, positive);
  pixels.horizontal_view_rad = glm::radians(view_deg[0]);
  pixels.vertical_view_rad = glm::radians(view_deg[1]);
  map.read_choice<PixelArray::Spacing>("spacing", Need::Optional, pixels.spacing,
                                       {{"equal_angles", PixelArray::Spacing::EqualAngles},
                                        {"equal_tangents", PixelArray::Spacing::EqualTangents}});
  double row_s = 0, column_s = 0, frame_rate_hz = 10;
  read_scaled(map, "row_period_us", Need::Optional, 1e-6, row_s);
  read_scaled(map, "column_period_us", Need::Optional, 1e-6, column_s);
  const bool sound = map.read_number("frame_rate_hz", Need::Required, frame_rate_hz, positive);
  map.close();
  return sound ? raster_pattern(pixels, row_s, column_s, 1 / frame_rate_hz) : TablePattern{};
}

TablePattern read_table(Map map, const fs::path& path) {
  std::string file;
  double period_s = 0;
  const bool named = map.read_text("csv", Need::Required, file);
  const bool sound = map.read_number("period_s", Need::Required, period_s, positive);
  std::uint32_t sweeps = 1;
  map.read_whole("sweeps_per_period", Need::Optional, sweeps);
  map.close();
  if (!named || !sound) return {};
  TablePattern pattern = load_table(beside(path, file), period_s);
  pattern.sweeps_per_period = static_cast<int>(std::min(sweeps, 1'000'000u));
  return pattern;
}

// A file has the keys of one kind of pattern; that of a spinning head is told by `rotation`.
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

void read_beam(Map beam, BeamSpec& spec) {
  beam.read_choice<BeamSpec::Profile>(
      "profile", Need::Optional, spec.profile,
      {{"gaussian", BeamSpec::Profile::Gaussian}, {"top_hat", BeamSpec::Profile::TopHat}});
  beam.read_choice<BeamSpec::Width>("width", Need::Optional, spec.width,
                                    {{"fwhm", BeamSpec::Width::FullWidthHalfMaximum},
                                     {"inverse_e_square", BeamSpec::Width::InverseESquare}});
  read_pair(beam, "divergence_mrad", 1e-3, spec.divergence_rad);
  read_pair(beam, "aperture_mm", 1e-3, spec.aperture_m);
  std::uint32_t sub_rays = static_cast<std::uint32_t>(spec.sub_rays);
  if (beam.read_whole("sub_rays", Need::Optional, sub_rays))
    spec.sub_rays = spec.most_sub_rays = static_cast<int>(std::min(sub_rays, 1u << 20));
  std::uint32_t most = static_cast<std::uint32_t>(spec.most_sub_rays);
  beam.read_whole("most_sub_rays", Need::Optional, most);
  spec.most_sub_rays = static_cast<int>(std::min(most, 1u << 20));
  beam.read_choice<BeamSpec::Turn>(
      "turn", Need::Optional, spec.turn,
      {{"fixed", BeamSpec::Turn::Fixed}, {"each_pulse", BeamSpec::Turn::EachPulse}});
  beam.close();
}

void read_pulse(Map& laser, PulseSpec& pulse, Faults& faults) {
  read_scaled(laser, "pulse_fwhm_ns", Need::Optional, 1e-9, pulse.fwhm_s, positive);
  for (const Node& node : laser.list("pulse_shape", Need::Optional)) {
    if (const auto value = yaml::number(node, "pulse_shape", not_negative, faults))
      pulse.shape.push_back(*value);
  }
  read_scaled(laser, "pulse_shape_step_ns", Need::Optional, 1e-9, pulse.shape_step_s, positive);
}

void read_laser(Map laser, LightSpec& light, Faults& faults) {
  laser.read_number("wavelength_nm", Need::Required, light.wavelength_nm, positive);
  read_scaled(laser, "pulse_energy_nj", Need::Required, 1e-9, light.optics.pulse_energy_j,
              positive);
  light.pulse.energy_j = light.optics.pulse_energy_j;
  read_pulse(laser, light.pulse, faults);
  laser.read_number("efficiency", Need::Optional, light.optics.emitter_efficiency, share_rule);
  laser.close();
}

void read_noise(Map map, LightSpec& light) {
  NoiseSpec noise;
  map.read_number("nep_w_per_sqrt_hz", Need::Required, noise.nep_w_per_sqrt_hz, not_negative);
  map.read_number("quantum_efficiency", Need::Optional, noise.quantum_efficiency, share_rule);
  map.read_number("excess_noise_factor", Need::Optional, noise.excess_noise_factor, at_least_one);
  map.read_number("false_alarm_rate_hz", Need::Optional, noise.false_alarm_rate_hz, not_negative);
  map.read_number("sun_w_m2_nm", Need::Optional, light.sun.irradiance_w_m2_nm, not_negative);
  map.read_number("filter_width_nm", Need::Optional, light.sun.filter_width_nm, not_negative);
  double field_of_view_rad = 0;
  read_scaled(map, "field_of_view_mrad", Need::Optional, 1e-3, field_of_view_rad);
  light.sun.field_of_view_sr = cone_solid_angle_sr(std::min(field_of_view_rad, 3.0));
  map.close();
  light.receiver.noise = noise;
}

void read_intensity(Map& map, IntensitySpec& intensity) {
  map.read_choice<IntensitySpec::Scale>("intensity", Need::Optional, intensity.scale,
                                        {{"power", IntensitySpec::Scale::Power},
                                         {"reflectance", IntensitySpec::Scale::Reflectance},
                                         {"eight_bit", IntensitySpec::Scale::EightBit}});
  map.read_number("intensity_gain", Need::Optional, intensity.gain, positive);
  map.read_number("full_scale_reflectance", Need::Optional, intensity.full_scale_reflectance,
                  Rule{[](double value) { return value > 1; }, "must be > 1"});
}

void read_receiver(Map map, LightSpec& light) {
  ReceiverSpec& receiver = light.receiver;
  read_scaled(map, "aperture_mm", Need::Required, 1e-3, light.optics.aperture_diameter_m, positive);
  map.read_number("efficiency", Need::Optional, light.optics.receiver_efficiency, share_rule);
  read_scaled(map, "response_fwhm_ns", Need::Optional, 1e-9, receiver.response_fwhm_s);
  read_scaled(map, "sample_interval_ns", Need::Optional, 1e-9, receiver.sample_interval_s);
  using Timing = ReceiverSpec::Timing;
  map.read_choice<Timing>("timing", Need::Optional, receiver.timing,
                          {{"leading_edge", Timing::LeadingEdge},
                           {"constant_fraction", Timing::ConstantFraction},
                           {"peak", Timing::Peak},
                           {"centre_of_gravity", Timing::CentreOfGravity}});
  map.read_number("threshold_w", Need::Optional, receiver.threshold_w, not_negative);
  map.read_number("fraction", Need::Optional, receiver.fraction, share_rule);
  using Returns = ReceiverSpec::Returns;
  map.read_choice<Returns>("returns", Need::Optional, receiver.returns,
                           {{"first", Returns::First},
                            {"last", Returns::Last},
                            {"strongest", Returns::Strongest},
                            {"second", Returns::Second},
                            {"dual", Returns::Dual},
                            {"all", Returns::All}});
  auto most = static_cast<std::uint8_t>(receiver.most_returns);
  map.read_whole("most_returns", Need::Optional, most);
  receiver.most_returns = most;
  read_scaled(map, "dead_time_ns", Need::Optional, 1e-9, receiver.dead_time_s);
  map.read_number("saturation_w", Need::Optional, receiver.saturation_w, positive);
  map.read_number("calibrated_group_index", Need::Optional, receiver.calibrated_group_index,
                  at_least_one);
  std::array<double, 2> overlap{};
  if (map.read_numbers("overlap_m", Need::Optional, overlap, not_negative))
    light.overlap = {overlap[0], overlap[1]};
  read_scaled(map, "range_step_mm", Need::Optional, 1e-3, light.range_step_m);
  read_intensity(map, light.intensity);
  if (auto noise = map.map("noise", Need::Optional)) read_noise(std::move(*noise), light);
  map.close();
}

// Beam, laser, receiver and what comes of them, as lidar files and scenes say it.
void read_physics(Map& map, LidarSpec& lidar, Faults& faults) {
  if (auto beam = map.map("beam", Need::Optional)) read_beam(std::move(*beam), lidar.beam);
  auto laser = map.map("laser", Need::Optional);
  auto receiver = map.map("receiver", Need::Optional);
  if (laser.has_value() != receiver.has_value()) {
    faults.add(map.node(), laser ? "laser" : "receiver",
               "needs '{}' beside it: both make light into echoes", laser ? "receiver" : "laser");
  }
  if (laser && receiver) {
    lidar.light.emplace();
    read_laser(std::move(*laser), *lidar.light, faults);
    read_receiver(std::move(*receiver), *lidar.light);
  }
  map.read_number("range_noise_sigma_m", Need::Optional, lidar.range_noise_sigma_m, not_negative);
  read_scaled(map, "angular_jitter_mrad", Need::Optional, 1e-3, lidar.angular_jitter_rad);
}

}  // namespace

// Names that GDAL knows how to open but that are no paths (/vsizip/..., NETCDF:"..."), stay as they
// are.
fs::path beside(const fs::path& file, const std::string& relative) {
  const std::size_t colon = relative.find(':');
  if (relative.starts_with("/vsi") || (colon != std::string::npos && colon < relative.find('/')))
    return relative;
  return (file.parent_path() / relative).lexically_normal();
}

LidarSpec read_lidar(const Node& node, const fs::path& path, Faults& faults) {
  LidarSpec lidar;
  Map root(node, "", faults);
  yaml::check_version(root, "groundray_lidar", faults);
  root.read_text("model", Need::Required, lidar.model);
  lidar.pattern = read_pattern(root, path, faults);
  if (auto gate = root.map("range_gate_m", Need::Optional)) {
    gate->read_number("near", Need::Optional, lidar.gate.near_m, not_negative);
    gate->read_number("far", Need::Optional, lidar.gate.far_m, positive);
    if (lidar.gate.near_m >= lidar.gate.far_m) {
      faults.add(gate->node(), "range_gate_m", "near must be less than far: are they swapped?");
    }
    gate->close();
  }
  read_physics(root, lidar, faults);
  if (const Node* sources = root.find("sources", Need::Optional)) {
    const Map texts(*sources, "sources", faults);
    for (std::size_t i = 1; sources->kind == Node::Kind::Map && i < sources->items.size(); i += 2) {
      yaml::is_text(sources->items[i], sources->items[i - 1].text, faults);
    }
  }
  root.close();
  return lidar;
}

void change_lidar(Map& entry, const fs::path& path, LidarSpec& lidar, Faults& faults) {
  std::string unit;
  if (const Node* at = entry.read_text("calibration", Need::Optional, unit)) {
    try {
      lidar.pattern = calibrated(lidar.pattern, beside(path, unit));
    } catch (const Error& fault) {
      faults.add(*at, "calibration", "the unit cannot be read:\n{}", fault.what());
    }
  }
  double rate_hz = 0;
  if (const Node* at = entry.read_number("rate_hz", Need::Optional, rate_hz, positive)) {
    if (auto* pattern = std::get_if<SpinningPattern>(&lidar.pattern)) {
      pattern->rate_hz = rate_hz;
      if (pattern->firing_period_s > 0) check_turn(*at, "rate_hz", *pattern, faults);
    } else {
      faults.add(*at, "rate_hz", "is for spinning heads alone; change the lidar's file instead");
    }
  }
  std::array<double, 2> gate{};
  if (const Node* at = entry.read_numbers("range_gate_m", Need::Optional, gate, not_negative)) {
    if (gate[0] >= gate[1]) {
      faults.add(*at, "range_gate_m", "[{}, {}] is empty: are near and far swapped?", gate[0],
                 gate[1]);
    }
    lidar.gate = {gate[0], gate[1]};
  }
  read_physics(entry, lidar, faults);
  entry.read_choice<LidarSpec::ErrorBound>(
      "error_bound", Need::Optional, lidar.error_bound,
      {{"omit", LidarSpec::ErrorBound::Omit}, {"report", LidarSpec::ErrorBound::Report}});
  entry.read_choice<LidarSpec::NoReturns>(
      "no_returns", Need::Optional, lidar.no_returns,
      {{"omit", LidarSpec::NoReturns::Omit}, {"report", LidarSpec::NoReturns::Report}});
  entry.read_choice<LidarSpec::WaveformOutput>(
      "waveforms", Need::Optional, lidar.waveforms,
      {{"omit", LidarSpec::WaveformOutput::Omit}, {"keep", LidarSpec::WaveformOutput::Keep}});
  entry.read_choice<LidarSpec::Points>(
      "points", Need::Optional, lidar.points,
      {{"as_fired", LidarSpec::Points::AsFired}, {"at_stamp", LidarSpec::Points::AtStamp}});
}

}  // namespace groundray
