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

// Less is a sag of a thousandth of a millimetre in a metre: no ground has it, and it takes long.
constexpr double least_curvature_per_m = 1e-5, most_curvature_per_m = 1e3;

// What the machine has: who takes more may be ended by the system without a word.
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
    command->add_option("--picture", output.picture,
                        "PNG: what was measured, what was filled, and the error or its sd");
    auto* truth = command->add_option("--truth", request.truth, "A DEM to compare with");
    command->add_option("--error-map", output.error_map, "GeoTIFF of the errors")->needs(truth);
    command->add_option("--report", output.report, "JSON file for all figures");
    command
        ->add_option("--memory-mb", memory_mb,
                     "Begin no work that would take more (what the machine has)")
        ->check(positive());
  }

  void add_place() {
    CLI::App* place = command->add_option_group("Place");
    auto* cell = place->add_option("--cell-m", request.cell_m, "Side of the DEM's cells");
    cell->check(positive());
    place->add_option("--like", request.like, "Take the samples of this DEM")->excludes(cell);
    place->add_option("--area", area, "W S E N: in the CRS, metres: no cell beyond")->expected(4);
  }

  void add_noise() {
    CLI::App* noise = command->add_option_group("Noise");
    noise
        ->add_option("--divergence-mrad", divergence_mrad,
                     "Of beams, full angle between the 1/e^2 points, instead of what a dataset "
                     "tells")
        ->check(not_negative());
    noise
        ->add_option("--position-sd-m", request.noise.position_sd_m,
                     "Of each pose, along each axis")
        ->check(not_negative());
    noise->add_option("--attitude-sd-mrad", attitude_sd_mrad, "Of each pose, about each axis")
        ->check(not_negative());
    noise
        ->add_option("--across-sd-m", request.noise.across_sd_m,
                     "Of points in plan, each way, besides")
        ->check(not_negative());
    noise
        ->add_option("--pose-gap-s", request.noise.longest_pose_gap_s,
                     "Between poses, at most, where a scan was made (1)")
        ->check(positive());
    noise->add_flag("--airborne", is_airborne,
                    "Points were measured from far above, in the coordinates of a map");
    noise
        ->add_option("--most-sd-m", request.fusion.most_sd_m,
                     "Leave samples unmeasured whose height is known worse than this")
        ->check(positive());
    noise->add_option("--outlier-share", request.fusion.outlier_share, "Of all points (0.02)")
        ->check(CLI::Range(0.0, 0.5));
  }

  void add_stereo() {
    CLI::App* stereo = command->add_option_group("Stereo");
    stereo->add_option("--stereo", request.pairs.names,
                       "Pairs of a dataset by name, or cameras LEFT,RIGHT; all pairs without it");
    stereo->add_flag("--no-stereo", without_stereo, "Take lidars alone");
    stereo->add_flag("--no-lidar", without_lidar, "Take a dataset's stereo pairs alone");
    stereo->add_option("--stereo-frames", stereo_frames, "A:B:STEP, as --frames, of images");
    StereoPointOptions& points = request.stereo.points;
    stereo->add_option("--nearest-m", points.nearest_m, "Depth of matches, at least")
        ->check(not_negative());
    stereo->add_option("--farthest-depth-m", points.farthest_m, "Depth of matches, at most")
        ->check(positive());
    stereo
        ->add_option("--match-sd-px", points.noise.match_px,
                     "Of each disparity, instead of what matching tells")
        ->check(positive());
    stereo
        ->add_option("--bias-sd-px", points.noise.bias_px,
                     "Of what all disparities of a pair have in common (0.1)")
        ->check(not_negative());
  }

  void add_filter() {
    CLI::App* group = command->add_option_group("Ground");
    const Words<FilterPreset> presets{
        {"none", FilterPreset::None}, {"ground", FilterPreset::Ground}, {"air", FilterPreset::Air}};
    add_words(group, "--ground-filter", filter,
              "Leave out what stands on the ground, as scans from the ground or from the air show "
              "it; none (default): the lowest surface of each cell is the ground",
              presets);
    group->add_option("--filter-cell-m", filter_cell_m, "Of its raster")->check(positive());
    group->add_option("--filter-slope", filter_slope, "Steeper is no ground")->check(positive());
    group->add_option("--filter-radius-m", filter_radius_m, "Half the width of what is no ground")
        ->check(not_negative());
    group->add_option("--filter-threshold-m", filter_threshold_m, "How far points may lie off")
        ->check(positive());
  }

  void add_filling() {
    CLI::App* group = command->add_option_group("Blank areas");
    group->add_flag("--no-fill", without_filling, "Leave them blank");
    const Words<FillMethod> methods{{"tension", FillMethod::Tension}, {"cgal", FillMethod::Mesh}};
    add_words(group, "--method", request.fill_method,
              "tension: the smoothest surface (default); cgal: faired meshes", methods);
    limits.add(group);
  }

  void add_sight() {
    CLI::App* group = command->add_option_group("Sight and smoothness");
    const Words<SightUse> uses{{"none", SightUse::None}, {"beams", SightUse::Beams}};
    add_words(group, "--sight", request.sight,
              "What bounds the ground from above: beams that passed (default)", uses);
    group->add_option("--sight-margin-m", request.sight_margin_m, "Added (a quarter of a cell)")
        ->check(not_negative());
    auto* smooth = group->add_flag("--smooth", is_smoothed, "Smooth measured heights first");
    group->add_option("--curvature-sd-per-m", curvature_sd_per_m, "Of true ground, for --smooth")
        ->check(positive())
        ->check(CLI::Range(least_curvature_per_m, most_curvature_per_m))
        ->needs(smooth);
  }

  // What would be read and then left unused is rather refused.
  void refuse(std::initializer_list<const char*> options, const char* why) const {
    for (const char* option : options) {
      if (command->get_option(option)->count() > 0)
        throw Error("{}: {}: leave one of them out", option, why);
    }
  }

  void check_use() const {
    if (without_stereo)
      refuse({"--stereo", "--stereo-frames", "--nearest-m", "--farthest-depth-m", "--match-sd-px",
              "--bias-sd-px"},
             "--no-stereo leaves pairs out");
    if (is_airborne)
      refuse({"--divergence-mrad", "--attitude-sd-mrad", "--sight", "--sight-margin-m"},
             "with --airborne nothing is known of beams");
    if (without_filling)
      refuse({"--method", "--reach", "--farthest-m", "--largest-share", "--most-edges"},
             "--no-fill fills nothing");
    if (request.fill_method == FillMethod::Mesh)
      refuse({"--sight", "--sight-margin-m"}, "--method cgal takes no bounds");
    else
      refuse({"--most-edges"}, "only --method cgal goes by rims");
    if (without_stereo && without_lidar)
      throw Error("--no-lidar and --no-stereo leave nothing that measures: leave one out");
  }

  std::optional<GroundFilterOptions> ground_filter() const {
    if (filter == FilterPreset::None) {
      if (filter_cell_m || filter_slope || filter_radius_m || filter_threshold_m)
        throw Error("--filter-...: there is no filter to set: say --ground-filter ground or air");
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
      "dem", "Fuse scans and stereo pairs to a DEM that tells how far off it may be");
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
