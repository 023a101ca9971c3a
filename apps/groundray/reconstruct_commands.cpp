#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/mesh/rebuild.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr double radians_per_degree = std::numbers::pi / 180;

enum class SurfacePreset { Ground, Strict, Object };

// Options for accepting triangles as surface and for merging surfaces.
struct SurfaceOptions {
  std::optional<SurfacePreset> preset;
  std::optional<double> perimeter_m;
  bool is_unorganised = false;

  void add(CLI::App* command, MeshRequest& request) {
    MergeLimits& merging = request.steps.merging;
    CLI::App* surface = command->add_option_group("Surface");
    const Words<SurfacePreset> presets{{"ground", SurfacePreset::Ground},
                                       {"strict", SurfacePreset::Strict},
                                       {"object", SurfacePreset::Object}};
    add_words(surface, "--preset", preset,
              "Criteria for surface between returns: ground (88 deg, 3 m), strict (85 deg, 2 m), "
              "object (75.5 deg)",
              presets);
    add_scaled(surface, "--incidence-deg", request.incidence_rad, radians_per_degree,
               "Largest angle of incidence, instead of the preset's")
        ->check(CLI::Range(0.0, 90.0));
    add_number(surface, "--longest-m", request.longest_m, positive(), "Longest edge");
    add_number(surface, "--noise-sds", request.noise_sds, not_negative(),
               "Standard deviations of range that are attributed to noise in an edge");
    auto* unorganised = surface->add_flag(
        "--unorganised", is_unorganised,
        "Points have no order: mesh all scans together by CGAL's advancing front");
    add_number(surface, "--perimeter-m", perimeter_m, positive(),
               "Largest perimeter of such a triangle (3)")
        ->needs(unorganised);
    add_number(surface, "--merge-sds", merging.noise_sds, not_negative(),
               "Largest distance between one surface in two scans, in standard deviations of both");
    add_number(surface, "--apart-m", request.steps.apart_m, not_negative(),
               "Permitted distance in addition, for errors of poses");
    add_scaled(surface, "--turned-deg", merging.turned_rad, radians_per_degree,
               "Largest angle between one surface in two scans")
        ->check(positive() & CLI::Range(0.0, 90.0));
  }

  void close(MeshRequest& request) const {
    constexpr double usual_perimeter_m = 3;
    if (is_unorganised) request.perimeter_m = perimeter_m.value_or(usual_perimeter_m);
    if (preset == SurfacePreset::Ground) request.screening = ScreeningLimits::ground();
    if (preset == SurfacePreset::Strict) request.screening = ScreeningLimits::strict();
    if (preset == SurfacePreset::Object) request.screening = ScreeningLimits::object();
  }
};

// Options for the end of simplification, of which one may be given.
struct StopOptions {
  std::optional<double> vertical_m, error_m, border_m, sds, crease_rad;
  std::optional<std::size_t> triangles;
  bool at_knee = false;

  enum class Need { One, None };

  void add(CLI::App* command, Need need) {
    CLI::App* stop = command->add_option_group(
        "Simplify", "Until one of these; the error is always measured and reported");
    CLI::App* one = stop->add_option_group("Stop criterion");
    add_number(one, "--max-vertical-error-m", vertical_m, positive(),
               "For terrain: until a vertical distance would be larger");
    add_number(one, "--max-error-m", error_m, positive(),
               "Until the distance of a point of either mesh would be larger");
    add_number(one, "--triangles", triangles, positive(), "Until this many are left");
    add_number(one, "--noise-halt", sds, positive(),
               "Until the error reaches this many standard deviations of the measurements");
    one->add_flag("--knee", at_knee,
                  "Until errors begin to rise faster than the number of triangles falls");
    one->require_option(need == Need::One ? 1 : 0, 1);
    add_number(stop, "--border-m", border_m, not_negative(),
               "Largest movement of borders, for --max-error-m and --max-vertical-error-m "
               "(that bound)");
    add_scaled(stop, "--crease-deg", crease_rad, radians_per_degree,
               "Keep edges that are sharper (60); 180 for none. With --triangles only if labels "
               "are kept")
        ->check(CLI::Range(0.0, 180.0));
  }

  /// Returns the condition that ends simplification, or nothing.
  /// @throws Error if an option would have no effect.
  std::optional<StopCriterion> stop() const {
    if (border_m && !vertical_m && !error_m)
      throw Error("--border-m: only --max-error-m and --max-vertical-error-m bound the borders");
    const bool is_none = !vertical_m && !error_m && !triangles && !sds && !at_knee;
    if (crease_rad && is_none)
      throw Error(
          "--crease-deg: nothing is simplified without a stopping option, such as --max-error-m");
    if (vertical_m) return VerticalBound{*vertical_m, border_m.value_or(*vertical_m)};
    if (error_m) return DistanceBound{*error_m, border_m.value_or(*error_m)};
    if (triangles) return FaceBudget{*triangles};
    if (sds) return NoiseBound{*sds};
    if (at_knee) return CostKnee{};
    return std::nullopt;
  }

  void close(MeshBuildOptions& steps) const {
    steps.stop = stop();
    if (crease_rad) steps.simplify.crease_rad = *crease_rad;
  }
};

// Options of one of the commands that make or change a mesh.
struct MeshCommandOptions {
  CLI::App* command;
  MeshRequest request;
  ScanOptions scans;
  SurfaceOptions surface;
  StopOptions stop;
  fs::path input;  // mesh to simplify or to fill

  MeshCommandOptions(CLI::App& all, const char* name, const char* meaning)
      : command(all.add_subcommand(name, meaning)) {}

  void add_input() {
    command->add_option("MESH", input, "Any .ply, .obj, .stl, .gltf or .glb")->required();
  }

  void add_output() {
    command
        ->add_option(
            "-o,--output", request.output.mesh,
            "Mesh to write: .ply (doubles, with attributes of vertices), .obj, .stl or .glb")
        ->required();
    command->add_option("--report", request.output.report, "JSON file of all results");
    add_memory(command, request.most_bytes, "Limit of memory");
  }

  CLI::Option* add_fill() {
    return add_number(command, "--fill-m", request.steps.fill_m, positive(),
                      "Fill holes whose boundary is no longer than this");
  }

  void run_scans() {
    scans.close();
    surface.close(request);
    stop.close(request.steps);
    request.output.facts = facts_of("reconstruct mesh", scans.choice.inputs);
    rebuild_mesh(scans.choice, scans.taking, request);
  }

  void run_mesh() {
    stop.close(request.steps);
    request.output.facts = facts_of("reconstruct " + command->get_name(), {&input, 1});
    rework_mesh(input, request);
  }
};

Command add_mesh(CLI::App& all) {
  const auto options = std::make_shared<MeshCommandOptions>(
      all, "mesh",
      "Link scans into meshes, check them against other scans, and merge them into one");
  CLI::App* mesh = options->command;
  mesh->add_option(
          "INPUT", options->scans.choice.inputs,
          "A dataset folder; or scans (.ply .pcd .npy .npz .bin, .las .laz .mcap); or a .conf of "
          "Stanford's range scans")
      ->required();
  options->add_output();
  mesh->add_option("--occlusion", options->request.output.occlusion,
                   "Mesh of occlusions: links that were rejected as surface");
  options->scans.add(mesh);
  options->scans.add_grid(mesh);
  options->surface.add(mesh, options->request);
  options->add_fill();
  options->stop.add(mesh, StopOptions::Need::None);
  CLI::Option* unorganised = option_of(*mesh, "--unorganised");
  for (const char* of_grids :
       {"--occlusion", "--grid", "--preset", "--incidence-deg", "--longest-m", "--noise-sds",
        "--merge-sds", "--apart-m", "--turned-deg"})
    option_of(*mesh, of_grids)->excludes(unorganised);
  return {mesh, [options] { options->run_scans(); }};
}

Command add_simplify(CLI::App& all) {
  const auto options =
      std::make_shared<MeshCommandOptions>(all, "simplify", "Simplify a mesh within bounds");
  options->add_input();
  options->add_output();
  add_number(options->command, "--sd-m", options->request.sd_m, positive(),
             "Standard deviation of vertices, instead of the mesh's");
  options->stop.add(options->command, StopOptions::Need::One);
  return {options->command, [options] { options->run_mesh(); }};
}

Command add_fill(CLI::App& all) {
  const auto options =
      std::make_shared<MeshCommandOptions>(all, "fill", "Fill the holes of a mesh");
  options->add_input();
  options->add_output();
  options->add_fill()->required();
  return {options->command, [options] { options->run_mesh(); }};
}

}  // namespace

void add_reconstruct_commands(CLI::App& app, std::vector<Command>& commands) {
  CLI::App* all = app.add_subcommand(
      "reconstruct",
      "Meshes and DEMs from scans (docs/theory/reconstruction.md, docs/theory/dem.md)");
  all->require_subcommand(1);
  for (const auto& add : {add_mesh, add_simplify, add_fill, add_dem_command})
    commands.push_back(add(*all));
}

}  // namespace groundray
