#include "apps/groundray/mesh/rebuild.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <glm/geometric.hpp>
#include <span>
#include <string_view>

#include "apps/groundray/mesh/rebuild_report.h"
#include "apps/groundray/progress_stage.h"
#include "core/error.h"
#include "reconstruction/mesh/measured_mesh_io.h"
#include "reconstruction/mesh/scan/advancing_front.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Mesh in progress, with the results of the steps so far.
struct MeshRebuild {
  MeasuredMesh mesh;
  OcclusionFaces occlusion;
  RebuildReport report;
};

// ----- scans

ScreeningLimits limits_for(const ScanFile& scan, const Meshing& meshing) {
  ScreeningLimits limits = meshing.screening.value_or(
      scan.is_range_grid ? ScreeningLimits::object() : ScreeningLimits::ground());
  limits.incidence_rad = meshing.incidence_rad.value_or(limits.incidence_rad);
  limits.longest_m = meshing.longest_m.value_or(limits.longest_m);
  limits.noise_sds = meshing.noise_sds.value_or(limits.noise_sds);
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

double median_edge_m(std::span<const ScanMesh> scans) {
  std::vector<double> edges_m;
  for (const ScanMesh& scan : scans) {
    const TriangleMesh& mesh = scan.mesh.shape;
    for (const glm::uvec3& t : mesh.triangles)
      edges_m.push_back(glm::distance(mesh.vertices_m[t.x], mesh.vertices_m[t.y]));
  }
  if (edges_m.empty()) return 0;
  const auto middle = edges_m.begin() + static_cast<std::ptrdiff_t>(edges_m.size() / 2);
  std::ranges::nth_element(edges_m, middle);
  return *middle;
}

// Sets the distance up to which two scans show one surface if no noise is known. It is a fraction
// of the spacing, because surfaces between points are estimated; for range grids it is the spacing
// itself, because they were registered to each other no more accurately.
MergeLimits limits_without_noise(std::span<const ScanMesh> scans, const ScanFiles& files,
                                 MergeLimits limits, RebuildReport& report) {
  constexpr double share = 0.1;
  const bool are_grids = std::ranges::all_of(files.scans, &ScanFile::is_range_grid);
  limits.apart_m = (are_grids ? 1 : share) * median_edge_m(scans);
  report.notes.push_back(fmt::format(
      "the noise of these scans is unknown: surfaces up to {:.3g} m apart, {} the median edge, are "
      "treated as one; for better results set --range-sd-m or --apart-m",
      limits.apart_m, are_grids ? "as long as" : "a tenth of"));
  return limits;
}

bool knows_noise(const MeasuredMesh& mesh) {
  return std::ranges::any_of(mesh.sd_m, [](float sd_m) { return sd_m > 0; });
}

bool knows_noise(std::span<const ScanMesh> scans) {
  return std::ranges::any_of(scans, [](const ScanMesh& scan) { return knows_noise(scan.mesh); });
}

// Adds a note if noise is known for some scans only: the merge assumes the same for the others.
void note_unknown_noise(std::span<const ScanMesh> scans, RebuildReport& report) {
  const auto known =
      std::ranges::count_if(scans, [](const ScanMesh& scan) { return knows_noise(scan.mesh); });
  if (known == 0 || known == std::ssize(scans)) return;
  report.notes.push_back(
      fmt::format("the noise of {} of the {} scans is unknown: that of the others is assumed; for "
                  "better results set --range-sd-m",
                  std::ssize(scans) - known, scans.size()));
}

bool is_noise_halt(const Finishing& finishing) {
  return finishing.stop && std::holds_alternative<NoiseBound>(*finishing.stop);
}

void check_halt_without_noise(const Finishing& finishing) {
  if (!is_noise_halt(finishing)) return;
  throw Error(
      "--noise-halt: the noise of these scans is unknown, neither from a column range_sd nor from "
      "the sensor's calibration: give the standard deviation of ranges by --range-sd-m");
}

[[noreturn]] void fail_without_surface(const RebuildReport& report) {
  const bool has_points =
      std::ranges::any_of(report.scans, [](const ScanTally& scan) { return scan.used > 0; });
  if (!has_points) throw Error("no scan has a return: all rows are missing or not finite");
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
                                 const Meshing& meshing, const Finishing& finishing,
                                 const RebuildOutput& output, MeshRebuild& rebuild) {
  const StageTimer timer(rebuild.report.seconds, "link");
  Progress progress(stderr, "scans", files.scans.size());
  std::vector<ScanMesh> meshes;
  std::size_t bytes = 0;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const OrganisedInput input = read_organised(files, file, taking);
    add_notes(input.notes, rebuild.report);
    ScanMesh mesh = link(input.cells, limits_for(file, meshing));
    rebuild.report.scans.push_back(
        {.name = file.name,
         .rows = input.rows,
         .no_returns = input.rows - input.returns + input.counts.no_returns,
         .other_returns = input.counts.other_returns,
         .crowded = input.counts.crowded,
         .used = input.returns - input.counts.no_returns - input.counts.other_returns -
                 input.counts.crowded,
         .accepted = mesh.mesh.shape.triangles.size(),
         .rejected = mesh.occlusion.shape.triangles.size()});
    if (output.occlusion) append(rebuild.occlusion, mesh.occlusion);
    mesh.occlusion = {};
    bytes += bytes_of(mesh);
    if (bytes > finishing.most_bytes) {
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

void merge_scans(std::vector<ScanMesh> scans, const ScanFiles& files, const Meshing& meshing,
                 const Finishing& finishing, MeshRebuild& rebuild) {
  std::erase_if(scans, [](const ScanMesh& scan) { return scan.mesh.shape.triangles.empty(); });
  if (scans.empty()) fail_without_surface(rebuild.report);
  const bool has_noise = knows_noise(scans);
  if (!has_noise) check_halt_without_noise(finishing);
  note_unknown_noise(scans, rebuild.report);
  if (scans.size() == 1) {
    rebuild.mesh = merge(scans, meshing.merging).mesh;
    return;
  }
  const StageTimer timer(rebuild.report.seconds, "merge");
  Stage stage("merging");
  MergeLimits limits = meshing.merging;
  if (meshing.apart_m) {
    limits.apart_m = *meshing.apart_m;
  } else if (!has_noise) {
    limits = limits_without_noise(scans, files, limits, rebuild.report);
  }
  MergedMesh merged = merge(scans, limits, stage.work(finishing.most_bytes));
  stage.update(1);
  rebuild.mesh = std::move(merged.mesh);
  rebuild.report.merged = merged.counts;
}

// ----- points without order

void join_points(const ScanFiles& files, const ScanTaking& taking, const Meshing& meshing,
                 const Finishing& finishing, MeshRebuild& rebuild) {
  PointInput all;
  bool has_labels = true;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const PointInput scan = read_points(files, file, taking);
    add_notes(scan.notes, rebuild.report);
    const auto add = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    add(all.points_m, scan.points_m);
    add(all.origins_m, scan.origins_m);
    add(all.sd_m, scan.sd_m);
    add(all.labels, scan.labels);
    has_labels = has_labels && scan.labels.size() == scan.points_m.size();
    rebuild.report.scans.push_back({.name = file.name,
                                    .rows = scan.rows,
                                    .no_returns = scan.rows - scan.points_m.size(),
                                    .used = scan.points_m.size()});
  }
  if (!has_labels) all.labels.clear();
  if (std::ranges::none_of(all.sd_m, [](float sd_m) { return sd_m > 0; }))
    check_halt_without_noise(finishing);
  const StageTimer timer(rebuild.report.seconds, "join");
  Stage stage("joining");
  FrontMesh joined = advance_front(all.points_m, *meshing.perimeter_m, all.origins_m,
                                   stage.work(finishing.most_bytes));
  stage.update(1);
  if (joined.mesh.triangles.empty()) {
    throw Error(
        "no three of the {} points form a triangle whose perimeter is within {} m: are the unit "
        "(--unit-m) and --perimeter-m right?",
        all.points_m.size(), *meshing.perimeter_m);
  }
  for (const std::uint32_t source : joined.sources) {
    rebuild.mesh.sd_m.push_back(all.sd_m[source]);
    if (has_labels) rebuild.mesh.labels.push_back(all.labels[source]);
  }
  rebuild.mesh.shape = std::move(joined.mesh);
}

// ----- finishing

void fill(const Finishing& finishing, MeshRebuild& rebuild) {
  if (!finishing.fill_m) return;
  const StageTimer timer(rebuild.report.seconds, "fill");
  Stage stage("filling");
  FilledMesh filled = fill_holes(std::move(rebuild.mesh), {.longest_m = *finishing.fill_m},
                                 stage.work(finishing.most_bytes));
  stage.update(1);
  rebuild.mesh = std::move(filled.mesh);
  HoleTally tally{.filled = filled.filled.size(), .left = std::move(filled.left)};
  for (const FilledHole& hole : filled.filled) tally.triangles += hole.triangles;
  rebuild.report.holes = std::move(tally);
}

void simplify(const Finishing& finishing, MeshRebuild& rebuild) {
  if (!finishing.stop) return;
  const StageTimer timer(rebuild.report.seconds, "simplify");
  Stage stage("simplifying");
  const std::size_t from = rebuild.mesh.shape.triangles.size();
  Simplified simplified = groundray::simplify(rebuild.mesh, *finishing.stop, finishing.simplify,
                                              stage.work(finishing.most_bytes));
  stage.update(1);
  rebuild.mesh = std::move(simplified.mesh);
  rebuild.report.simplified = SimplifyTally{.from = from,
                                            .to = rebuild.mesh.shape.triangles.size(),
                                            .halted_by = simplified.halted_by,
                                            .repairs = simplified.repairs,
                                            .error = simplified.error,
                                            .vertical = simplified.vertical};
}

double area_m2(const TriangleMesh& mesh) {
  double twice_m2 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x];
    twice_m2 += glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
  }
  return twice_m2 / 2;
}

void take_noise(const Finishing& finishing, MeasuredMesh& mesh) {
  if (finishing.sd_m)
    mesh.sd_m.assign(mesh.shape.vertices_m.size(), static_cast<float>(*finishing.sd_m));
  if (is_noise_halt(finishing) && !mesh.sd_m.empty() && !knows_noise(mesh)) {
    throw Error(
        "--noise-halt: the standard deviation (sd_m) of each vertex is 0: give another by --sd-m");
  }
}

void finish(const Finishing& finishing, const RebuildOutput& output, MeshRebuild& rebuild) {
  fill(finishing, rebuild);
  simplify(finishing, rebuild);
  RebuildReport& report = rebuild.report;
  report.facts = output.facts;
  report.vertices = rebuild.mesh.shape.vertices_m.size();
  report.triangles = rebuild.mesh.shape.triangles.size();
  report.area_m2 = area_m2(rebuild.mesh.shape);
  stop_if_interrupted();
  write_output(output, rebuild.mesh, rebuild.occlusion, report);
  print(report);
  fmt::print("written to {}\n", output.mesh.string());
}

// Adds a note about contents of the file that are not valid triangles.
void note_left_out(const MeasuredMeshFile& file, RebuildReport& report) {
  if (file.dropped + file.skipped == 0) return;
  report.notes.push_back(
      fmt::format("ignored in the file: polygons and triangles that are invalid or have no area: "
                  "{}; points, lines and curved patches: {}",
                  file.dropped, file.skipped));
}

}  // namespace

void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const Meshing& meshing,
                  const Finishing& finishing, const RebuildOutput& output) {
  const ScanFiles files = find_scans(choice);
  check_output(output, files.read);
  MeshRebuild rebuild;
  rebuild.report.georeference = files.georeference;
  rebuild.report.notes = files.notes;
  if (!files.are_posed)
    rebuild.report.notes.emplace_back("without poses the mesh is in the sensor's frame");
  if (meshing.perimeter_m) {
    join_points(files, taking, meshing, finishing, rebuild);
  } else {
    merge_scans(link_scans(files, taking, meshing, finishing, output, rebuild), files, meshing,
                finishing, rebuild);
  }
  finish(finishing, output, rebuild);
}

void finish_mesh(const fs::path& path, const Finishing& finishing, const RebuildOutput& output) {
  check_output(output, {&path, 1});
  MeasuredMeshFile file = read_measured_mesh(path);
  MeshRebuild rebuild{.mesh = std::move(file.mesh), .report = {.georeference = file.georeference}};
  note_left_out(file, rebuild.report);
  take_noise(finishing, rebuild.mesh);
  finish(finishing, output, rebuild);
}

}  // namespace groundray
