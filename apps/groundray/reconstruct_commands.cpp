#include "apps/groundray/reconstruct_commands.h"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/dem/dem_command.h"
#include "apps/groundray/mesh/rebuild.h"
#include "apps/groundray/scan_options.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr double radians_per_degree = std::numbers::pi / 180;

std::optional<double> radians(const std::optional<double>& angle_deg) {
  if (!angle_deg) return std::nullopt;
  return *angle_deg * radians_per_degree;
}

}  // namespace

enum class SurfacePreset { Ground, Strict, Object };

// Options for accepting triangles as surface and for merging surfaces.
struct SurfaceOptions {
  std::optional<SurfacePreset> preset;
  std::optional<double> incidence_deg, longest_m, noise_sds;
  std::optional<double> turned_deg, perimeter_m, apart_m;
  bool is_unorganised = false;
  MergeLimits merging;

  void add(CLI::App* command) {
    CLI::App* surface = command->add_option_group("Surface");
    const Words<SurfacePreset> presets{{"ground", SurfacePreset::Ground},
                                       {"strict", SurfacePreset::Strict},
                                       {"object", SurfacePreset::Object}};
    add_words(surface, "--preset", preset,
              "Criteria for surface between returns: ground (88 deg, 3 m), strict (85 deg, 2 m), "
              "object (75.5 deg)",
              presets);
    surface
        ->add_option("--incidence-deg", incidence_deg,
                     "Largest angle of incidence, instead of the preset's")
        ->check(CLI::Range(0.0, 90.0));
    surface->add_option("--longest-m", longest_m, "Longest edge")->check(positive());
    surface
        ->add_option("--noise-sds", noise_sds,
                     "Standard deviations of range that are attributed to noise in an edge")
        ->check(not_negative());
    auto* unorganised = surface->add_flag(
        "--unorganised", is_unorganised,
        "Points have no order: mesh all scans together by CGAL's advancing front");
    surface->add_option("--perimeter-m", perimeter_m, "Largest perimeter of such a triangle (3)")
        ->check(positive())
        ->needs(unorganised);
    surface
        ->add_option(
            "--merge-sds", merging.noise_sds,
            "Largest distance between one surface in two scans, in standard deviations of both")
        ->check(not_negative());
    surface->add_option("--apart-m", apart_m, "Permitted distance in addition, for errors of poses")
        ->check(not_negative());
    surface
        ->add_option("--turned-deg", turned_deg, "Largest angle between one surface in two scans")
        ->check(positive() & CLI::Range(0.0, 90.0));
  }

  Meshing meshing() const {
    constexpr double usual_perimeter_m = 3;
    Meshing meshing{.incidence_rad = radians(incidence_deg),
                    .longest_m = longest_m,
                    .noise_sds = noise_sds,
                    .merging = merging,
                    .apart_m = apart_m};
    if (turned_deg) meshing.merging.turned_rad = *turned_deg * radians_per_degree;
    if (is_unorganised) meshing.perimeter_m = perimeter_m.value_or(usual_perimeter_m);
    if (preset == SurfacePreset::Ground) meshing.screening = ScreeningLimits::ground();
    if (preset == SurfacePreset::Strict) meshing.screening = ScreeningLimits::strict();
    if (preset == SurfacePreset::Object) meshing.screening = ScreeningLimits::object();
    return meshing;
  }
};

// Options for the end of simplification, of which one may be given.
struct StopOptions {
  std::optional<double> vertical_m, error_m, border_m, sds, crease_deg;
  std::optional<std::size_t> triangles;
  bool at_knee = false;

  enum class Need { One, None };

  void add(CLI::App* command, Need need) {
    CLI::App* stop = command->add_option_group(
        "Simplify", "Until one of these; the error is always measured and reported");
    CLI::App* one = stop->add_option_group("Stop criterion");
    one->add_option("--max-vertical-error-m", vertical_m,
                    "For terrain: until a vertical distance would be larger")
        ->check(positive());
    one->add_option("--max-error-m", error_m,
                    "Until the distance of a point of either mesh would be larger")
        ->check(positive());
    one->add_option("--triangles", triangles, "Until this many are left")->check(positive());
    one->add_option("--noise-halt", sds,
                    "Until the error reaches this many standard deviations of the measurements")
        ->check(positive());
    one->add_flag("--knee", at_knee,
                  "Until errors begin to rise faster than the number of triangles falls");
    one->require_option(need == Need::One ? 1 : 0, 1);
    stop->add_option("--border-m", border_m,
                     "Largest movement of borders, for --max-error-m and --max-vertical-error-m "
                     "(that bound)")
        ->check(not_negative());
    stop->add_option("--crease-deg", crease_deg,
                     "Keep edges that are sharper (60); 180 for none. With --triangles only if "
                     "labels are kept")
        ->check(CLI::Range(0.0, 180.0));
  }

  /// Returns the condition that ends simplification, or nothing.
  /// @throws Error if an option would have no effect.
  std::optional<StopCriterion> stop() const {
    if (border_m && !vertical_m && !error_m)
      throw Error("--border-m: only --max-error-m and --max-vertical-error-m bound the borders");
    const bool is_none = !vertical_m && !error_m && !triangles && !sds && !at_knee;
    if (crease_deg && is_none)
      throw Error(
          "--crease-deg: nothing is simplified without a stopping option, such as --max-error-m");
    if (vertical_m) return VerticalBound{*vertical_m, border_m.value_or(*vertical_m)};
    if (error_m) return DistanceBound{*error_m, border_m.value_or(*error_m)};
    if (triangles) return FaceBudget{*triangles};
    if (sds) return NoiseBound{*sds};
    if (at_knee) return CostKnee{};
    return std::nullopt;
  }

  SimplifyOptions options() const {
    SimplifyOptions options;
    if (crease_deg) options.crease_rad = *crease_deg * radians_per_degree;
    return options;
  }
};

// Options for the output files and the memory limit of all commands.
struct OutputOptions {
  RebuildOutput output;
  std::optional<std::uint64_t> memory_mb;

  void add(CLI::App* command) {
    command
        ->add_option(
            "-o,--output", output.mesh,
            "Mesh to write: .ply (doubles, with attributes of vertices), .obj, .stl or .glb")
        ->required();
    command->add_option("--report", output.report, "JSON file of all results");
    command->add_option("--memory-mb", memory_mb, "Limit of memory")->check(positive());
  }

  void close(const std::string& command, const std::vector<fs::path>& inputs) {
    std::string all;
    for (const fs::path& input : inputs) all += (all.empty() ? "" : " ") + input.string();
    output.facts = {{"version", GROUNDRAY_VERSION}, {"command", command}, {"input", all}};
  }

  void limit(Finishing& finishing) const {
    constexpr std::size_t bytes_per_mb = 1'000'000;
    constexpr std::size_t most = std::numeric_limits<std::size_t>::max();
    if (memory_mb && *memory_mb < most / bytes_per_mb)
      finishing.most_bytes = *memory_mb * bytes_per_mb;
  }
};

struct ReconstructCommands::Options {
  CLI::App *all = nullptr, *mesh = nullptr, *simplify = nullptr, *fill = nullptr;
  ScanOptions scans;
  SurfaceOptions surface;
  std::array<StopOptions, 2> stop;  // for mesh and simplify
  std::array<OutputOptions, 3> out;
  std::optional<DemCommand> dem;
  std::optional<double> fill_m, sd_m;
  fs::path input;  // for simplify and fill

  void add_mesh() {
    mesh = all->add_subcommand(
        "mesh", "Link scans into meshes, check them against other scans, and merge them into one");
    mesh->add_option("INPUT", scans.choice.inputs,
                     "A dataset folder; or scans (.ply .pcd .npy .npz .bin); or a .conf of "
                     "Stanford's range scans")
        ->required();
    out[0].add(mesh);
    mesh->add_option("--occlusion", out[0].output.occlusion,
                     "Mesh of occlusions: links that were rejected as surface");
    scans.add(mesh);
    scans.add_grid(mesh);
    surface.add(mesh);
    add_fill(mesh)->required(false);
    stop[0].add(mesh, StopOptions::Need::None);
    CLI::Option* unorganised = mesh->get_option("--unorganised");
    for (const char* of_grids :
         {"--occlusion", "--grid", "--preset", "--incidence-deg", "--longest-m", "--noise-sds",
          "--merge-sds", "--apart-m", "--turned-deg"})
      mesh->get_option(of_grids)->excludes(unorganised);
  }

  CLI::Option* add_fill(CLI::App* command) {
    return command
        ->add_option("--fill-m", fill_m, "Fill holes whose boundary is no longer than this")
        ->check(positive());
  }

  void add_simplify() {
    simplify = all->add_subcommand("simplify", "Simplify a mesh within bounds");
    add_input(simplify);
    out[1].add(simplify);
    simplify->add_option("--sd-m", sd_m, "Standard deviation of vertices, instead of the mesh's")
        ->check(positive());
    stop[1].add(simplify, StopOptions::Need::One);
  }

  void add_filling() {
    fill = all->add_subcommand("fill", "Fill the holes of a mesh");
    add_input(fill);
    out[2].add(fill);
    add_fill(fill)->required();
  }

  void add_input(CLI::App* command) {
    command->add_option("MESH", input, "Any .ply, .obj, .stl, .gltf or .glb")->required();
  }

  void run_mesh() {
    scans.close();
    out[0].close("reconstruct mesh", scans.choice.inputs);
    Finishing finishing{
        .fill_m = fill_m, .stop = stop[0].stop(), .simplify = stop[0].options(), .sd_m = {}};
    out[0].limit(finishing);
    rebuild_mesh(scans.choice, scans.taking, surface.meshing(), finishing, out[0].output);
  }

  void run_finish() {
    const bool is_simplify = simplify->parsed();
    OutputOptions& to = out[is_simplify ? 1 : 2];
    to.close(is_simplify ? "reconstruct simplify" : "reconstruct fill", {input});
    Finishing finishing{
        .fill_m = fill_m, .stop = stop[1].stop(), .simplify = stop[1].options(), .sd_m = sd_m};
    to.limit(finishing);
    finish_mesh(input, finishing, to.output);
  }
};

ReconstructCommands::ReconstructCommands(CLI::App& app) : options_(std::make_unique<Options>()) {
  options_->all = app.add_subcommand(
      "reconstruct",
      "Meshes and DEMs from scans (docs/theory/reconstruction.md, docs/theory/dem.md)");
  options_->all->require_subcommand(1);
  options_->add_mesh();
  options_->add_simplify();
  options_->add_filling();
  options_->dem.emplace(*options_->all);
}

ReconstructCommands::~ReconstructCommands() = default;

bool ReconstructCommands::is_asked_for() const { return options_->all->parsed(); }

void ReconstructCommands::run() const {
  if (options_->mesh->parsed()) return options_->run_mesh();
  if (options_->dem->is_asked_for()) return options_->dem->run();
  options_->run_finish();
}

}  // namespace groundray
