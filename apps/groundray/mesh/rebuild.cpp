#include "apps/groundray/mesh/rebuild.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <glm/geometric.hpp>
#include <span>
#include <string_view>

#include "apps/groundray/mesh/rebuild_report.h"
#include "apps/groundray/stage.h"
#include "core/error.h"
#include "reconstruction/measured_mesh_io.h"
#include "reconstruction/scan/advancing_front.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A mesh on its way, and what has been done to it.
struct Making {
  MeasuredMesh mesh;
  OcclusionFaces occlusion;
  RebuildReport report;
};

// Times a part of the work for the report.
class Timing {
 public:
  Timing(RebuildReport& report, std::string stage) : report_(report), stage_(std::move(stage)) {}
  ~Timing() {
    const std::chrono::duration<double> spent = Clock::now() - begin_;
    report_.seconds.emplace_back(std::move(stage_), spent.count());
  }
  Timing(const Timing&) = delete;
  Timing& operator=(const Timing&) = delete;

 private:
  RebuildReport& report_;
  std::string stage_;
  Clock::time_point begin_ = Clock::now();
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

// How far apart one surface may be in two scans of which no noise is known: between points either
// is a guess, and range scans were registered to each other, to no better than their spacing.
MergeLimits limits_without_noise(std::span<const ScanMesh> scans, const ScanFiles& files,
                                 MergeLimits limits, RebuildReport& report) {
  constexpr double share = 0.1;
  const bool are_grids = std::ranges::all_of(files.scans, &ScanFile::is_range_grid);
  limits.apart_m = (are_grids ? 1 : share) * median_edge_m(scans);
  report.notes.push_back(fmt::format(
      "no noise is known of these scans: surfaces up to {:.3g} m apart, {} the median edge, are "
      "taken for one; --range-sd-m or --apart-m tell better",
      limits.apart_m, are_grids ? "as long as" : "a tenth of"));
  return limits;
}

bool knows_noise(const MeasuredMesh& mesh) {
  return std::ranges::any_of(mesh.sd_m, [](float sd_m) { return sd_m > 0; });
}

bool knows_noise(std::span<const ScanMesh> scans) {
  return std::ranges::any_of(scans, [](const ScanMesh& scan) { return knows_noise(scan.mesh); });
}

// Some know theirs: the merge takes the others to be as noisy.
void note_unknown_noise(std::span<const ScanMesh> scans, RebuildReport& report) {
  const auto known =
      std::ranges::count_if(scans, [](const ScanMesh& scan) { return knows_noise(scan.mesh); });
  if (known == 0 || known == std::ssize(scans)) return;
  report.notes.push_back(fmt::format(
      "no noise is known of {} of the {} scans: they are taken to be as noisy as the others; "
      "--range-sd-m tells better",
      std::ssize(scans) - known, scans.size()));
}

bool is_noise_halt(const Finishing& finishing) {
  return finishing.halt && std::holds_alternative<NoiseBound>(*finishing.halt);
}

void check_halt_without_noise(const Finishing& finishing) {
  if (!is_noise_halt(finishing)) return;
  throw Error(
      "--noise-halt: no noise is known of these scans, neither from a column range_sd nor from the "
      "sensor's calibration: give the standard deviation of ranges by --range-sd-m");
}

[[noreturn]] void fail_without_surface(const RebuildReport& report) {
  const bool has_points =
      std::ranges::any_of(report.scans, [](const ScanTally& scan) { return scan.used > 0; });
  if (!has_points) throw Error("no scan has a return: all rows are missing or no numbers");
  throw Error(
      "no two returns of any scan were taken for one surface: are the poses and the unit right "
      "(--unit-m)? `--preset`, `--longest-m` and `--range-sd-m` say what is surface; points that "
      "are in no order need --unorganised, and maybe --perimeter-m");
}

// Each sentence once, however many scans it is true of.
void add_notes(const std::vector<std::string>& notes, RebuildReport& report) {
  for (const std::string& note : notes) {
    if (std::ranges::find(report.notes, note) == report.notes.end()) report.notes.push_back(note);
  }
}

// Links one scan after another; occlusion faces are kept where they are asked for.
std::vector<ScanMesh> link_scans(const ScanFiles& files, const ScanTaking& taking,
                                 const Meshing& meshing, const Finishing& finishing,
                                 const RebuildOutput& output, Making& making) {
  const Timing timing(making.report, "link");
  Progress progress(stderr, "scans", files.scans.size());
  std::vector<ScanMesh> meshes;
  std::size_t bytes = 0;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const OrganisedInput input = read_organised(files, file, taking);
    add_notes(input.notes, making.report);
    ScanMesh mesh = link(input.cells, limits_for(file, meshing));
    making.report.scans.push_back(
        {.name = file.name,
         .rows = input.rows,
         .no_returns = input.rows - input.returns + input.counts.no_returns,
         .other_returns = input.counts.other_returns,
         .crowded = input.counts.crowded,
         .used = input.returns - input.counts.no_returns - input.counts.other_returns -
                 input.counts.crowded,
         .accepted = mesh.mesh.shape.triangles.size(),
         .rejected = mesh.occlusion.shape.triangles.size()});
    if (output.occlusion) append(making.occlusion, mesh.occlusion);
    mesh.occlusion = {};
    bytes += bytes_of(mesh);
    if (bytes > finishing.most_bytes) {
      throw Error(
          "{}: with this scan the meshes take {} MB, more than --memory-mb allows; take fewer "
          "scans (--frames)",
          file.file.string(), bytes / 1'000'000);
    }
    meshes.push_back(std::move(mesh));
    progress.update(meshes.size());
  }
  return meshes;
}

void merge_scans(std::vector<ScanMesh> scans, const ScanFiles& files, const Meshing& meshing,
                 const Finishing& finishing, Making& making) {
  std::erase_if(scans, [](const ScanMesh& scan) { return scan.mesh.shape.triangles.empty(); });
  if (scans.empty()) fail_without_surface(making.report);
  const bool has_noise = knows_noise(scans);
  if (!has_noise) check_halt_without_noise(finishing);
  note_unknown_noise(scans, making.report);
  if (scans.size() == 1) {
    making.mesh = merge(scans, meshing.merging).mesh;
    return;
  }
  const Timing timing(making.report, "merge");
  Stage stage("merging");
  MergeLimits limits = meshing.merging;
  if (meshing.apart_m) {
    limits.apart_m = *meshing.apart_m;
  } else if (!has_noise) {
    limits = limits_without_noise(scans, files, limits, making.report);
  }
  MergedMesh merged = merge(scans, limits, stage.work(finishing.most_bytes));
  stage.update(1);
  making.mesh = std::move(merged.mesh);
  making.report.merged = merged.counts;
}

// ----- points without order

void join_points(const ScanFiles& files, const ScanTaking& taking, const Meshing& meshing,
                 const Finishing& finishing, Making& making) {
  PointInput all;
  bool has_labels = true;
  for (const ScanFile& file : files.scans) {
    stop_if_interrupted();
    const PointInput scan = read_points(files, file, taking);
    add_notes(scan.notes, making.report);
    const auto add = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    add(all.points_m, scan.points_m);
    add(all.origins_m, scan.origins_m);
    add(all.sd_m, scan.sd_m);
    add(all.labels, scan.labels);
    has_labels = has_labels && scan.labels.size() == scan.points_m.size();
    making.report.scans.push_back({.name = file.name,
                                   .rows = scan.rows,
                                   .no_returns = scan.rows - scan.points_m.size(),
                                   .used = scan.points_m.size()});
  }
  if (!has_labels) all.labels.clear();
  if (std::ranges::none_of(all.sd_m, [](float sd_m) { return sd_m > 0; }))
    check_halt_without_noise(finishing);
  const Timing timing(making.report, "join");
  Stage stage("joining");
  FrontMesh joined = advance_front(all.points_m, *meshing.perimeter_m, all.origins_m,
                                   stage.work(finishing.most_bytes));
  stage.update(1);
  if (joined.mesh.triangles.empty()) {
    throw Error(
        "no three of the {} points make a triangle whose perimeter is within {} m: are the unit "
        "(--unit-m) and --perimeter-m right?",
        all.points_m.size(), *meshing.perimeter_m);
  }
  for (const std::uint32_t source : joined.sources) {
    making.mesh.sd_m.push_back(all.sd_m[source]);
    if (has_labels) making.mesh.labels.push_back(all.labels[source]);
  }
  making.mesh.shape = std::move(joined.mesh);
}

// ----- finishing

void fill(const Finishing& finishing, Making& making) {
  if (!finishing.fill_m) return;
  const Timing timing(making.report, "fill");
  Stage stage("filling");
  FilledMesh filled = fill_holes(std::move(making.mesh), {.longest_m = *finishing.fill_m},
                                 stage.work(finishing.most_bytes));
  stage.update(1);
  making.mesh = std::move(filled.mesh);
  HoleTally tally{.filled = filled.filled.size(), .left = std::move(filled.left)};
  for (const FilledHole& hole : filled.filled) tally.triangles += hole.triangles;
  making.report.holes = std::move(tally);
}

void simplify(const Finishing& finishing, Making& making) {
  if (!finishing.halt) return;
  const Timing timing(making.report, "simplify");
  Stage stage("simplifying");
  const std::size_t from = making.mesh.shape.triangles.size();
  Simplified simplified = groundray::simplify(making.mesh, *finishing.halt, finishing.simplify,
                                              stage.work(finishing.most_bytes));
  stage.update(1);
  making.mesh = std::move(simplified.mesh);
  making.report.simplified = SimplifyTally{.from = from,
                                           .to = making.mesh.shape.triangles.size(),
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

void finish(const Finishing& finishing, const RebuildOutput& output, Making& making) {
  fill(finishing, making);
  simplify(finishing, making);
  RebuildReport& report = making.report;
  report.facts = output.facts;
  report.vertices = making.mesh.shape.vertices_m.size();
  report.triangles = making.mesh.shape.triangles.size();
  report.area_m2 = area_m2(making.mesh.shape);
  stop_if_interrupted();
  write_output(output, making.mesh, making.occlusion, report);
  print(report);
  fmt::print("written to {}\n", output.mesh.string());
}

// What its file holds besides triangles is told.
void note_left_out(const MeasuredMeshFile& file, RebuildReport& report) {
  if (file.dropped + file.skipped == 0) return;
  report.notes.push_back(fmt::format(
      "left out of the file: polygons and triangles that are broken or have no area: {}; points, "
      "lines and curved patches: {}",
      file.dropped, file.skipped));
}

}  // namespace

void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const Meshing& meshing,
                  const Finishing& finishing, const RebuildOutput& output) {
  const ScanFiles files = find_scans(choice);
  check_output(output, files.read);
  Making making;
  making.report.georeference = files.georeference;
  making.report.notes = files.notes;
  if (!files.are_posed)
    making.report.notes.emplace_back("without poses the mesh is in the sensor's frame");
  if (meshing.perimeter_m) {
    join_points(files, taking, meshing, finishing, making);
  } else {
    merge_scans(link_scans(files, taking, meshing, finishing, output, making), files, meshing,
                finishing, making);
  }
  finish(finishing, output, making);
}

void finish_mesh(const fs::path& path, const Finishing& finishing, const RebuildOutput& output) {
  check_output(output, {&path, 1});
  MeasuredMeshFile file = read_measured_mesh(path);
  Making making{.mesh = std::move(file.mesh), .report = {.georeference = file.georeference}};
  note_left_out(file, making.report);
  take_noise(finishing, making.mesh);
  finish(finishing, output, making);
}

}  // namespace groundray
