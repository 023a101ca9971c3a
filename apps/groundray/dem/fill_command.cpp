#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/dem/filling.h"
#include "apps/groundray/progress_stage.h"
#include "apps/groundray/result_files.h"
#include "apps/scan/word_option.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "core/math.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "terrain/dem/dem_io.h"
#include "terrain/dem/layers_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Loads heights from another raster, which must have the same samples.
std::vector<float> load_bounds(const fs::path& path, const Dem& dem) {
  const Dem bounds = load_dem(path);
  const GridFrame &a = dem.grid.frame(), &b = bounds.grid.frame();
  const glm::dvec2 apart = (b.to_D({0, 0}) + glm::dvec2(bounds.origin_w_m)) -
                           (a.to_D({0, 0}) + glm::dvec2(dem.origin_w_m));
  constexpr double tolerance = 1e-6;  // fraction of a cell
  const auto differs = [&](double by_m, double step_m) {
    return !(std::abs(by_m) <= tolerance * std::abs(step_m));
  };
  if (a.samples != b.samples || differs(apart.x, a.step_m.x) || differs(apart.y, a.step_m.y) ||
      differs(b.step_m.x - a.step_m.x, a.step_m.x) || differs(b.step_m.y - a.step_m.y, a.step_m.y))
    throw Error(
        "{}: its samples do not match the DEM's: {} x {} instead of {} x {}, or at other "
        "positions; warp it with gdalwarp -te ... -ts {} {}",
        path.string(), b.samples.x, b.samples.y, a.samples.x, a.samples.y, a.samples.x,
        a.samples.y);
  const auto heights_m = bounds.grid.heights_m();
  return {heights_m.begin(), heights_m.end()};
}

// Formats a fraction in percent; a dash for NaN.
std::string percent(double share) {
  return std::isnan(share) ? "-" : fmt::format("{:.1f} %", 100 * share);
}

void print_trials(const FilledHeights& filled) {
  if (filled.trials.empty()) return;
  print_text(stdout, "{:>28} {:>8} {:>11} {:>8} {:>9} {:>9} {:>9}\n", "kind of hole, cells",
             "tension", "smoothness", "tried", "in 1 sd", "in 2 sd", "widened");
  for (const TrialReport& trial : filled.trials) {
    const std::string kind =
        fmt::format("{}{}, {:.0f} to {:.0f}", trial.is_shadow ? "shadow, " : "",
                    trial.is_long ? "long" : "compact", trial.from_cells, trial.to_cells);
    if (trial.samples == 0) {
      print_text(stdout, "{:>28} {:>8g} {:>11g}  no ground for a trial\n", kind, trial.form.tension,
                 trial.form.smoothness);
      continue;
    }
    print_text(stdout, "{:>28} {:>8g} {:>11g} {:>8} {:>9} {:>9} {:>9.2f}\n", kind,
               trial.form.tension, trial.form.smoothness, trial.samples, percent(trial.within_1sd),
               percent(trial.within_2sd), trial.widened_by);
  }
}

enum class RasterFill { Tension, Cgal, Gdal, Telea, NavierStokes };

// Options of the command.
struct FillCommandOptions {
  CLI::App* command = nullptr;
  fs::path dem, out, sd_out, bound;
  DemOptions reading;
  RasterFill method = RasterFill::Tension;
  FillLimits limits;
  std::optional<double> tension, smoothness;

  void add_files() {
    command->add_option("DEM", dem, "Raster of heights (GeoTIFF, VRT, HGT, ...)")->required();
    command->add_option("-o,--output", out, "GeoTIFF to write: heights in metres, CRS as the DEM's")
        ->required();
    command->add_option("--sd-out", sd_out,
                        "GeoTIFF for the standard deviation of filled heights (tension only)");
    command->add_option("--bound", bound,
                        "Raster of the same samples: upper bounds of filled heights");
    command->add_option("--nodata", reading.nodata,
                        "Additional nodata value, besides the one that the file declares");
    command->add_option("--reproject-to", reading.reproject_to,
                        "A CRS to warp to, such as EPSG:32631, or utm for the zone that fits");
  }

  void add_choices() {
    const Words<RasterFill> methods{{"tension", RasterFill::Tension},
                                    {"cgal", RasterFill::Cgal},
                                    {"gdal", RasterFill::Gdal},
                                    {"telea", RasterFill::Telea},
                                    {"ns", RasterFill::NavierStokes}};
    add_words(command, "--method", method,
              "tension: smoothest surface (default); cgal: triangulated, refined and faired "
              "meshes; for comparison: gdal, as gdal_fillnodata; telea and ns, OpenCV's inpainting",
              methods);
    limits.add(command);
    command->add_option("--tension", tension, "0 to below 1, instead of the best of trials");
    command->add_option("--smoothness", smoothness, "0 or more, likewise");
  }

  FilledHeights fill(const Dem& read) const {
    const GridFrame& frame = read.grid.frame();
    const auto heights_m = read.grid.heights_m();
    FillOptions filling = limits.filling;
    if (tension || smoothness)
      filling.form = ThinPlateEnergy{tension.value_or(0), smoothness.value_or(0)};
    StageProgress progress("per mille", 1000);
    const RunControl work{.progress = [&](double share) { progress.update("filling", share); }};
    if (method == RasterFill::Cgal)
      return fill_dem_by_mesh(frame, heights_m, filling, limits.edges(), work);
    if (method == RasterFill::Gdal) {
      const double farthest_cells = math::hypot(frame.samples.x, frame.samples.y);
      return take_filling(frame, heights_m, fill_by_gdal(frame.samples, heights_m, farthest_cells),
                          filling);
    }
    if (method != RasterFill::Tension) {
      const Inpainting by =
          method == RasterFill::Telea ? Inpainting::Telea : Inpainting::NavierStokes;
      return take_filling(frame, heights_m, fill_by_inpainting(frame.samples, heights_m, by),
                          filling);
    }
    std::vector<float> most_m;
    if (!bound.empty()) most_m = load_bounds(bound, read);
    return fill_dem(frame, heights_m, most_m, filling, work);
  }

  void refuse_mixtures() const {
    if (limits.most_edges && method != RasterFill::Cgal)
      throw Error("--most-edges applies only to --method cgal; omit it, or select that method");
    if (method == RasterFill::Tension) return;
    if (!sd_out.empty() || !bound.empty() || tension || smoothness)
      throw Error(
          "--sd-out, --bound, --tension and --smoothness apply only to --method tension; omit "
          "them, or the method");
  }

  void check_files() const {
    std::vector<fs::path> results{out}, inputs{dem};
    if (!sd_out.empty()) results.push_back(sd_out);
    if (!bound.empty()) inputs.push_back(bound);
    for (const fs::path& result : results) check_ending(result, {".tif", ".tiff"});
    check_results(results, inputs);
  }

  void write(const Dem& read, const FilledHeights& filled) const {
    const RasterForm form = read_form(dem);
    const Georeference place{.origin_w_m = read.origin_w_m, .crs_wkt = read.crs_wkt};
    const RasterLayer heights{"elevation", "m", filled.heights_m}, sds{"fill_sd", "m", filled.sd_m};
    ResultFiles files;
    if (!sd_out.empty()) {
      files.write(sd_out, [&](const fs::path& path) {
        write_layers(path, read.grid.frame(), place, {&sds, 1}, {.is_point = form.is_point});
      });
    }
    files.write(out, [&](const fs::path& path) {
      write_layers(path, read.grid.frame(), place, {&heights, 1}, form);
    });
    print_result(read, filled);
    files.appear();
  }

  void run() {
    refuse_mixtures();
    check_files();
    const Dem read = load_dem(dem, reading);
    const FilledHeights filled = fill(read);
    stop_if_interrupted();
    write(read, filled);
  }

  void print_result(const Dem& read, const FilledHeights& filled) const {
    const FillTally tally = tally_of(filled);
    print_fates(tally);
    if (method == RasterFill::Tension) print_trials(filled);
    if (!bound.empty()) {
      print_text(stdout, "{} filled samples are limited by a bound\n", tally.at_bound);
      print_not_least(tally);
    }
    print_text(stdout, "{} of {} missing samples filled\n", filled.filled, read.grid.hole_count());
  }
};

}  // namespace

Command add_fill_command(CLI::App& terrain) {
  const auto options = std::make_shared<FillCommandOptions>();
  options->command = terrain.add_subcommand(
      "fill", "Fill blank areas of a DEM and estimate the errors of the filled heights");
  options->add_files();
  options->add_choices();
  return {options->command, [options] { options->run(); }};
}

}  // namespace groundray
