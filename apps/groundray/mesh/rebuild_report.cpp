#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "apps/groundray/mesh/rebuild.h"
#include "apps/groundray/result_files.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "reconstruction/mesh/measured_mesh_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Words for HoleLeft in reports, and descriptions of HaltReason, in the order of the enumerators.
constexpr std::array<const char*, 6> hole_words{"outline",      "too_long",   "too_many_edges",
                                                "not_manifold", "no_filling", "crossing"};
constexpr std::array<const char*, 4> halt_sentences{
    "halted by the bound", "as few as asked for", "halted at the knee",
    "no further edge can go without folds or tears"};

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(of);
}

// Columns of ScanTally, with their names in files.
constexpr std::array<std::pair<const char*, std::size_t ScanTally::*>, 7> scan_columns{
    {{"rows", &ScanTally::rows},
     {"no_returns", &ScanTally::no_returns},
     {"other_returns", &ScanTally::other_returns},
     {"crowded", &ScanTally::crowded},
     {"used", &ScanTally::used},
     {"accepted_faces", &ScanTally::accepted},
     {"rejected_faces", &ScanTally::rejected}}};

ScanTally sum_of(const std::vector<ScanTally>& scans) {
  ScanTally sum{.name = fmt::format("{} scans", scans.size())};
  for (const ScanTally& scan : scans)
    for (const auto& [name, column] : scan_columns) sum.*column += scan.*column;
  return sum;
}

// Scans that were joined instead of linked have no triangles of their own.
void print_scans(const std::vector<ScanTally>& scans) {
  constexpr std::size_t most = 12;
  const auto print_row = [](const ScanTally& scan) {
    const bool is_linked = scan.accepted + scan.rejected > 0;
    print_text(stdout, "{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n", scan.name, scan.rows, scan.used,
               scan.other_returns + scan.crowded, is_linked ? fmt::to_string(scan.accepted) : "-",
               is_linked ? fmt::to_string(scan.rejected) : "-");
  };
  print_text(stdout, "{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "scan", "rows", "returns",
             "left out", "faces", "rejected");
  for (std::size_t i = 0; i < std::min(most, scans.size()); ++i) print_row(scans[i]);
  if (scans.size() > most) print_text(stdout, "... and {} more\n", scans.size() - most);
  if (scans.size() > 1) print_row(sum_of(scans));
}

std::size_t patch_triangles(const FilledMesh& holes) {
  std::size_t triangles = 0;
  for (const FilledHole& hole : holes.filled) triangles += hole.triangles;
  return triangles;
}

void print_holes(const FilledMesh& holes) {
  std::array<std::size_t, hole_words.size()> counts{};
  for (const OpenHole& hole : holes.left) ++counts[static_cast<std::size_t>(hole.why)];
  std::string left;
  for (std::size_t kind = 0; kind < counts.size(); ++kind) {
    if (counts[kind] == 0) continue;
    std::string word = hole_words[kind];
    std::ranges::replace(word, '_', ' ');
    left += fmt::format("{}{} {}", left.empty() ? ": " : ", ", counts[kind], word);
  }
  print_text(stdout, "holes: {} filled with {} triangles, {} left{}\n", holes.filled.size(),
             patch_triangles(holes), holes.left.size(), left);
}

void print_simplified(const MeshResult& result, const Simplified& simplified) {
  const TwoSidedError& error = simplified.error;
  const HausdorffDistance largest = error.largest();
  const std::size_t from = result.full_triangles, to = result.mesh.shape.triangles.size();
  print_text(stdout, "simplified: {} to {} triangles ({:.3g} %), {}\n", from, to, percent(to, from),
             halt_sentences[static_cast<std::size_t>(simplified.halted_by)]);
  const MeshRepairs& repairs = simplified.repairs;
  if (repairs.dropped_triangles + repairs.cut_edges + repairs.parted_vertices > 0) {
    print_text(stdout,
               "repaired before: {} triangles dropped, {} edges cut open, {} vertices split\n",
               repairs.dropped_triangles, repairs.cut_edges, repairs.parted_vertices);
  }
  print_text(
      stdout,
      "error, both ways: largest {:.4g} to {:.4g} m, mean {:.4g} m, root mean square {:.4g} m\n",
      largest.at_least_m, largest.at_most_m, error.mean_m(), error.rms_m());
  if (const auto& heights = simplified.vertical) {
    print_text(stdout,
               "error of heights: largest {:.4g} m, mean {:.4g} m, root mean square {:.4g} m",
               heights->largest_m, heights->mean_m, heights->rms_m);
    if (heights->aside_m > 0)
      print_text(stdout, "; the border moved inwards by up to {:.4g} m", heights->aside_m);
    print_text(stdout, "\n");
  }
}

Json json_of(const BoundedLength& length) {
  return {{"value_m", length.value_m},
          {"at_least_m", length.at_least_m},
          {"at_most_m", length.at_most_m}};
}

Json json_of(const OneSidedError& error) {
  return {{"largest", {{"at_least_m", error.at_least_m}, {"at_most_m", error.at_most_m}}},
          {"mean", json_of(error.mean)},
          {"rms", json_of(error.rms)}};
}

Json json_of(const VerticalError& error) {
  return {{"largest_m", error.largest_m},
          {"mean_m", error.mean_m},
          {"rms_m", error.rms_m},
          {"aside_m", error.aside_m}};
}

Json json_of(const ScanTally& scan) {
  Json json{{"name", scan.name}};
  for (const auto& [name, column] : scan_columns) json[name] = scan.*column;
  return json;
}

Json json_of(const MergeCounts& counts) {
  return {{"redundant", counts.redundant}, {"seen_through", counts.visibility_conflicts},
          {"clipped", counts.clipped},     {"filled", counts.filled},
          {"bridged", counts.bridged},     {"moved", counts.moved},
          {"left_out", counts.left_out}};
}

Json json_of(const FilledMesh& holes) {
  Json left = Json::array();
  for (const auto& [rim, why] : holes.left) {
    left.push_back({{"why", hole_words[static_cast<std::size_t>(why)]},
                    {"rim_m", rim.length_m},
                    {"edges", rim.vertices.size()},
                    {"middle_m", {rim.middle_m.x, rim.middle_m.y, rim.middle_m.z}}});
  }
  return {{"filled", holes.filled.size()},
          {"triangles", patch_triangles(holes)},
          {"left", std::move(left)}};
}

Json json_of(const MeshResult& result, const Simplified& simplified) {
  const HausdorffDistance hausdorff = simplified.error.largest();
  const MeshRepairs& repairs = simplified.repairs;
  return {{"from_triangles", result.full_triangles},
          {"to_triangles", result.mesh.shape.triangles.size()},
          {"halted_by", word_of(simplified.halted_by)},
          {"repairs",
           {{"dropped_triangles", repairs.dropped_triangles},
            {"unused_vertices", repairs.unused_vertices},
            {"cut_edges", repairs.cut_edges},
            {"parted_vertices", repairs.parted_vertices}}},
          {"hausdorff", {{"at_least_m", hausdorff.at_least_m}, {"at_most_m", hausdorff.at_most_m}}},
          {"to_simplified", json_of(simplified.error.forth)},
          {"to_original", json_of(simplified.error.back)},
          {"vertical", simplified.vertical ? json_of(*simplified.vertical) : Json()}};
}

void write_json(const fs::path& path, const ReportFacts& facts, const RebuildReport& report) {
  const MeshResult& result = report.result;
  Json named = Json::object(), seconds = Json::object(), scans = Json::array();
  for (const auto& [name, value] : facts) named[name] = value;
  for (const StageSeconds& stages : {report.seconds, result.seconds})
    for (const auto& [stage, spent_s] : stages) seconds[stage] = spent_s;
  for (const ScanTally& scan : report.scans) scans.push_back(json_of(scan));
  const glm::dvec3 origin_m = report.georeference.origin_w_m;
  const Json whole{{"groundray_reconstruction", 1},
                   {"facts", std::move(named)},
                   {"origin_w_m", {origin_m.x, origin_m.y, origin_m.z}},
                   {"crs", report.georeference.crs_name},
                   {"scans", std::move(scans)},
                   {"merged", result.merged_scans > 1 ? json_of(result.merged) : Json()},
                   {"holes", result.holes ? json_of(*result.holes) : Json()},
                   {"simplified", result.simplified ? json_of(result, *result.simplified) : Json()},
                   {"mesh",
                    {{"triangles", result.mesh.shape.triangles.size()},
                     {"vertices", result.mesh.shape.vertices_m.size()},
                     {"area_m2", result.area_m2}}},
                   {"seconds", std::move(seconds)},
                   {"notes", report.notes}};
  // Names of files may be invalid UTF-8.
  write_text(path, whole.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void check_mesh_name(const fs::path& path) {
  static constexpr std::array<std::string_view, 4> endings{".ply", ".obj", ".stl", ".glb"};
  if (std::ranges::find(endings, file_ending(path)) == endings.end())
    throw Error("{}: the name of a mesh must end in .ply, .obj, .stl or .glb", path.string());
}

// Writes occlusion faces; a .ply has the origin of the beam at each vertex.
void write_occlusion(const fs::path& path, const OcclusionFaces& faces,
                     const Georeference& georeference) {
  if (file_ending(path) != ".ply")
    return write_measured_mesh(path, {.shape = faces.shape}, georeference);
  MeshColumns columns{.vertices = PointCloud(faces.origins_m.size())};
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = columns.vertices.add<double>(fmt::format("origin_{}", "xyz"[axis]));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = faces.origins_m[i][axis];
  }
  write_ply(path, faces.shape, georeference, columns);
}

void print(const RebuildReport& report) {
  const MeshResult& result = report.result;
  if (!report.scans.empty()) print_scans(report.scans);
  if (result.merged_scans > 1) {
    const MergeCounts& merged = result.merged;
    print_text(
        stdout,
        "merged: {} redundant triangles and {} in visibility conflicts removed, {} clipped, {} "
        "left out; {} slits filled, {} gaps bridged, {} vertices moved\n",
        merged.redundant, merged.visibility_conflicts, merged.clipped, merged.left_out,
        merged.filled, merged.bridged, merged.moved);
  }
  if (result.holes) print_holes(*result.holes);
  if (result.simplified) print_simplified(result, *result.simplified);
  print_text(stdout, "mesh: {} triangles, {} vertices, {:.6g} m²\n",
             result.mesh.shape.triangles.size(), result.mesh.shape.vertices_m.size(),
             result.area_m2);
  for (const std::string& note : report.notes) print_text(stdout, "note: {}\n", note);
}

}  // namespace

void check_output(const MeshOutput& output, std::span<const fs::path> inputs) {
  check_mesh_name(output.mesh);
  if (output.occlusion) check_mesh_name(*output.occlusion);
  std::vector<fs::path> results{output.mesh};
  if (output.occlusion) results.push_back(*output.occlusion);
  if (output.report) results.push_back(*output.report);
  check_results(results, inputs);
}

void write_output(const MeshOutput& output, const RebuildReport& report) {
  ResultFiles files;
  if (output.occlusion) {
    files.write(*output.occlusion, [&](const fs::path& path) {
      write_occlusion(path, report.occlusion, report.georeference);
    });
  }
  if (output.report)
    files.write(*output.report,
                [&](const fs::path& path) { write_json(path, output.facts, report); });
  files.write(output.mesh, [&](const fs::path& path) {
    write_measured_mesh(path, report.result.mesh, report.georeference);
  });
  print(report);
  files.appear();
}

}  // namespace groundray
