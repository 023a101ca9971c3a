#include "apps/groundray/dem/dem_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/io/file_io.h"

namespace groundray {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 5> source_words{"none", "lidar", "stereo", "fused", "filled"};

void print_points(const char* what, const char* rows, const std::vector<PointTally>& tallies) {
  constexpr std::size_t most = 8;
  if (tallies.empty()) return;
  fmt::print("{:<28} {:>12} {:>12}\n", what, rows, "points");
  PointTally sum{.name = fmt::format("all {}", tallies.size())};
  for (std::size_t i = 0; i < tallies.size(); ++i) {
    const PointTally& tally = tallies[i];
    sum.rows += tally.rows;
    sum.points += tally.points;
    if (i < most) fmt::print("{:<28} {:>12} {:>12}\n", tally.name, tally.rows, tally.points);
  }
  if (tallies.size() > most) fmt::print("... and {} more\n", tallies.size() - most);
  if (tallies.size() > 1) fmt::print("{:<28} {:>12} {:>12}\n", sum.name, sum.rows, sum.points);
}

void print_fill(const FillTally& fill) {
  print_fates(fill);
  if (fill.at_bound > 0) fmt::print("lines of sight limit {} filled samples\n", fill.at_bound);
  print_not_least(fill);
}

void print_errors(const std::vector<HeightErrors>& errors) {
  fmt::print("{:<9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>7} {:>7} {:>7}\n", "against",
             "samples", "bias m", "RMSE m", "NMAD m", "95 % m", "most m", "z rms", "z mid", "1 sd",
             "2 sd");
  for (const HeightErrors& e : errors) {
    if (e.samples == 0) continue;
    fmt::print(
        "{:<9} {:>9} {:>9.4f} {:>9.4f} {:>9.4f} {:>9.4f} {:>9.4f} {:>7.3f} {:>7.3f} {:>6.1f}% "
        "{:>6.1f}%\n",
        e.of, e.samples, e.bias_m, e.rmse_m, e.nmad_m, e.p95_m, e.largest_m, e.normalised_rms,
        e.normalised_robust, 100 * e.within_1sd, 100 * e.within_2sd);
  }
}

// JSON cannot represent NaN.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const std::vector<PointTally>& tallies, const char* rows) {
  Json all = Json::array();
  for (const PointTally& tally : tallies)
    all.push_back({{"name", tally.name}, {rows, tally.rows}, {"points", tally.points}});
  return all;
}

Json json_of(const HeightErrors& e) {
  return {{"of", e.of},
          {"samples", e.samples},
          {"bias_m", number(e.bias_m)},
          {"rmse_m", number(e.rmse_m)},
          {"nmad_m", number(e.nmad_m)},
          {"p95_m", number(e.p95_m)},
          {"largest_m", number(e.largest_m)},
          {"stated", e.stated},
          {"normalised_rms", number(e.normalised_rms)},
          {"normalised_robust", number(e.normalised_robust)},
          {"within_1sd", number(e.within_1sd)},
          {"within_2sd", number(e.within_2sd)}};
}

Json json_of(const FillTally& fill) {
  Json holes = Json::array(), trials = Json::array();
  for (const FateTally& tally : fill.fates) {
    holes.push_back({{"fate", word_of(tally.fate)},
                     {"holes", tally.holes},
                     {"samples", tally.samples},
                     {"farthest_m", number(tally.farthest_m)}});
  }
  for (const TrialReport& trial : fill.trials) {
    trials.push_back({{"shape", trial.is_long ? "long" : "compact"},
                      {"in_shadow", trial.is_shadow},
                      {"from_cells", trial.from_cells},
                      {"to_cells", number(trial.to_cells)},
                      {"tension", trial.form.tension},
                      {"smoothness", trial.form.smoothness},
                      {"samples", trial.samples},
                      {"within_1sd", number(trial.within_1sd)},
                      {"within_2sd", number(trial.within_2sd)},
                      {"widened_by", number(trial.widened_by)}});
  }
  return {{"holes", holes},
          {"trials", trials},
          {"at_bound", fill.at_bound},
          {"not_least", fill.not_least}};
}

Json json_of(const FusionCounts& counts) {
  return {{"points", counts.points},
          {"outside", counts.outside},
          {"unusable", counts.unusable},
          {"cells_without_ground", counts.without_ground},
          {"cells_uncertain", counts.uncertain},
          {"bytes_on_disk", counts.bytes_on_disk}};
}

Json json_of(const GridFrame& frame) {
  return {{"columns", frame.samples.x},
          {"rows", frame.samples.y},
          {"origin_m", {frame.origin_m.x, frame.origin_m.y}},
          {"step_m", {frame.step_m.x, frame.step_m.y}}};
}

// Adds the results of the optional steps.
void add_options(const DemReport& report, Json& json) {
  if (const auto& ground = report.ground)
    json["ground_filter"] = {
        {"ground", ground->ground}, {"above", ground->above}, {"below", ground->below}};
  if (const auto& bound = report.bound)
    json["sight"] = {{"samples", bound->samples}, {"broken", bound->broken}};
  if (const auto& smooth = report.smoothed)
    json["smoothed"] = {{"curvature_sd_per_m", smooth->curvature_sd_per_m},
                        {"rounds", smooth->rounds}};
  if (report.filled) json["filled"] = json_of(*report.filled);
  if (report.errors.empty()) return;
  json["truth"] = Json::array();
  for (const HeightErrors& errors : report.errors) json["truth"].push_back(json_of(errors));
}

}  // namespace

void print(const DemReport& report) {
  print_points("scan", "rows", report.scans);
  print_points("stereo pair", "matched", report.pairs);
  if (const auto& ground = report.ground)
    fmt::print("ground filter: {} points on the ground, {} above, {} below\n", ground->ground,
               ground->above, ground->below);
  const FusionCounts& fusion = report.fusion;
  fmt::print("fused: {} points, {} outside, {} unusable; {} cells without credible ground\n",
             fusion.points, fusion.outside, fusion.unusable, fusion.without_ground);
  if (fusion.uncertain > 0)
    fmt::print("{} cells exceed --most-sd-m and stay unmeasured\n", fusion.uncertain);
  if (const auto& bound = report.bound)
    fmt::print("lines of sight bound {} samples; {} measured ones are above their bounds\n",
               bound->samples, bound->broken);
  if (const auto& smooth = report.smoothed)
    fmt::print("smoothed in {} rounds for curvatures of {:.3g} 1/m\n", smooth->rounds,
               smooth->curvature_sd_per_m);
  if (report.filled) print_fill(*report.filled);
  std::string sources;
  for (std::size_t i = 0; i < source_words.size(); ++i)
    sources += fmt::format("{}{} {}", i == 0 ? "" : ", ", report.sources[i], source_words[i]);
  fmt::print("{} x {} samples: {}\n", report.frame.samples.x, report.frame.samples.y, sources);
  if (!report.errors.empty()) print_errors(report.errors);
  if (report.colour_m > 0)
    fmt::print("the picture's most saturated colour is {:.3g} m\n", report.colour_m);
  for (const std::string& note : report.notes) fmt::print("note: {}\n", note);
}

void write_json(const std::filesystem::path& path, const DemReport& report) {
  Json json{{"groundray_dem", 1}, {"facts", Json::object()}};
  for (const auto& [name, value] : report.facts) json["facts"][name] = value;
  const glm::dvec3& origin_m = report.georeference.origin_w_m;
  json["origin_w_m"] = {origin_m.x, origin_m.y, origin_m.z};
  json["crs"] = report.georeference.crs_name;
  json["frame"] = json_of(report.frame);
  json["scans"] = json_of(report.scans, "rows");
  json["pairs"] = json_of(report.pairs, "matched");
  json["fused"] = json_of(report.fusion);
  for (const char* part : {"ground_filter", "sight", "smoothed", "filled", "truth"})
    json[part] = nullptr;
  add_options(report, json);
  for (std::size_t i = 0; i < source_words.size(); ++i)
    json["samples"][source_words[i]] = report.sources[i];
  json["seconds"] = Json::object();
  for (const auto& [stage, seconds] : report.seconds) json["seconds"][stage] = seconds;
  json["notes"] = report.notes;
  write_text(path, json.dump(2) + "\n");
}

}  // namespace groundray
