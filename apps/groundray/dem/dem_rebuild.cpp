#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/dataset/recorded_stereo.h"
#include "apps/groundray/dem/dem_input.h"
#include "apps/groundray/dem/dem_place.h"
#include "apps/groundray/dem/dem_report.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/progress_stage.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/print_error.h"
#include "terrain/dem/dem_io.h"
#include "terrain/dem/layers_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// ----- inputs

// Moves D's origin to height 0, so that heights in D equal those in W.
void level_origin(ScanFiles& files) {
  const double height_m = std::exchange(files.georeference.origin_w_m.z, 0);
  if (height_m == 0) return;
  for (ScanFile& scan : files.scans) scan.X_DS.translation_m.z += height_m;
  for (Trajectory& path : files.paths) {
    auto samples = path.samples();
    for (Trajectory::Sample& sample : samples) sample.pose.translation_m.z += height_m;
    path = Trajectory(std::move(samples));
  }
}

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

std::vector<std::string> notes_of(const DemRequest& request, const ScanFiles& files) {
  std::vector<std::string> notes = files.notes;
  if (!files.are_posed && request.noise.points.beams == BeamOrigin::Sensor)
    notes.emplace_back("without poses the DEM is in the sensor's frame");
  return notes;
}

// ----- the DEM

// Limits the number of points, because a ground filter needs all of them at once.
void check_memory(std::size_t points, std::size_t most_bytes) {
  constexpr std::size_t point_bytes = 100;
  if (points <= most_bytes / point_bytes) return;
  throw Error(
      "--ground-filter: {} points or more need over {} MB: use fewer (--frames, --area), omit the "
      "filter, or raise --memory-mb",
      points, most_bytes / 1'000'000);
}

void check_ground(const DemResult& result, const std::optional<GroundFilterOptions>& filter) {
  if (result.has_ground) return;
  const FusionCounts& counts = result.fusion;
  if (filter && !result.ground)
    throw Error("no point is within the DEM's extent: is it at another location? (--area, --like)");
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
void note_sparse_cells(DemReport& report) {
  const DemResult& result = report.result;
  const auto measured =
      static_cast<std::size_t>(std::ranges::count_if(result.layers.source, [](HeightSource source) {
        return source != HeightSource::None && source != HeightSource::Filled;
      }));
  const std::size_t sparse = result.fusion.without_ground;
  if (sparse <= measured) return;
  report.notes.push_back(
      fmt::format("{} of {} cells with points have too few to distinguish ground from outliers: "
                  "larger cells (--cell-m) contain more, --outlier-share sets the share of "
                  "outliers (0 if a filter removed them)",
                  sparse, sparse + measured));
}

DemResult build(const DemRequest& request, const GridFrame& frame, DemInput& input,
                const PipelineControl& control) {
  std::size_t count = 0;
  DemSources sources{.points = [&](MeasuredPoints& points) {
    LidarBlock block;
    if (!input.next(block)) {
      input.check_count(count);
      return false;
    }
    points = std::move(block.points);
    count += points.size();
    if (request.dem.filter) check_memory(count, request.most_bytes);
    return true;
  }};
  const bool has_beams = request.noise.points.beams == BeamOrigin::Sensor && !input.scans().empty();
  if (request.sight == SightUse::Beams && has_beams) {
    sources.beams = [&, is_first = true](LidarBlock& block) mutable {
      if (std::exchange(is_first, false)) input.rewind_to_scans();
      return input.next(block);
    };
  }
  DemResult result = build_dem(sources, frame, request.dem, control);
  check_ground(result, request.dem.filter);
  return result;
}

DemInput read_input(const DemRequest& request, const ScanFiles& files,
                    const std::vector<RecordedPair>& pairs, StageProgress& progress,
                    DemReport& report) {
  const StageTimer timer(report.seconds, "match");
  return {request, files, pairs, progress};
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
  DemReport report{.georeference = files.georeference, .notes = notes_of(request, files)};
  StageProgress progress;
  DemInput input = read_input(request, files, pairs, progress, report);
  const Area extent = needs_extent(place) ? input.extent() : Area{};
  const GridFrame frame = choose_frame(place, files.georeference, extent);
  report.result = build(request, frame, input, progress.control(request.most_bytes));
  const StageSeconds& seconds = report.result.seconds;
  report.seconds.insert(report.seconds.end(), seconds.begin(), seconds.end());
  note_sparse_cells(report);
  report.scans = input.scans();
  report.pairs = input.pairs();
  for (std::string& note : input.notes()) report.notes.push_back(std::move(note));
  if (place.truth)
    report.truth = compare_with_truth(report.result.layers, files.georeference, place.truth->dem);
  stop_if_interrupted();
  write_output(request.output, report);
}

}  // namespace groundray
