#include "apps/groundray/rebuild.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <glm/geometric.hpp>
#include <span>
#include <string_view>

#include "apps/groundray/rebuild_report.h"
#include "apps/groundray/stage.h"
#include "core/error.h"
#include "core/product_io.h"
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

// ----- output

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

void check_folder(const fs::path& path) {
  std::error_code ignored;
  const fs::path folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    throw Error("{}: there is no folder {} to write it in", path.string(), folder.string());
}

void check_mesh_name(const fs::path& path) {
  static constexpr std::array<std::string_view, 4> endings{".ply", ".obj", ".stl", ".glb"};
  if (std::ranges::find(endings, ending_of(path)) == endings.end()) {
    throw Error("{}: the name of a mesh must end in .ply, .obj, .stl or .glb", path.string());
  }
  check_folder(path);
}

// Before work that may take long.
void check_output(const RebuildOutput& output) {
  check_mesh_name(output.mesh);
  if (output.occlusion) check_mesh_name(*output.occlusion);
  if (output.report) check_folder(*output.report);
  if (output.occlusion == output.mesh || output.report == output.mesh)
    throw Error("{}: two results cannot have one name", output.mesh.string());
}

// In a .ply each vertex tells where its beam began.
void write_occlusion(const fs::path& path, const OcclusionFaces& faces,
                     const Georeference& georeference) {
  if (ending_of(path) != ".ply") return write_mesh(path, faces.shape, georeference);
  MeshColumns columns{.vertices = PointCloud(faces.origins_m.size())};
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = columns.vertices.add<double>(fmt::format("origin_{}", "xyz"[axis]));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = faces.origins_m[i][axis];
  }
  write_ply(path, faces.shape, georeference, columns);
}

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
// is a guess.
MergeLimits limits_without_noise(std::span<const ScanMesh> scans, MergeLimits limits,
                                 RebuildReport& report) {
  constexpr double share = 0.1;
  if (limits.apart_m > 0) return limits;
  limits.apart_m = share * median_edge_m(scans);
  report.notes.push_back(fmt::format(
      "no noise is known of these scans: surfaces up to {:.3g} m apart, a tenth of the median "
      "edge, are taken for one; --range-sd-m or --apart-m tell better",
      limits.apart_m));
  return limits;
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

void merge_scans(std::vector<ScanMesh> scans, const Meshing& meshing, const Finishing& finishing,
                 Making& making) {
  std::erase_if(scans, [](const ScanMesh& scan) { return scan.mesh.shape.triangles.empty(); });
  if (scans.empty()) {
    throw Error(
        "no two returns of any scan were taken for one surface: are the poses and the unit right "
        "(--unit-m)? `--preset`, `--longest-m` and `--range-sd-m` say what is surface");
  }
  if (scans.size() == 1) {
    making.mesh = std::move(scans[0].mesh);
    return;
  }
  const Timing timing(making.report, "merge");
  Stage stage("merging");
  const bool knows_noise = std::ranges::any_of(scans, [](const ScanMesh& scan) {
    return std::ranges::any_of(scan.mesh.sd_m, [](float sd_m) { return sd_m > 0; });
  });
  const MergeLimits limits =
      knows_noise ? meshing.merging : limits_without_noise(scans, meshing.merging, making.report);
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
  const Timing timing(making.report, "join");
  Stage stage("joining");
  FrontMesh joined = advance_front(all.points_m, *meshing.perimeter_m, all.origins_m,
                                   stage.work(finishing.most_bytes));
  stage.update(1);
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

// What the library says of its own words, in the program's.
std::string in_words_of_options(std::string message) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 2> words{
      {{"a DistanceBound", "--max-error-m"}, {"a NoiseBound", "--noise-halt"}}};
  for (const auto& [theirs, ours] : words) {
    const std::size_t at = message.find(theirs);
    if (at != std::string::npos) message.replace(at, theirs.size(), ours);
  }
  return message;
}

void simplify(const Finishing& finishing, Making& making) {
  if (!finishing.halt) return;
  const Timing timing(making.report, "simplify");
  Stage stage("simplifying");
  const std::size_t from = making.mesh.shape.triangles.size();
  Simplified simplified;
  try {
    simplified = groundray::simplify(making.mesh, *finishing.halt, finishing.simplify,
                                     stage.work(finishing.most_bytes));
  } catch (const Error& error) {
    throw Error("{}", in_words_of_options(error.what()));
  }
  stage.update(1);
  making.mesh = std::move(simplified.mesh);
  making.report.simplified = SimplifyTally{.from = from,
                                           .to = making.mesh.shape.triangles.size(),
                                           .halted_by = simplified.halted_by,
                                           .repairs = simplified.repairs,
                                           .error = simplified.error};
}

double area_m2(const TriangleMesh& mesh) {
  double twice_m2 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x];
    twice_m2 += glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
  }
  return twice_m2 / 2;
}

void finish(const Finishing& finishing, const RebuildOutput& output, Making& making) {
  if (finishing.sd_m && making.mesh.sd_m.empty())
    making.mesh.sd_m.assign(making.mesh.shape.vertices_m.size(),
                            static_cast<float>(*finishing.sd_m));
  fill(finishing, making);
  simplify(finishing, making);
  RebuildReport& report = making.report;
  report.facts = output.facts;
  report.vertices = making.mesh.shape.vertices_m.size();
  report.triangles = making.mesh.shape.triangles.size();
  report.area_m2 = area_m2(making.mesh.shape);
  stop_if_interrupted();
  if (output.occlusion) write_occlusion(*output.occlusion, making.occlusion, report.georeference);
  if (output.report) write_json(*output.report, report);
  write_measured_mesh(output.mesh, making.mesh, report.georeference);  // last: with it all is there
  print(report);
  fmt::print("written to {}\n", output.mesh.string());
}

}  // namespace

void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const Meshing& meshing,
                  const Finishing& finishing, const RebuildOutput& output) {
  check_output(output);
  ScanFiles files = find_scans(choice);
  Making making;
  making.report.georeference = files.georeference;
  making.report.notes = files.notes;
  if (meshing.perimeter_m) {
    join_points(files, taking, meshing, finishing, making);
  } else {
    merge_scans(link_scans(files, taking, meshing, finishing, output, making), meshing, finishing,
                making);
  }
  finish(finishing, output, making);
}

void finish_mesh(const fs::path& path, const Finishing& finishing, const RebuildOutput& output) {
  check_output(output);
  MeasuredMeshFile file = read_measured_mesh(path);
  Making making{.mesh = std::move(file.mesh), .report = {.georeference = file.georeference}};
  finish(finishing, output, making);
}

}  // namespace groundray
