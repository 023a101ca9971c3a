
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/dem/filling.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray {
namespace {

// Lower limit: a sag of about 0.001 mm over 1 m. No ground is that flat, and smoothing takes long.
constexpr double least_curvature_per_m = 1e-5, most_curvature_per_m = 1e3;

enum class FilterPreset { None, Ground, Air };

// Options of the command.
struct DemCommandOptions {
  CLI::App* command = nullptr;
  ScanOptions scans;
  DemRequest request;
  std::vector<double> area;
  FilterPreset filter = FilterPreset::None;
  std::optional<double> filter_cell_m, filter_slope, filter_radius_m, filter_threshold_m;
  SmoothOptions smooth;
  std::string stereo_frames = ":";
  std::optional<std::size_t> most_bytes;
  bool without_lidar = false, without_stereo = false, without_filling = false;
  bool is_airborne = false, is_smoothed = false;
  FillLimits limits;

  void add_files() {
    command
        ->add_option(
            "INPUT", scans.choice.inputs,
            "A dataset folder; or scans (.ply .pcd .npy .npz .bin, .las .laz .mcap); or a .conf of "
            "Stanford's range scans")
        ->required();
    DemOutput& output = request.output;
    command->add_option("-o,--output", output.dem, "GeoTIFF to write, a band for each layer")
        ->required();
    command->add_option(
        "--picture", output.picture,
        "PNG of measured heights, filled heights, and errors or standard deviations");
    auto* truth = command->add_option("--truth", request.truth, "A DEM to compare with");
    command->add_option("--error-map", output.error_map, "GeoTIFF of the errors")->needs(truth);
    command->add_option("--report", output.report, "JSON file of all results");
    add_memory(command, most_bytes, "Limit of memory (what the machine has)");
  }

  void add_place() {
    CLI::App* place = command->add_option_group("Place");
    auto* cell = place->add_option("--cell-m", request.cell_m, "Side of the DEM's cells");
    cell->check(positive());
    place->add_option("--like", request.like, "Use the samples of this DEM")->excludes(cell);
    place->add_option("--area", area, "W S E N in the CRS, metres: limits of the DEM")->expected(4);
  }

  void add_noise() {
    CLI::App* group = command->add_option_group("Noise");
    constexpr double per_mille = 1e-3;
    PointNoise& noise = request.noise.points;
    add_scaled(group, "--divergence-mrad", noise.divergence_rad, per_mille,
               "Beam divergence, full angle between the 1/e^2 points, instead of the dataset's")
        ->check(not_negative());
    add_number(group, "--position-sd-m", noise.position_sd_m, not_negative(),
               "Standard deviation of each pose along each axis");
    add_scaled(group, "--attitude-sd-mrad", noise.attitude_sd_rad, per_mille,
               "Standard deviation of each pose about each axis")
        ->check(not_negative());
    add_number(group, "--across-sd-m", noise.across_sd_m, not_negative(),
               "Additional horizontal standard deviation of points, along each axis");
    add_number(group, "--pose-gap-s", request.noise.longest_pose_gap_s, positive(),
               "Longest gap between poses during a scan (1)");
    group->add_flag("--airborne", is_airborne,
                    "Points were measured from far above and are in map coordinates");
    add_number(group, "--most-sd-m", request.dem.fusion.most_sd_m, positive(),
               "Mark samples of larger standard deviation as unmeasured");
    add_number(group, "--outlier-share", request.dem.fusion.outlier_share, CLI::Range(0.0, 0.5),
               "Share of outliers among all points (0.02)");
  }

  void add_stereo() {
    CLI::App* stereo = command->add_option_group("Stereo");
    stereo->add_option("--stereo", request.pairs.names,
                       "Pairs of a dataset by name, or cameras LEFT,RIGHT (all pairs)");
    stereo->add_flag("--no-stereo", without_stereo, "Use only lidars");
    stereo->add_flag("--no-lidar", without_lidar, "Use only the stereo pairs of a dataset");
    stereo->add_option("--stereo-frames", stereo_frames, "A:B:STEP of images, as --frames");
    StereoPointOptions& points = request.stereo.points;
    add_number(stereo, "--nearest-m", points.nearest_m, not_negative(),
               "Smallest depth of matches");
    add_number(stereo, "--farthest-depth-m", points.farthest_m, positive(),
               "Largest depth of matches");
    add_number(stereo, "--match-sd-px", points.noise.match_px, positive(),
               "Standard deviation of each disparity, instead of the matcher's");
    add_number(stereo, "--bias-sd-px", points.noise.bias_px, not_negative(),
               "Standard deviation of the bias that all disparities of a pair share (0.1)");
  }

  void add_filter() {
    CLI::App* group = command->add_option_group("Ground");
    const Words<FilterPreset> presets{
        {"none", FilterPreset::None}, {"ground", FilterPreset::Ground}, {"air", FilterPreset::Air}};
    add_words(group, "--ground-filter", filter,
              "Remove objects above the ground, for scans from the ground or from the air; none "
              "(default): the lowest surface of each cell is the ground",
              presets);
    add_number(group, "--filter-cell-m", filter_cell_m, positive(),
               "Cell size of the filter's raster");
    add_number(group, "--filter-slope", filter_slope, positive(), "Largest slope of ground");
    add_number(group, "--filter-radius-m", filter_radius_m, not_negative(),
               "Half the width of the largest object");
    add_number(group, "--filter-threshold-m", filter_threshold_m, positive(),
               "Largest distance of points from the ground");
  }

  void add_filling() {
    CLI::App* group = command->add_option_group("Blank areas");
    group->add_flag("--no-fill", without_filling, "Do not fill blank areas");
    const Words<FillMethod> methods{{"tension", FillMethod::Tension}, {"cgal", FillMethod::Mesh}};
    add_words(group, "--method", request.dem.fill_method,
              "tension: the smoothest surface (default); cgal: faired meshes", methods);
    limits.add(group);
  }

  void add_sight() {
    CLI::App* group = command->add_option_group("Sight and smoothness");
    const Words<SightUse> uses{{"none", SightUse::None}, {"beams", SightUse::Beams}};
    add_words(group, "--sight", request.sight,
              "Upper bounds of the ground: beams that passed above it (default)", uses);
    add_number(group, "--sight-margin-m", request.dem.sight_margin_m, not_negative(),
               "Margin added to upper bounds (a quarter of a cell)");
    auto* flag = group->add_flag("--smooth", is_smoothed, "Smooth measured heights first");
    add_number(group, "--curvature-sd-per-m", smooth.curvature_sd_per_m, positive(),
               "Standard deviation of the true ground's curvature, for --smooth")
        ->check(CLI::Range(least_curvature_per_m, most_curvature_per_m))
        ->needs(flag);
  }

  // Rejects options that would have no effect.
  void refuse(std::initializer_list<const char*> options, const char* why) const {
    for (const char* option : options) {
      if (option_of(*command, option)->count() > 0)
        throw Error("{}: {}: omit one of them", option, why);
    }
  }

  void check_use() const {
    if (without_stereo)
      refuse({"--stereo", "--stereo-frames", "--nearest-m", "--farthest-depth-m", "--match-sd-px",
              "--bias-sd-px"},
             "--no-stereo excludes stereo pairs");
    if (is_airborne)
      refuse({"--divergence-mrad", "--attitude-sd-mrad", "--sight", "--sight-margin-m"},
             "with --airborne the beams are unknown");
    if (without_filling)
      refuse({"--method", "--reach", "--farthest-m", "--largest-share", "--most-edges"},
             "--no-fill fills nothing");
    if (request.dem.fill_method == FillMethod::Mesh)
      refuse({"--sight", "--sight-margin-m"}, "--method cgal does not support bounds");
    else
      refuse({"--most-edges"}, "only --method cgal limits the edges of boundaries");
    if (without_stereo && without_lidar)
      throw Error("--no-lidar and --no-stereo exclude all measurements: omit one of them");
  }

  std::optional<GroundFilterOptions> ground_filter() const {
    if (filter == FilterPreset::None) {
      if (filter_cell_m || filter_slope || filter_radius_m || filter_threshold_m)
        throw Error("--filter-...: no filter is selected: add --ground-filter ground or air");
      return std::nullopt;
    }
    GroundFilterOptions options = filter == FilterPreset::Ground
                                      ? GroundFilterOptions::ground_scan()
                                      : GroundFilterOptions::airborne();
    options.cell_m = filter_cell_m.value_or(options.cell_m);
    options.slope = filter_slope.value_or(options.slope);
    options.window_radius_m = filter_radius_m.value_or(options.window_radius_m);
    options.threshold_m = filter_threshold_m.value_or(options.threshold_m);
    return options;
  }

  void close_area() {
    if (area.empty()) return;
    const bool is_bounded = std::ranges::all_of(area, [](double x) { return std::isfinite(x); });
    if (!is_bounded || !(area[0] < area[2] && area[1] < area[3])) {
      throw Error(
          "--area: {} {} {} {} must be W S E N in the CRS, metres, with W < E and S < N: are they "
          "in another order?",
          area[0], area[1], area[2], area[3]);
    }
    request.area_w = Area{{area[0], area[1]}, {area[2], area[3]}};
  }

  void close_memory() {
    request.most_bytes = request.taking.most_bytes = most_bytes.value_or(machine_bytes());
    if (!most_bytes) return;
    request.dem.fusion.memory_bytes = *most_bytes / 2;
    request.stereo.matching.most_bytes = *most_bytes;
  }

  void close() {
    check_use();
    scans.close();
    request.choice = scans.choice;
    request.taking = scans.taking;
    request.pairs.frames = parse_frames(stereo_frames, "--stereo-frames");
    request.pairs.are_any = !without_stereo;
    if (!without_stereo) request.choice.need = without_lidar ? ScanNeed::None : ScanNeed::IfThere;
    if (is_airborne) request.noise.points.beams = BeamOrigin::Above;
    close_area();
    request.dem.filter = ground_filter();
    request.dem.fill = limits.filling;
    if (without_filling) request.dem.fill = std::nullopt;
    request.dem.most_rim_edges = limits.edges();
    if (is_smoothed) request.dem.smooth = smooth;
    close_memory();
    const auto folder = request.output.dem.parent_path();
    request.dem.fusion.folder = folder.empty() ? "." : folder;
    request.output.facts = facts_of("reconstruct dem", scans.choice.inputs);
  }
};

}  // namespace

Command add_dem_command(CLI::App& reconstruct) {
  const auto options = std::make_shared<DemCommandOptions>();
  options->command = reconstruct.add_subcommand(
      "dem", "Fuse scans and stereo pairs into a DEM with standard deviations");
  options->add_files();
  options->add_place();
  options->scans.add(options->command);
  options->add_noise();
  options->add_stereo();
  options->add_filter();
  options->add_filling();
  options->add_sight();
  return {options->command, [options] {
            options->close();
            rebuild_dem(options->request);
          }};
}

}  // namespace groundray
