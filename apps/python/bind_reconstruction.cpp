#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/enum_from_text.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/mesh.h"
#include "apps/python/placed_returns.h"
#include "core/error.h"
#include "reconstruction/mesh/holes/hole_fill.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "reconstruction/mesh/simplify/simplify.h"
#include "reconstruction/pipeline/mesh_pipeline.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;
using MeshAndFigures = std::tuple<Mesh, nb::dict>;

// ----- from scans

struct Linking {
  ScreeningLimits screening;
  ReturnChoice returns = ReturnChoice::Last;
  std::optional<double> range_sd_m;
};

ScreeningLimits screening_of(const std::string& preset) {
  return chosen<ScreeningLimits>("preset", preset,
                                 {{"ground", ScreeningLimits::ground()},
                                  {"strict", ScreeningLimits::strict()},
                                  {"object", ScreeningLimits::object()}});
}

MeshResult built_mesh(const std::vector<const Sweep*>& sweeps, const Linking& linking,
                      std::optional<double> apart_m, const StopRequest& stop) {
  std::vector<ScanMesh> meshes;
  for (const Sweep* sweep : sweeps) {
    stop.obey();
    ScanMesh mesh = link(organised(*sweep, linking.range_sd_m, linking.returns), linking.screening);
    mesh.occlusion = {};
    if (!mesh.mesh.shape.triangles.empty()) meshes.push_back(std::move(mesh));
  }
  if (meshes.empty())
    throw Error(
        "reconstruct_mesh: no neighbouring returns of the {} scans were accepted as surface; "
        "preset, longest_m and range_sd_m control this",
        sweeps.size());
  if (meshes.size() > 1 && !apart_m && std::ranges::none_of(meshes, knows_noise, &ScanMesh::mesh))
    throw Error(
        "reconstruct_mesh: the noise of these scans is unknown, and with it the distance up to "
        "which two scans show one surface: give the standard deviation of ranges as range_sd_m, or "
        "that distance as apart_m");
  return build_mesh(std::move(meshes), {.merging = {}, .apart_m = apart_m},
                    {.progress = [&](const char*, double) { stop.obey(); }});
}

MeshAndFigures reconstruct_mesh(const std::vector<const Sweep*>& scans, const std::string& preset,
                                std::optional<double> incidence_rad,
                                std::optional<double> longest_m, std::optional<double> noise_sds,
                                const std::string& returns, std::optional<double> range_sd_m,
                                std::optional<double> apart_m) {
  check_scans("reconstruct_mesh", scans);
  Linking linking{.screening = screening_of(preset),
                  .returns = chosen<ReturnChoice>("returns", returns,
                                                  {{"last", ReturnChoice::Last},
                                                   {"strongest", ReturnChoice::Strongest},
                                                   {"first", ReturnChoice::First}}),
                  .range_sd_m = range_sd_m};
  linking.screening.incidence_rad = incidence_rad.value_or(linking.screening.incidence_rad);
  linking.screening.longest_m = longest_m.value_or(linking.screening.longest_m);
  linking.screening.noise_sds = noise_sds.value_or(linking.screening.noise_sds);
  MeshResult result = without_gil(
      [&](const StopRequest& stop) { return built_mesh(scans, linking, apart_m, stop); });
  const MergeCounts& counts = result.merged;
  nb::dict figures;
  figures["redundant"] = counts.redundant;
  figures["seen_through"] = counts.visibility_conflicts;
  figures["clipped"] = counts.clipped;
  figures["filled"] = counts.filled;
  figures["bridged"] = counts.bridged;
  figures["moved"] = counts.moved;
  figures["left_out"] = counts.left_out;
  return {Mesh{std::move(result.mesh), scans.front()->source.georeference}, std::move(figures)};
}

// ----- mesh processing

// Returns the stop criterion; exactly one must be given.
StopCriterion criterion_from(std::optional<double> max_vertical_error_m,
                             std::optional<double> max_error_m,
                             std::optional<std::size_t> triangles, std::optional<double> noise_sds,
                             bool knee, std::optional<double> border_m) {
  std::vector<StopCriterion> criteria;
  if (max_vertical_error_m)
    criteria.emplace_back(
        VerticalBound{*max_vertical_error_m, border_m.value_or(*max_vertical_error_m)});
  if (max_error_m)
    criteria.emplace_back(DistanceBound{*max_error_m, border_m.value_or(*max_error_m)});
  if (triangles) criteria.emplace_back(FaceBudget{*triangles});
  if (noise_sds) criteria.emplace_back(NoiseBound{*noise_sds});
  if (knee) criteria.emplace_back(CostKnee{});
  if (criteria.size() != 1)
    throw Error(
        "simplify: give one of max_vertical_error_m, max_error_m, triangles, noise_sds and knee as "
        "stop criterion; {} are given",
        criteria.size());
  if (border_m && !max_vertical_error_m && !max_error_m)
    throw Error("simplify: border_m requires max_error_m or max_vertical_error_m");
  return criteria.front();
}

nb::dict figures_of(const OneSidedError& error) {
  nb::dict all;
  all["at_least_m"] = error.at_least_m;
  all["at_most_m"] = error.at_most_m;
  all["mean_m"] = error.mean.value_m;
  all["rms_m"] = error.rms.value_m;
  return all;
}

MeshAndFigures simplified(const Mesh& mesh, std::optional<double> max_vertical_error_m,
                          std::optional<double> max_error_m, std::optional<std::size_t> triangles,
                          std::optional<double> noise_sds, bool knee,
                          std::optional<double> border_m, std::optional<double> crease_rad) {
  const StopCriterion criterion =
      criterion_from(max_vertical_error_m, max_error_m, triangles, noise_sds, knee, border_m);
  SimplifyOptions options;
  options.crease_rad = crease_rad.value_or(options.crease_rad);
  Simplified result = without_gil([&](const StopRequest& stop) {
    return simplify(mesh.measured, criterion, options,
                    {.progress = [&](double /*share*/) { stop.obey(); }});
  });
  nb::dict figures;
  figures["halted_by"] = word_of(result.halted_by);
  figures["from_original"] = figures_of(result.error.forth);
  figures["to_original"] = figures_of(result.error.back);
  if (result.vertical) {
    figures["vertical_largest_m"] = result.vertical->largest_m;
    figures["vertical_rms_m"] = result.vertical->rms_m;
  }
  return {Mesh{std::move(result.mesh), mesh.georeference}, std::move(figures)};
}

MeshAndFigures filled_mesh(const Mesh& mesh, double longest_m) {
  FilledMesh result = without_gil([&](const StopRequest& stop) {
    return fill_holes(mesh.measured, {.longest_m = longest_m},
                      {.progress = [&](double /*share*/) { stop.obey(); }});
  });
  nb::dict figures;
  figures["filled"] = result.filled.size();
  figures["left"] = result.left.size();
  figures["measured_vertices"] = result.measured_vertices;
  figures["measured_triangles"] = result.measured_triangles;
  return {Mesh{std::move(result.mesh), mesh.georeference}, std::move(figures)};
}

constexpr const char* reconstruct_doc =
    R"(Links each scan to a mesh and merges the meshes, in the frame D.

  scans          scans of Lidar.scan; points as reported, at the sensor's poses
  preset         criteria of links: "ground", "strict" or "object"
  incidence_rad, longest_m, noise_sds  replace those of the preset (docs/theory/reconstruction.md)
  returns        return of a pulse that is used: "last", "strongest" or "first"
  range_sd_m     standard deviation of ranges; by default that of scan and sensor
  apart_m        distance between one surface in two scans beyond noise, as errors of poses cause

Returns the mesh and counts: triangles that were redundant, seen_through, clipped, filled, bridged
and left_out, and vertices moved. The result does not depend on the number of threads.
Raises groundray.Error if nothing is surface or the noise of several scans is unknown.)";

constexpr const char* simplify_doc = R"(Simplifies a mesh by collapsing edges, cheapest first, until

  max_vertical_error_m  a vertex would be farther above or below the result (terrain)
  max_error_m           a point of either surface would be farther from the other, proven
  triangles             this number of triangles is reached
  noise_sds             an error would reach this many standard deviations of the vertices
  knee                  errors rise faster than the number of triangles falls

Give one of these; border_m is a separate bound for boundaries, and crease_rad the angle from which
edges are kept as creases. Returns the mesh and figures: halted_by ("bound", "budget", "knee",
"shape"), and the errors from_original and to_original: at_least_m and at_most_m, bounds of the
largest distance, mean_m and rms_m.)";

}  // namespace

void bind_reconstruction(nb::module_& module) {
  module.def("reconstruct_mesh", &reconstruct_mesh, "scans"_a, nb::kw_only(), "preset"_a = "ground",
             "incidence_rad"_a = nb::none(), "longest_m"_a = nb::none(), "noise_sds"_a = nb::none(),
             "returns"_a = "last", "range_sd_m"_a = nb::none(), "apart_m"_a = nb::none(),
             reconstruct_doc);
  module.def("simplify", &simplified, "mesh"_a, nb::kw_only(),
             "max_vertical_error_m"_a = nb::none(), "max_error_m"_a = nb::none(),
             "triangles"_a = nb::none(), "noise_sds"_a = nb::none(), "knee"_a = false,
             "border_m"_a = nb::none(), "crease_rad"_a = nb::none(), simplify_doc);
  module.def("fill_holes", &filled_mesh, "mesh"_a, "longest_m"_a,
             R"(Fills holes of a mesh smoothly, if their boundary is at most longest_m metres long.

Returns the mesh, with measured vertices and triangles first, and figures: the numbers of holes
filled and left, measured_vertices and measured_triangles.)");
}

}  // namespace groundray::python
