#include "apps/groundray/mesh/rebuild.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/groundray/progress_stage.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/print_error.h"
#include "core/progress.h"
#include "reconstruction/mesh/measured_mesh_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// ----- scans

ScreeningLimits limits_for(const ScanFile& scan, const MeshRequest& request) {
  ScreeningLimits limits = request.screening.value_or(
      scan.is_range_grid ? ScreeningLimits::object() : ScreeningLimits::ground());
  limits.incidence_rad = request.incidence_rad.value_or(limits.incidence_rad);
  limits.longest_m = request.longest_m.value_or(limits.longest_m);
  limits.noise_sds = request.noise_sds.value_or(limits.noise_sds);
  return limits;
}

void append(OcclusionFaces& all, const OcclusionFaces& more) {
  const auto first = static_cast<unsigned>(all.shape.vertices_m.size());
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  add(all.shape.vertices_m, more.shape.vertices_m);
  add(all.origins_m, more.origins_m);
  for (const glm::uvec3& triangle : more.shape.triangles)
    all.shape.triangles.push_back(triangle + first);
}

std::size_t bytes_of(const ScanMesh& scan) {
  constexpr std::size_t of_vertex = 2 * sizeof(glm::dvec3) + 16, of_triangle = 16;
  return scan.mesh.shape.vertices_m.size() * of_vertex +
         scan.mesh.shape.triangles.size() * of_triangle;
}

// Adds a note if noise is known for some scans only: the merge assumes the same for the others.
void note_unknown_noise(std::span<const ScanMesh> scans, RebuildReport& report) {
  const auto known = std::ranges::count_if(scans, knows_noise, &ScanMesh::mesh);
  if (known == 0 || known == std::ssize(scans)) return;
  report.notes.push_back(
      fmt::format("the noise of {} of the {} scans is unknown: that of the others is assumed; for "
                  "better results set --range-sd-m",
                  std::ssize(scans) - known, scans.size()));
}

bool is_noise_halt(const MeshRequest& request) {
  return request.steps.stop && std::holds_alternative<NoiseBound>(*request.steps.stop);
}

void check_halt_without_noise(const MeshRequest& request) {
  if (!is_noise_halt(request)) return;
  throw Error(
      "--noise-halt: the noise of these scans is unknown, neither from a column range_sd nor from "
      "the sensor's calibration: give the standard deviation of ranges by --range-sd-m");
}

[[noreturn]] void fail_without_surface(const RebuildReport& report) {
  const bool has_points =
      std::ranges::any_of(report.scans, [](const ScanTally& scan) { return scan.used > 0; });
  if (!has_points && report.scans.empty()) throw Error("there are no scans");
  if (!has_points) {
    throw Error("{}: no scan has a return: all rows are missing or not finite",
                first_and_count(report.scans.front().name, report.scans.size()));
  }
  throw Error(
      "no two returns of any scan were linked as surface: are the poses and the unit right "
      "(--unit-m)? `--preset`, `--longest-m` and `--range-sd-m` define what is surface; unordered "
      "points need --unorganised, and possibly --perimeter-m");
}

// Adds each distinct note once.
void add_notes(const std::vector<std::string>& notes, RebuildReport& report) {
  for (const std::string& note : notes) {
    if (std::ranges::find(report.notes, note) == report.notes.end()) report.notes.push_back(note);
  }
}

// Links the scans one by one; keeps occlusion faces only if requested.
std::vector<ScanMesh> link_scans(const ScanFiles& files, const ScanTaking& taking,
                                 const MeshRequest& request, RebuildReport& report) {
  const StageTimer timer(report.seconds, "link");
  Progress progress(stderr, "scans", files.scans.size());
  std::vector<ScanMesh> meshes;
  std::size_t bytes = 0;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const OrganisedInput input = read_organised(files, file, taking);
    add_notes(input.notes, report);
    ScanMesh mesh = link(input.cells, limits_for(file, request));
    report.scans.push_back({.name = file.name,
                            .rows = input.rows,
                            .no_returns = input.rows - input.returns + input.counts.no_returns,
                            .other_returns = input.counts.other_returns,
                            .crowded = input.counts.crowded,
                            .used = input.returns - input.counts.no_returns -
                                    input.counts.other_returns - input.counts.crowded,
                            .accepted = mesh.mesh.shape.triangles.size(),
                            .rejected = mesh.occlusion.shape.triangles.size()});
    if (request.output.occlusion) append(report.occlusion, mesh.occlusion);
    mesh.occlusion = {};
    bytes += bytes_of(mesh);
    if (bytes > request.most_bytes) {
      throw Error(
          "{}: with this scan the meshes need {} MB, more than --memory-mb allows; use fewer scans "
          "(--frames)",
          file.file.string(), bytes / 1'000'000);
    }
    meshes.push_back(std::move(mesh));
    progress.update(meshes.size());
  }
  return meshes;
}

// Merges the scans and completes the mesh. Surfaces of range grids are merged up to the spacing
// itself if their noise is unknown, because they were registered to each other no more accurately.
void merge_scans(std::vector<ScanMesh> scans, const ScanFiles& files, const MeshRequest& request,
                 const PipelineControl& control, RebuildReport& report) {
  std::erase_if(scans, [](const ScanMesh& scan) { return scan.mesh.shape.triangles.empty(); });
  if (scans.empty()) fail_without_surface(report);
  if (std::ranges::none_of(scans, knows_noise, &ScanMesh::mesh)) check_halt_without_noise(request);
  note_unknown_noise(scans, report);
  MeshBuildOptions steps = request.steps;
  const bool are_grids = std::ranges::all_of(files.scans, &ScanFile::is_range_grid);
  if (are_grids) steps.spacing_share = 1;
  report.result = build_mesh(std::move(scans), steps, control);
  if (const auto& spacing_m = report.result.spacing_m) {
    report.notes.push_back(fmt::format(
        "the noise of these scans is unknown: surfaces up to {:.3g} m apart, {} the median edge, "
        "are treated as one; for better results set --range-sd-m or --apart-m",
        *spacing_m, are_grids ? "as long as" : "a tenth of"));
  }
}

// ----- points without order

UnorderedPoints read_all(const ScanFiles& files, const ScanTaking& taking, RebuildReport& report) {
  UnorderedPoints all;
  bool has_labels = true;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const PointInput scan = read_points(files, file, taking);
    add_notes(scan.notes, report);
    const auto add = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    add(all.points_m, scan.points_m);
    add(all.origins_m, scan.origins_m);
    add(all.sd_m, scan.sd_m);
    add(all.labels, scan.labels);
    has_labels = has_labels && scan.labels.size() == scan.points_m.size();
    report.scans.push_back({.name = file.name,
                            .rows = scan.rows,
                            .no_returns = scan.rows - scan.points_m.size(),
                            .used = scan.points_m.size()});
  }
  if (!has_labels) all.labels.clear();
  return all;
}

void join_points(const UnorderedPoints& points, const MeshRequest& request,
                 const PipelineControl& control, RebuildReport& report) {
  if (std::ranges::none_of(points.sd_m, [](float sd_m) { return sd_m > 0; }))
    check_halt_without_noise(request);
  report.result = build_mesh(points, *request.perimeter_m, request.steps, control);
  if (!report.result.mesh.shape.triangles.empty()) return;
  throw Error(
      "no three of the {} points form a triangle whose perimeter is within {} m: are the unit "
      "(--unit-m) and --perimeter-m right?",
      points.points_m.size(), *request.perimeter_m);
}

// ----- meshes

void take_noise(const MeshRequest& request, MeasuredMesh& mesh) {
  if (request.sd_m)
    mesh.sd_m.assign(mesh.shape.vertices_m.size(), static_cast<float>(*request.sd_m));
  if (is_noise_halt(request) && !mesh.sd_m.empty() && !knows_noise(mesh)) {
    throw Error(
        "--noise-halt: the standard deviation (sd_m) of each vertex is 0: give another by --sd-m");
  }
}

// Adds a note about contents of the file that are not valid triangles.
void note_left_out(const MeasuredMeshFile& file, RebuildReport& report) {
  if (file.dropped + file.skipped == 0) return;
  report.notes.push_back(
      fmt::format("ignored in the file: polygons and triangles that are invalid or have no area: "
                  "{}; points, lines and curved patches: {}",
                  file.dropped, file.skipped));
}

void write(const MeshOutput& output, const RebuildReport& report) {
  stop_if_interrupted();
  write_output(output, report);
}

}  // namespace

void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const MeshRequest& request) {
  const ScanFiles files = find_scans(choice);
  check_output(request.output, files.read);
  RebuildReport report{.georeference = files.georeference, .notes = files.notes};
  if (!files.are_posed)
    report.notes.emplace_back("without poses the mesh is in the sensor's frame");
  StageProgress progress;
  const PipelineControl control = progress.control(request.most_bytes);
  if (request.perimeter_m)
    join_points(read_all(files, taking, report), request, control, report);
  else
    merge_scans(link_scans(files, taking, request, report), files, request, control, report);
  write(request.output, report);
}

void rework_mesh(const fs::path& path, const MeshRequest& request) {
  check_output(request.output, {&path, 1});
  MeasuredMeshFile file = read_measured_mesh(path);
  RebuildReport report{.georeference = file.georeference};
  note_left_out(file, report);
  take_noise(request, file.mesh);
  StageProgress progress;
  report.result =
      finish_mesh(std::move(file.mesh), request.steps, progress.control(request.most_bytes));
  write(request.output, report);
}

}  // namespace groundray
