#include <fmt/format.h>
#include <vtkObject.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "apps/scan/usage_fault.h"
#include "apps/view/compare/deviation.h"
#include "apps/view/load_input.h"
#include "apps/view/rendering/offscreen_render.h"
#include "apps/view/window/run_window.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"

namespace groundray {
namespace {

constexpr int done = 0;
constexpr int failed = 1;
constexpr int wrong_usage = 2;

struct Arguments {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path screenshot;
  std::string size, look_from, look_at, follow, range, clip;
  std::vector<std::string> origins;
  std::filesystem::path compare_with;
  double tolerance_m = 0;
  int turntable = 0;
  StillSpec still;
  bool no_legend = false;
};

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("INPUT", arguments.inputs,
                 "Scene (.yaml), dataset (folder), mesh, cloud, DEM or picture; any number");
  app.add_option("--screenshot", arguments.screenshot,
                 "Write a picture (.png) and exit; needs no window, display or X server");
  app.add_option("--size", arguments.size,
                 "Size of the picture that --screenshot writes, px: 1280x720");
  app.add_option("--look-from", arguments.look_from, "X,Y,Z of the eye in map coordinates, m");
  app.add_option("--look-at", arguments.look_at, "X,Y,Z of the point at the centre of the picture");
  app.add_option("--follow", arguments.follow,
                 "X,Y,Z of the terrain's viewpoint for --screenshot, instead of the eye");
  app.add_option("--colour-by", arguments.still.view.colour_by,
                 "COLUMN of all layers that have it, or LAYER=COLUMN; may be repeated");
  app.add_option("--range", arguments.range,
                 "LOW,HIGH: range of the colours of --colour-by and --compare-with");
  app.add_option("--hide", arguments.still.view.hide, "LAYER, or a group of layers: objects");
  app.add_option("--point-size", arguments.still.view.point_size_px,
                 "Size of the points of clouds, px")
      ->check(CLI::Range(1.0, 32.0));
  app.add_option("--compare-with", arguments.compare_with,
                 "Scene, DEM or mesh: colour clouds and meshes by their deviation from it, and "
                 "print statistics; with --screenshot");
  app.add_option(
         "--tolerance-m", arguments.tolerance_m,
         "With --compare-with a mesh: print precision and completeness within this distance")
      ->check(CLI::PositiveNumber);
  app.add_option(
      "--origin", arguments.origins,
      "X,Y,Z in map coordinates, m, at which meshes and clouds of local coordinates have "
      "theirs of 0; INPUT=X,Y,Z for one file; may be repeated");
  app.add_option("--clip", arguments.clip,
                 "X0,Y0,Z0,X1,Y1,Z1: show only what is inside this box, in map coordinates, m");
  app.add_option("--exposure-ev", arguments.still.view.exposure_ev,
                 "Brighten pictures by this power of 2, in linear light; light is exposed "
                 "automatically at 0")
      ->check(CLI::Range(-10.0, 10.0));
  app.add_flag("--eye-dome", arguments.still.view.has_eye_dome,
               "Draw with eye-dome lighting, which shows the shape of clouds");
  app.add_flag("--wireframe", arguments.still.view.is_wireframe, "Draw surfaces as wireframes");
  app.add_flag("--no-legend", arguments.no_legend, "Omit the legend");
  app.add_option(
      "--turntable", arguments.turntable,
      "Write this many pictures of a complete turn into the folder given by --screenshot");
}

void read_spec(Arguments& arguments) {
  StillSpec& spec = arguments.still;
  if (!arguments.size.empty()) spec.size_px = parse_size(arguments.size);
  if (!arguments.look_from.empty())
    spec.view.from_w_m = parse_place(arguments.look_from, "--look-from");
  if (!arguments.look_at.empty()) spec.view.at_w_m = parse_place(arguments.look_at, "--look-at");
  if (!arguments.follow.empty()) spec.follow_w_m = parse_place(arguments.follow, "--follow");
  if (!arguments.range.empty()) spec.range = parse_range(arguments.range);
  if (!arguments.clip.empty()) spec.view.clip = parse_box(arguments.clip);
  for (const std::string& origin : arguments.origins)
    spec.view.origins.push_back(parse_origin(origin));
  if (spec.view.from_w_m && spec.view.from_w_m == spec.view.at_w_m)
    throw Error("--look-from and --look-at are the same point: they must differ");
  spec.view.has_legend = !arguments.no_legend;
}

Truth open_truth(const std::filesystem::path& path) {
  Opened opened = open_any(path);
  const std::string name = path.filename().string();
  if (opened.simulation) return {name, opened.simulation};
  if (opened.kind == InputKind::Dem) return {name, Truth::DemFile{path}};
  if (opened.kind == InputKind::Mesh) return {name, opened.layers.front()};
  throw Error("--compare-with {}: the truth must be a scene, a DEM or a mesh", path.string());
}

// Colours clouds and meshes by their deviation from the truth, and prints the statistics.
void compare_inputs(std::vector<Opened>& inputs, const Arguments& arguments) {
  const Truth truth = open_truth(arguments.compare_with);
  int compared = 0;
  for (Opened& input : inputs) {
    for (Layer& layer : input.layers) {
      if (layer.kind != LayerKind::Cloud && layer.kind != LayerKind::Mesh) continue;
      if (input.simulation) continue;  // layers of a scene are no measurements
      const Comparison found = compare(layer, truth, arguments.tolerance_m, {}, {});
      layer = coloured_by_deviation(layer, found);
      fmt::print("{} from {}:\n", layer.name, truth.name);
      for (const std::string& line : figure_lines(found.deviation.figures))
        fmt::print("  {}\n", line);
      for (const std::string& line : agreement_lines(found.agreements)) fmt::print("  {}\n", line);
      ++compared;
    }
  }
  if (compared == 0)
    throw Error("--compare-with: no input is a cloud, a dataset with scans or a mesh");
}

int take_stills(const Arguments& arguments) {
  if (arguments.inputs.empty())
    throw Error("--screenshot: there is nothing to show; give a file or a folder");
  if (arguments.turntable == 0) check_ending(arguments.screenshot, {".png"});
  const StillSpec& spec = arguments.still;
  std::vector<Opened> inputs;
  for (const std::filesystem::path& input : arguments.inputs) {
    inputs.push_back(open_any(input));
    for (const std::string& note : inputs.back().notes) print_error("note: {}\n", note);
  }
  place_inputs(inputs, spec.view.origins);
  if (!arguments.compare_with.empty()) compare_inputs(inputs, arguments);
  View view(make_offscreen_window(spec.size_px));
  arrange(view, inputs, spec);
  if (arguments.turntable != 0) {
    write_turntable(view, arguments.screenshot, arguments.turntable, spec.size_px);
  } else {
    write_still(view, arguments.screenshot, spec.size_px);
  }
  return done;
}

// Returns the name of an option that requires --screenshot but is given without it; empty if there
// is none.
std::string without_screenshot(const Arguments& arguments) {
  if (!arguments.screenshot.empty()) return "";
  if (arguments.turntable != 0) return "--turntable";
  if (!arguments.size.empty()) return "--size";
  if (!arguments.follow.empty()) return "--follow";
  if (!arguments.range.empty()) return "--range";
  return arguments.compare_with.empty() ? "" : "--compare-with";
}

int run(int argc, char** argv) {
  CLI::App app("groundray-view shows scenes, scans, meshes, DEMs and pictures.", "groundray-view");
  app.footer(
      "Look at the demo:  groundray-view data/scenes/offroad_trail.yaml\n"
      "A picture of it:   groundray-view data/scenes/offroad_trail.yaml --screenshot trail.png\n"
      "Exit codes:        0 done, 1 failed, 2 wrong usage");
  app.set_version_flag("--version", "groundray-view " GROUNDRAY_VERSION);
  Arguments arguments;
  add_options(app, arguments);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  const std::string lonely = without_screenshot(arguments);
  if (!lonely.empty()) {
    print_error("groundray-view: {} needs --screenshot\n", lonely);
    return wrong_usage;
  }
  if (arguments.tolerance_m > 0 && arguments.compare_with.empty()) {
    print_error("groundray-view: --tolerance-m needs --compare-with\n");
    return wrong_usage;
  }
  read_spec(arguments);
  if (arguments.screenshot.empty())
    return run_window(argc, argv, {.inputs = arguments.inputs, .view = arguments.still.view});
  vtkObject::GlobalWarningDisplayOff();  // errors are thrown instead
  return take_stills(arguments);
}

}  // namespace
}  // namespace groundray

int main(int argc, char** argv) {
  try {
    return groundray::run(argc, argv);
  } catch (const std::bad_alloc&) {
    groundray::print_error("groundray-view: there is not enough memory\n");
  } catch (const std::exception& fault) {
    groundray::print_error("groundray-view: {}\n", fault.what());
  }
  return groundray::failed;
}
