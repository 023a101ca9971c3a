#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <optional>
#include <string>
#include <utility>

#include "apps/dataset/recorded_stereo.h"
#include "apps/groundray/dem/dem_input.h"
#include "apps/groundray/dem/dem_output.h"
#include "apps/groundray/dem/dem_place.h"
#include "apps/groundray/dem/dem_report.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/progress_stage.h"
#include "core/error.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/ground/ground_filter.h"
#include "terrain/dem/dem_io.h"
#include "terrain/dem/layers_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// ----- points

void add(MeasuredPoints& all, const MeasuredPoints& more) {
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(all.p_m, more.p_m);
  append(all.sd_m, more.sd_m);
  append(all.bias_sd_m, more.bias_sd_m);
  append(all.lean, more.lean);
  append(all.across_sd_m, more.across_sd_m);
  append(all.groups, more.groups);
  append(all.origins, more.origins);
}

// Keeps the points whose index satisfies `is_kept`.
template <typename IsKept>
void keep(MeasuredPoints& points, const IsKept& is_kept) {
  const auto keep_column = [&](auto& column) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (is_kept(i)) column[kept++] = column[i];
    }
    column.resize(kept);
  };
  keep_column(points.sd_m);
  keep_column(points.bias_sd_m);
  keep_column(points.lean);
  keep_column(points.across_sd_m);
  keep_column(points.groups);
  keep_column(points.origins);
  std::vector<glm::dvec3> kept_m;
  for (std::size_t i = 0; i < points.p_m.size(); ++i)
    if (is_kept(i)) kept_m.push_back(points.p_m[i]);
  points.p_m = std::move(kept_m);
}

// Keeps the points over the frame's cells and a margin, whose points affect the ground filter.
void keep_around(const GridFrame& frame, double margin_m, MeasuredPoints& points) {
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const glm::dvec2 border = glm::dvec2(margin_m) + glm::abs(frame.step_m);
  const Area area{glm::min(a, b) - border, glm::max(a, b) + border};
  const std::vector<glm::dvec3> all_m = points.p_m;
  keep(points, [&](std::size_t i) {
    return std::isfinite(all_m[i].z) && area.contains(glm::dvec2(all_m[i]));
  });
}

// Limits the number of points, because a ground filter needs all of them at once.
void check_memory(std::size_t points, std::size_t most_bytes) {
  constexpr std::size_t point_bytes = 100;
  if (points <= most_bytes / point_bytes) return;
  throw Error(
      "--ground-filter: {} points or more need over {} MB: use fewer (--frames, --area), omit the "
      "filter, or raise --memory-mb",
      points, most_bytes / 1'000'000);
}

// ----- ground

Fusion fuse_ground(const DemRequest& request, DemInput& input, const GridFrame& frame,
                   const GroundFilterOptions& filter, DemReport& report) {
  MeasuredPoints all;
  for (MeasuredPoints block; input.next(block);) {
    add(all, block);
    check_memory(all.size(), request.most_bytes);
  }
  check_count(all.size());
  keep_around(frame, 2 * filter.window_radius_m, all);
  if (all.size() == 0)
    throw Error("no point is within the DEM's extent: is it at another location? (--area, --like)");
  GroundPoints ground;
  {
    const StageTimer timer(report.seconds, "ground");
    Stage stage("finding the ground");
    ground = filter_ground(all.p_m, filter, stage.work(request.most_bytes));
    stage.update(1);
  }
  report.ground = ground.counts;
  Overhangs overhangs = find_overhangs(all.p_m, ground, frame, request.fusion.surface_gap_m);
  keep(all, [&](std::size_t i) { return ground.classes[i] == GroundClass::Ground; });
  const StageTimer timer(report.seconds, "fuse");
  Stage stage("fusing");
  bool is_first = true;
  Fusion fusion = fuse(
      [&](MeasuredPoints& block) {
        if (!std::exchange(is_first, false)) return false;
        block = std::move(all);
        return true;
      },
      frame, request.fusion, stage.work(request.most_bytes));
  stage.update(1);
  fusion.layers.surfaces = std::move(overhangs.surfaces);
  fusion.layers.overhang_m = std::move(overhangs.overhang_m);
  fusion.layers.clearance_m = std::move(overhangs.clearance_m);
  return fusion;
}

Fusion fuse_all(const DemRequest& request, DemInput& input, const GridFrame& frame,
                DemReport& report) {
  const StageTimer timer(report.seconds, "fuse");
  Stage stage("fusing");
  Fusion fusion = fuse([&](MeasuredPoints& block) { return input.next(block); }, frame,
                       request.fusion, stage.work(request.most_bytes));
  stage.update(1);
  check_count(fusion.counts.points);
  return fusion;
}

void check_ground(const Fusion& fusion) {
  const bool has_ground = std::ranges::any_of(fusion.layers.elevation_m,
                                              [](float height_m) { return !std::isnan(height_m); });
  if (has_ground) return;
  const FusionCounts& counts = fusion.counts;
  if (counts.outside == counts.points)
    throw Error(
        "all {} points are outside the DEM's extent: is it at another location? (--area, --like)",
        counts.points);
  if (counts.uncertain > 0) {
    throw Error("all {} cells with ground have a standard deviation above --most-sd-m: raise it",
                counts.uncertain);
  }
  throw Error(
      "none of the {} points is usable as ground: {} are outside the extent, {} invalid, and in {} "
      "cells they are too few or inconsistent: are the poses right? Larger cells (--cell-m) "
      "contain more points, --outlier-share sets the share of outliers",
      counts.points, counts.outside, counts.unusable, counts.without_ground);
}

// Adds a note if most cells with points are too sparse to be measured.
void note_sparse_cells(const Fusion& fusion, DemReport& report) {
  const auto measured = std::ranges::count_if(
      fusion.layers.source, [](HeightSource source) { return source != HeightSource::None; });
  if (fusion.counts.without_ground <= static_cast<std::size_t>(measured)) return;
  report.notes.push_back(
      fmt::format("{} of {} cells with points have too few to distinguish ground from outliers: "
                  "larger cells (--cell-m) contain more, --outlier-share sets the share of "
                  "outliers (0 if a filter removed them)",
                  fusion.counts.without_ground,
                  fusion.counts.without_ground + static_cast<std::size_t>(measured)));
}

// ----- after fusion

void bound(const DemRequest& request, DemInput& input, DemLayers& layers, DemReport& report) {
  if (request.sight == SightUse::None || request.noise.beams == BeamOrigin::Above) return;
  const std::size_t scans = input.scans().size();
  if (scans == 0) return;
  const StageTimer timer(report.seconds, "sight");
  Stage stage("tracing lines of sight");
  constexpr double share_of_cell = 0.25;  // half a cell on a slope of 1/2
  const glm::dvec2 cell_m = glm::abs(layers.frame.step_m);
  const double margin_m =
      request.sight_margin_m.value_or(share_of_cell * std::max(cell_m.x, cell_m.y));
  for (std::size_t i = 0; i < scans; ++i) {
    stop_if_interrupted();
    LidarPoints points = input.points_of(i);
    bound_by_sight(points, margin_m, layers);
    stage.update(static_cast<double>(i + 1) / static_cast<double>(scans));
  }
  constexpr float sds = 3;
  BoundTally tally;
  for (std::size_t i = 0; i < layers.upper_bound_m.size(); ++i) {
    if (std::isnan(layers.upper_bound_m[i])) continue;
    ++tally.samples;
    if (layers.elevation_m[i] - sds * std::sqrt(layers.variance_m2[i]) > layers.upper_bound_m[i])
      ++tally.broken;
  }
  report.bound = tally;
}

void smooth(const DemRequest& request, DemLayers& layers, DemReport& report) {
  if (!request.smooth) return;
  const StageTimer timer(report.seconds, "smooth");
  Stage stage("smoothing");
  SmoothHeights smoothed = smooth_dem(layers.frame, layers.elevation_m, layers.variance_m2,
                                      *request.smooth, stage.work(request.most_bytes));
  stage.update(1);
  for (std::size_t i = 0; i < layers.elevation_m.size(); ++i) {
    if (!std::isnan(smoothed.heights_m[i])) layers.elevation_m[i] = smoothed.heights_m[i];
  }
  report.smoothed = SmoothTally{smoothed.curvature_sd_per_m, smoothed.rounds};
}

void fill(const DemRequest& request, DemLayers& layers, DemReport& report) {
  if (!request.fill) return;
  const StageTimer timer(report.seconds, "fill");
  Stage stage("filling");
  FilledHeights filled =
      request.fill_method == FillMethod::Mesh
          ? fill_dem_by_mesh(layers.frame, layers.elevation_m, *request.fill,
                             request.most_rim_edges, stage.work(request.most_bytes))
          : fill_dem(layers.frame, layers.elevation_m, layers.upper_bound_m, *request.fill,
                     stage.work(request.most_bytes));
  stage.update(1);
  report.filled = tally_of(filled);
  for (std::size_t i = 0; i < layers.elevation_m.size(); ++i) {
    if (!std::isnan(layers.elevation_m[i]) || std::isnan(filled.heights_m[i])) continue;
    layers.elevation_m[i] = filled.heights_m[i];
    layers.source[i] = HeightSource::Filled;
    if (!filled.sd_m.empty()) layers.fill_sd_m[i] = filled.sd_m[i];
  }
  add_boundary_variance(layers);
}

// ----- the whole command

std::optional<NamedDem> load(const std::optional<fs::path>& path) {
  if (!path) return std::nullopt;
  return NamedDem{*path, load_dem(*path)};
}

void check_outputs(const DemRequest& request, const ScanFiles& files,
                   const std::vector<RecordedPair>& pairs) {
  std::vector<fs::path> inputs = files.read;
  if (request.like) inputs.push_back(*request.like);
  if (request.truth) inputs.push_back(*request.truth);
  for (const RecordedPair& pair : pairs) {
    for (const RecordedCamera& camera : pair.cameras) {
      for (const RecordedFrame& frame : camera.frames) inputs.push_back(frame.file);
    }
  }
  check_output(request.output, inputs);
}

DemLayers measure(const DemRequest& request, const Georeference& georeference,
                  const PlaceChoice& place, DemInput& input, DemReport& report) {
  const Area extent = needs_extent(place) ? input.extent() : Area{};
  const GridFrame frame = choose_frame(place, georeference, extent);
  Fusion fusion = request.filter ? fuse_ground(request, input, frame, *request.filter, report)
                                 : fuse_all(request, input, frame, report);
  check_ground(fusion);
  note_sparse_cells(fusion, report);
  report.fusion = fusion.counts;
  report.frame = frame;
  report.scans = input.scans();
  report.pairs = input.pairs();
  for (std::string& note : input.notes()) report.notes.push_back(std::move(note));
  return std::move(fusion.layers);
}

std::vector<std::string> notes_of(const DemRequest& request, const ScanFiles& files) {
  std::vector<std::string> notes = files.notes;
  if (!files.are_posed && request.noise.beams == BeamOrigin::Sensor)
    notes.emplace_back("without poses the DEM is in the sensor's frame");
  return notes;
}

DemInput read_input(const DemRequest& request, const ScanFiles& files,
                    const std::vector<RecordedPair>& pairs, DemReport& report) {
  const StageTimer timer(report.seconds, "match");
  return {request, files, pairs};
}

}  // namespace

void rebuild_dem(const DemRequest& request) {
  ScanFiles files = find_scans(request.choice);
  level_origin(files);
  const std::vector<RecordedPair> pairs = find_pairs(request, files);
  check_outputs(request, files, pairs);
  const PlaceChoice place{.cell_m = request.cell_m,
                          .like = load(request.like),
                          .truth = load(request.truth),
                          .area_w = request.area_w};
  agree_on_crs(place, files.georeference);
  check_crs(files.georeference);
  DemReport report{.facts = request.output.facts, .georeference = files.georeference};
  report.notes = notes_of(request, files);
  DemInput input = read_input(request, files, pairs, report);
  DemLayers layers = measure(request, files.georeference, place, input, report);
  bound(request, input, layers, report);
  smooth(request, layers, report);
  fill(request, layers, report);
  set_slopes(layers);
  for (const HeightSource source : layers.source)
    ++report.sources[static_cast<std::size_t>(source)];
  std::optional<TruthComparison> comparison;
  if (place.truth) {
    comparison = compare_with_truth(layers, files.georeference, place.truth->dem);
    report.errors = comparison->errors;
  }
  stop_if_interrupted();
  write_output(request.output, layers, comparison ? &*comparison : nullptr, report);
  print(report);
  fmt::print("written to {}\n", request.output.dem.string());
}

}  // namespace groundray
