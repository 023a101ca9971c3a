#include "apps/groundray/dem/dem_report.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "apps/groundray/dem/filling.h"
#include "apps/groundray/result_files.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "terrain/dem/layers_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // writes numbers that are not finite as null

constexpr std::array<const char*, 5> source_words{"none", "lidar", "stereo", "fused", "filled"};

// Returns the number of samples of each HeightSource.
std::array<std::size_t, 5> sources_of(const DemLayers& layers) {
  std::array<std::size_t, 5> counts{};
  for (const HeightSource source : layers.source) ++counts[static_cast<std::size_t>(source)];
  return counts;
}

void print_points(const char* what, const char* rows, const std::vector<PointTally>& tallies) {
  constexpr std::size_t most = 8;
  if (tallies.empty()) return;
  print_text(stdout, "{:<28} {:>12} {:>12}\n", what, rows, "points");
  PointTally sum{.name = fmt::format("all {}", tallies.size())};
  for (std::size_t i = 0; i < tallies.size(); ++i) {
    const PointTally& tally = tallies[i];
    sum.rows += tally.rows;
    sum.points += tally.points;
    if (i < most)
      print_text(stdout, "{:<28} {:>12} {:>12}\n", tally.name, tally.rows, tally.points);
  }
  if (tallies.size() > most) print_text(stdout, "... and {} more\n", tallies.size() - most);
  if (tallies.size() > 1)
    print_text(stdout, "{:<28} {:>12} {:>12}\n", sum.name, sum.rows, sum.points);
}

// Pixels of stereo pairs that became points, or why they did not.
struct PixelUse {
  const char* key;
  const char* meaning;
  std::uint64_t pixels;
};
using PixelUses = std::array<PixelUse, 10>;

PixelUses uses_of(const StereoTally& tally) {
  const UnmatchedCounts& none = tally.unmatched;
  return {
      {{"points", "points", tally.points},
       {"between", "matched, between the rows and columns of points", tally.between},
       {"too_uncertain", "matched, but the disparity is less certain than a tenth of itself",
        tally.too_uncertain},
       {"out_of_limits", "matched, but beyond the limits of depth or confidence",
        tally.out_of_limits},
       {"unrefined", "no texture, or least squares disagree with the search", none.unrefined},
       {"uncertain", "too little texture for the noise", none.uncertain},
       {"speckle", "in a patch that is too small", none.speckle},
       {"inconsistent", "another match from right to left, as where hidden on the right",
        none.inconsistent},
       {"ambiguous", "no single best match, or outside the right camera's field", none.ambiguous},
       {"unseen", "outside the left camera's field", none.unseen}}};
}

void print_pixels(const std::vector<PointTally>& pairs) {
  if (pairs.empty()) return;
  PixelUses sum = uses_of({});
  std::uint64_t all = 0;
  for (const PointTally& pair : pairs) {
    const PixelUses uses = uses_of(pair.pixels);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i].pixels += uses[i].pixels;
      all += uses[i].pixels;
    }
  }
  print_text(stdout, "pixels of the pairs:\n");
  for (const PixelUse& use : sum) {
    print_text(stdout, "{:>12} {:>5.1f} %  {}\n", use.pixels,
               100 * static_cast<double>(use.pixels) / static_cast<double>(all), use.meaning);
  }
}

void print_fill(const FillTally& fill) {
  print_fates(fill);
  if (fill.at_bound > 0)
    print_text(stdout, "lines of sight limit {} filled samples\n", fill.at_bound);
  print_not_least(fill);
}

void print_errors(const std::vector<HeightErrors>& errors) {
  print_text(stdout, "{:<9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>7} {:>7} {:>7}\n",
             "against", "samples", "bias m", "RMSE m", "NMAD m", "95 % m", "most m", "z rms",
             "z mid", "1 sd", "2 sd");
  for (const HeightErrors& e : errors) {
    if (e.samples == 0) continue;
    print_text(
        stdout,
        "{:<9} {:>9} {:>9.4f} {:>9.4f} {:>9.4f} {:>9.4f} {:>9.4f} {:>7.3f} {:>7.3f} {:>6.1f}% "
        "{:>6.1f}%\n",
        e.of, e.samples, e.bias_m, e.rmse_m, e.nmad_m, e.p95_m, e.largest_m, e.normalised_rms,
        e.normalised_robust, 100 * e.within_1sd, 100 * e.within_2sd);
  }
}

Json json_of(const std::vector<PointTally>& tallies, const char* rows) {
  Json all = Json::array();
  for (const PointTally& tally : tallies)
    all.push_back({{"name", tally.name}, {rows, tally.rows}, {"points", tally.points}});
  return all;
}

Json json_of_pairs(const std::vector<PointTally>& pairs) {
  Json all = json_of(pairs, "matched");
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (const PixelUse& use : uses_of(pairs[i].pixels)) all[i]["pixels"][use.key] = use.pixels;
  return all;
}

Json json_of(const HeightErrors& e) {
  return {{"of", e.of},
          {"samples", e.samples},
          {"bias_m", e.bias_m},
          {"rmse_m", e.rmse_m},
          {"nmad_m", e.nmad_m},
          {"p95_m", e.p95_m},
          {"largest_m", e.largest_m},
          {"stated", e.stated},
          {"normalised_rms", e.normalised_rms},
          {"normalised_robust", e.normalised_robust},
          {"within_1sd", e.within_1sd},
          {"within_2sd", e.within_2sd}};
}

Json json_of(const FilledHeights& filled) {
  const FillTally fill = tally_of(filled);
  Json holes = Json::array(), trials = Json::array();
  for (const FateTally& tally : fill.fates) {
    holes.push_back({{"fate", word_of(tally.fate)},
                     {"holes", tally.holes},
                     {"samples", tally.samples},
                     {"farthest_m", tally.farthest_m}});
  }
  for (const TrialReport& trial : filled.trials) {
    trials.push_back({{"shape", trial.is_long ? "long" : "compact"},
                      {"in_shadow", trial.is_shadow},
                      {"from_cells", trial.from_cells},
                      {"to_cells", trial.to_cells},
                      {"tension", trial.form.tension},
                      {"smoothness", trial.form.smoothness},
                      {"samples", trial.samples},
                      {"within_1sd", trial.within_1sd},
                      {"within_2sd", trial.within_2sd},
                      {"widened_by", trial.widened_by}});
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

// ----- files

template <typename T>
std::vector<float> numbers(const std::vector<T>& values) {
  std::vector<float> all;
  all.reserve(values.size());
  for (const T value : values) all.push_back(static_cast<float>(value));
  return all;
}

std::vector<float> degrees(std::vector<float> values_rad) {
  for (float& value : values_rad) value *= static_cast<float>(180 / std::numbers::pi);
  return values_rad;
}

void write_layers(const fs::path& path, const DemLayers& layers, const Georeference& georeference) {
  const auto lidar = numbers(layers.lidar), stereo = numbers(layers.stereo),
             surfaces = numbers(layers.surfaces), source = numbers(layers.source),
             slope_deg = degrees(layers.slope_rad);
  const std::vector<RasterLayer> bands{{"elevation", "m", layers.elevation_m},
                                       {"variance", "m2", layers.variance_m2},
                                       {"n_lidar", "", lidar},
                                       {"n_stereo", "", stereo},
                                       {"chi2", "", layers.chi2},
                                       {"n_surfaces", "", surfaces},
                                       {"source", "", source},
                                       {"distance_to_data", "m", layers.to_data_m},
                                       {"fill_sd", "m", layers.fill_sd_m},
                                       {"upper_bound", "m", layers.upper_bound_m},
                                       {"slope", "deg", slope_deg},
                                       {"overhang", "m", layers.overhang_m},
                                       {"clearance", "m", layers.clearance_m}};
  write_layers(path, layers.frame, georeference, bands);
}

void write_json(const fs::path& path, const ReportFacts& facts, const DemReport& report) {
  const DemResult& result = report.result;
  Json json{{"groundray_dem", 1}, {"facts", Json::object()}};
  for (const auto& [name, value] : facts) json["facts"][name] = value;
  const glm::dvec3& origin_m = report.georeference.origin_w_m;
  json["origin_w_m"] = {origin_m.x, origin_m.y, origin_m.z};
  json["crs"] = report.georeference.crs_name;
  json["frame"] = json_of(result.layers.frame);
  json["scans"] = json_of(report.scans, "rows");
  json["pairs"] = json_of_pairs(report.pairs);
  json["fused"] = json_of(result.fusion);
  for (const char* part : {"ground_filter", "sight", "smoothed", "filled", "truth"})
    json[part] = nullptr;
  if (const auto& ground = result.ground)
    json["ground_filter"] = {
        {"ground", ground->ground}, {"above", ground->above}, {"below", ground->below}};
  if (const auto& bound = result.bound)
    json["sight"] = {{"samples", bound->samples}, {"broken", bound->broken}};
  if (const auto& smooth = result.smoothed)
    json["smoothed"] = {{"curvature_sd_per_m", smooth->curvature_sd_per_m},
                        {"rounds", smooth->rounds}};
  if (result.filled) json["filled"] = json_of(*result.filled);
  if (report.truth) {
    json["truth"] = Json::array();
    for (const HeightErrors& errors : report.truth->errors)
      json["truth"].push_back(json_of(errors));
  }
  const auto counts = sources_of(result.layers);
  for (std::size_t i = 0; i < source_words.size(); ++i)
    json["samples"][source_words[i]] = counts[i];
  json["seconds"] = Json::object();
  for (const auto& [stage, seconds] : report.seconds) json["seconds"][stage] = seconds;
  json["notes"] = report.notes;
  write_text(path, json.dump(2) + "\n");
}

void print(const DemReport& report) {
  const DemResult& result = report.result;
  print_points("scan", "rows", report.scans);
  print_points("stereo pair", "matched", report.pairs);
  print_pixels(report.pairs);
  if (const auto& ground = result.ground)
    print_text(stdout, "ground filter: {} points on the ground, {} above, {} below\n",
               ground->ground, ground->above, ground->below);
  const FusionCounts& fusion = result.fusion;
  print_text(stdout,
             "fused: {} points, {} outside, {} unusable; {} cells without credible ground\n",
             fusion.points, fusion.outside, fusion.unusable, fusion.without_ground);
  if (fusion.uncertain > 0)
    print_text(stdout, "{} cells exceed --most-sd-m and stay unmeasured\n", fusion.uncertain);
  if (const auto& bound = result.bound)
    print_text(stdout, "lines of sight bound {} samples; {} measured ones are above their bounds\n",
               bound->samples, bound->broken);
  if (const auto& smooth = result.smoothed)
    print_text(stdout, "smoothed in {} rounds for curvatures of {:.3g} 1/m\n", smooth->rounds,
               smooth->curvature_sd_per_m);
  if (result.filled) print_fill(tally_of(*result.filled));
  std::string sources;
  const auto counts = sources_of(result.layers);
  for (std::size_t i = 0; i < source_words.size(); ++i)
    sources += fmt::format("{}{} {}", i == 0 ? "" : ", ", counts[i], source_words[i]);
  const glm::ivec2 samples = result.layers.frame.samples;
  print_text(stdout, "{} x {} samples: {}\n", samples.x, samples.y, sources);
  if (report.truth) print_errors(report.truth->errors);
  if (report.colour_m > 0)
    print_text(stdout, "the picture's most saturated colour is {:.3g} m\n", report.colour_m);
  for (const std::string& note : report.notes) print_text(stdout, "note: {}\n", note);
}

}  // namespace

void check_output(const DemOutput& output, std::span<const fs::path> inputs) {
  check_ending(output.dem, {".tif", ".tiff"});
  std::vector<fs::path> results{output.dem};
  if (output.picture) {
    check_ending(*output.picture, {".png"});
    results.push_back(*output.picture);
  }
  if (output.error_map) {
    check_ending(*output.error_map, {".tif", ".tiff"});
    results.push_back(*output.error_map);
  }
  if (output.report) results.push_back(*output.report);
  check_results(results, inputs);
}

void write_output(const DemOutput& output, DemReport& report) {
  const DemLayers& layers = report.result.layers;
  ResultFiles files;
  if (output.picture) {
    PictureScale scale;
    const std::vector<float> errors_m = report.truth ? report.truth->error_m : std::vector<float>{};
    files.write(*output.picture,
                [&](const fs::path& path) { write_png(path, draw_dem(layers, errors_m, scale)); });
    report.colour_m = scale.most_m;
  }
  if (output.error_map && report.truth) {
    const std::vector<RasterLayer> bands{{"error", "m", report.truth->error_m},
                                         {"normalised_error", "", report.truth->normalised}};
    files.write(*output.error_map, [&](const fs::path& path) {
      write_layers(path, layers.frame, report.georeference, bands);
    });
  }
  if (output.report)
    files.write(*output.report,
                [&](const fs::path& path) { write_json(path, output.facts, report); });
  files.write(output.dem,
              [&](const fs::path& path) { write_layers(path, layers, report.georeference); });
  print(report);
  files.appear();
}

}  // namespace groundray
