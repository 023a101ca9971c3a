#include "apps/groundray/dem/dem_command.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/dem/fill_options.h"
#include "apps/groundray/scan_options.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray {
namespace {

// Lower limit: a sag of about 0.001 mm over 1 m. No ground is that flat, and smoothing takes long.
constexpr double least_curvature_per_m = 1e-5, most_curvature_per_m = 1e3;

// Returns the machine's memory: the system may end a process that takes more, without a message.
std::size_t machine_bytes() {
  const auto pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page_bytes <= 0) return std::numeric_limits<std::size_t>::max();
  return static_cast<std::size_t>(pages) * static_cast<std::size_t>(page_bytes);
}

}  // namespace

struct DemCommand::Options {
  enum class FilterPreset { None, Ground, Air };

  CLI::App* command = nullptr;
  ScanOptions scans;
  DemRequest request;
  std::vector<double> area;
  FilterPreset filter = FilterPreset::None;
  std::optional<double> filter_cell_m, filter_slope, filter_radius_m, filter_threshold_m;
  std::optional<double> divergence_mrad, curvature_sd_per_m;
  double attitude_sd_mrad = 0;
  std::string stereo_frames = ":";
  std::optional<std::uint64_t> memory_mb;
  bool without_lidar = false, without_stereo = false, without_filling = false;
  bool is_airborne = false, is_smoothed = false;
  FillLimits limits;

  void add_files() {
    command
        ->add_option("INPUT", scans.choice.inputs,
                     "A dataset folder; or scans (.ply .pcd .npy .npz .bin); or a .conf of "
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
    command->add_option("--memory-mb", memory_mb, "Limit of memory (what the machine has)")
        ->check(positive());
  }

  void add_place() {
    CLI::App* place = command->add_option_group("Place");
    auto* cell = place->add_option("--cell-m", request.cell_m, "Side of the DEM's cells");
    cell->check(positive());
    place->add_option("--like", request.like, "Use the samples of this DEM")->excludes(cell);
    place->add_option("--area", area, "W S E N in the CRS, metres: limits of the DEM")->expected(4);
  }

  void add_noise() {
    CLI::App* noise = command->add_option_group("Noise");
    noise
        ->add_option(
            "--divergence-mrad", divergence_mrad,
            "Beam divergence, full angle between the 1/e^2 points, instead of the dataset's")
        ->check(not_negative());
    noise
        ->add_option("--position-sd-m", request.noise.position_sd_m,
                     "Standard deviation of each pose along each axis")
        ->check(not_negative());
    noise
        ->add_option("--attitude-sd-mrad", attitude_sd_mrad,
                     "Standard deviation of each pose about each axis")
        ->check(not_negative());
    noise
        ->add_option("--across-sd-m", request.noise.across_sd_m,
                     "Additional horizontal standard deviation of points, along each axis")
        ->check(not_negative());
    noise
        ->add_option("--pose-gap-s", request.noise.longest_pose_gap_s,
                     "Longest gap between poses during a scan (1)")
        ->check(positive());
    noise->add_flag("--airborne", is_airborne,
                    "Points were measured from far above and are in map coordinates");
    noise
        ->add_option("--most-sd-m", request.fusion.most_sd_m,
                     "Mark samples of larger standard deviation as unmeasured")
        ->check(positive());
    noise
        ->add_option("--outlier-share", request.fusion.outlier_share,
                     "Share of outliers among all points (0.02)")
        ->check(CLI::Range(0.0, 0.5));
  }

  void add_stereo() {
    CLI::App* stereo = command->add_option_group("Stereo");
    stereo->add_option("--stereo", request.pairs.names,
                       "Pairs of a dataset by name, or cameras LEFT,RIGHT (all pairs)");
    stereo->add_flag("--no-stereo", without_stereo, "Use only lidars");
    stereo->add_flag("--no-lidar", without_lidar, "Use only the stereo pairs of a dataset");
    stereo->add_option("--stereo-frames", stereo_frames, "A:B:STEP of images, as --frames");
    StereoPointOptions& points = request.stereo.points;
    stereo->add_option("--nearest-m", points.nearest_m, "Smallest depth of matches")
        ->check(not_negative());
    stereo->add_option("--farthest-depth-m", points.farthest_m, "Largest depth of matches")
        ->check(positive());
    stereo
        ->add_option("--match-sd-px", points.noise.match_px,
                     "Standard deviation of each disparity, instead of the matcher's")
        ->check(positive());
    stereo
        ->add_option("--bias-sd-px", points.noise.bias_px,
                     "Standard deviation of the bias that all disparities of a pair share (0.1)")
        ->check(not_negative());
  }

  void add_filter() {
    CLI::App* group = command->add_option_group("Ground");
    const Words<FilterPreset> presets{
        {"none", FilterPreset::None}, {"ground", FilterPreset::Ground}, {"air", FilterPreset::Air}};
    add_words(group, "--ground-filter", filter,
              "Remove objects above the ground, for scans from the ground or from the air; none "
              "(default): the lowest surface of each cell is the ground",
              presets);
    group->add_option("--filter-cell-m", filter_cell_m, "Cell size of the filter's raster")
        ->check(positive());
    group->add_option("--filter-slope", filter_slope, "Largest slope of ground")->check(positive());
    group->add_option("--filter-radius-m", filter_radius_m, "Half the width of the largest object")
        ->check(not_negative());
    group
        ->add_option("--filter-threshold-m", filter_threshold_m,
                     "Largest distance of points from the ground")
        ->check(positive());
  }

  void add_filling() {
    CLI::App* group = command->add_option_group("Blank areas");
    group->add_flag("--no-fill", without_filling, "Do not fill blank areas");
    const Words<FillMethod> methods{{"tension", FillMethod::Tension}, {"cgal", FillMethod::Mesh}};
    add_words(group, "--method", request.fill_method,
              "tension: the smoothest surface (default); cgal: faired meshes", methods);
    limits.add(group);
  }

  void add_sight() {
    CLI::App* group = command->add_option_group("Sight and smoothness");
    const Words<SightUse> uses{{"none", SightUse::None}, {"beams", SightUse::Beams}};
    add_words(group, "--sight", request.sight,
              "Upper bounds of the ground: beams that passed above it (default)", uses);
    group
        ->add_option("--sight-margin-m", request.sight_margin_m,
                     "Margin added to upper bounds (a quarter of a cell)")
        ->check(not_negative());
    auto* smooth = group->add_flag("--smooth", is_smoothed, "Smooth measured heights first");
    group
        ->add_option("--curvature-sd-per-m", curvature_sd_per_m,
                     "Standard deviation of the true ground's curvature, for --smooth")
        ->check(positive())
        ->check(CLI::Range(least_curvature_per_m, most_curvature_per_m))
        ->needs(smooth);
  }

  // Rejects options that would have no effect.
  void refuse(std::initializer_list<const char*> options, const char* why) const {
    for (const char* option : options) {
      if (command->get_option(option)->count() > 0)
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
    if (request.fill_method == FillMethod::Mesh)
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
    constexpr std::size_t bytes_per_mb = 1'000'000;
    request.most_bytes = request.taking.most_bytes = machine_bytes();
    if (!memory_mb) return;
    constexpr std::size_t most_mb = std::numeric_limits<std::size_t>::max() / bytes_per_mb;
    const std::size_t asked_mb = std::min<std::size_t>(*memory_mb, most_mb);
    request.most_bytes = request.taking.most_bytes = asked_mb * bytes_per_mb;
    request.fusion.memory_bytes = request.most_bytes / 2;
    request.stereo.matching.most_bytes = request.most_bytes;
  }

  void close() {
    constexpr double per_mille = 1e-3;
    check_use();
    scans.close();
    request.choice = scans.choice;
    request.taking = scans.taking;
    request.stereo.frames = parse_frames(stereo_frames, "--stereo-frames");
    request.pairs.are_any = !without_stereo;
    if (!without_stereo) request.choice.need = without_lidar ? ScanNeed::None : ScanNeed::IfThere;
    if (divergence_mrad) request.noise.divergence_rad = *divergence_mrad * per_mille;
    request.noise.attitude_sd_rad = attitude_sd_mrad * per_mille;
    if (is_airborne) request.noise.beams = BeamOrigin::Above;
    close_area();
    request.filter = ground_filter();
    if (without_filling)
      request.fill = std::nullopt;
    else
      request.fill = limits.filling;
    request.most_rim_edges = limits.edges();
    if (is_smoothed) request.smooth = SmoothOptions{.curvature_sd_per_m = curvature_sd_per_m};
    close_memory();
    const auto folder = request.output.dem.parent_path();
    request.fusion.folder = folder.empty() ? "." : folder;
    std::string all;
    for (const auto& input : scans.choice.inputs) all += (all.empty() ? "" : " ") + input.string();
    request.output.facts = {
        {"version", GROUNDRAY_VERSION}, {"command", "reconstruct dem"}, {"input", all}};
  }
};

DemCommand::DemCommand(CLI::App& reconstruct) : options_(std::make_unique<Options>()) {
  options_->command = reconstruct.add_subcommand(
      "dem", "Fuse scans and stereo pairs into a DEM with standard deviations");
  options_->add_files();
  options_->add_place();
  options_->scans.add(options_->command);
  options_->add_noise();
  options_->add_stereo();
  options_->add_filter();
  options_->add_filling();
  options_->add_sight();
}

DemCommand::~DemCommand() = default;

bool DemCommand::is_asked_for() const { return options_->command->parsed(); }

void DemCommand::run() const {
  options_->close();
  rebuild_dem(options_->request);
}

}  // namespace groundray
