#include "apps/groundray/mesh/rebuild_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/io/file_io.h"

namespace groundray {
namespace {

using Json = nlohmann::ordered_json;

const char* word_of(HoleLeft why) {
  switch (why) {
    case HoleLeft::Outline:
      return "outline";
    case HoleLeft::TooLong:
      return "too_long";
    case HoleLeft::TooManyEdges:
      return "too_many_edges";
    case HoleLeft::NotManifold:
      return "not_manifold";
    case HoleLeft::NoFilling:
      return "no_filling";
    case HoleLeft::Crossing:
      break;
  }
  return "crossing";
}

const char* sentence_of(HaltReason reason) {
  switch (reason) {
    case HaltReason::Bound:
      return "halted by the bound";
    case HaltReason::Budget:
      return "as few as asked for";
    case HaltReason::Knee:
      return "halted at the knee";
    case HaltReason::Shape:
      break;
  }
  return "no further edge can go without folds or tears";
}

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(of);
}

ScanTally sum_of(const std::vector<ScanTally>& scans) {
  ScanTally sum{.name = fmt::format("{} scans", scans.size())};
  for (const ScanTally& scan : scans) {
    for (std::size_t ScanTally::*count :
         {&ScanTally::rows, &ScanTally::no_returns, &ScanTally::other_returns, &ScanTally::crowded,
          &ScanTally::used, &ScanTally::accepted, &ScanTally::rejected})
      sum.*count += scan.*count;
  }
  return sum;
}

// Scans that were joined instead of linked have no triangles of their own.
void print_scans(const std::vector<ScanTally>& scans) {
  constexpr std::size_t most = 12;
  const auto print_row = [](const ScanTally& scan) {
    const bool is_linked = scan.accepted + scan.rejected > 0;
    fmt::print("{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n", scan.name, scan.rows, scan.used,
               scan.other_returns + scan.crowded, is_linked ? fmt::to_string(scan.accepted) : "-",
               is_linked ? fmt::to_string(scan.rejected) : "-");
  };
  fmt::print("{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "scan", "rows", "returns", "left out",
             "faces", "rejected");
  for (std::size_t i = 0; i < std::min(most, scans.size()); ++i) print_row(scans[i]);
  if (scans.size() > most) fmt::print("... and {} more\n", scans.size() - most);
  if (scans.size() > 1) print_row(sum_of(scans));
}

void print_holes(const HoleTally& holes) {
  constexpr std::size_t kinds = 6;
  std::array<std::size_t, kinds> counts{};
  for (const OpenHole& hole : holes.left) ++counts[static_cast<std::size_t>(hole.why)];
  std::string left;
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    if (counts[kind] == 0) continue;
    std::string word = word_of(static_cast<HoleLeft>(kind));
    std::ranges::replace(word, '_', ' ');
    left += fmt::format("{}{} {}", left.empty() ? ": " : ", ", counts[kind], word);
  }
  fmt::print("holes: {} filled with {} triangles, {} left{}\n", holes.filled, holes.triangles,
             holes.left.size(), left);
}

void print_simplified(const SimplifyTally& tally) {
  const TwoSidedError& error = tally.error;
  const HausdorffDistance largest = error.largest();
  fmt::print("simplified: {} to {} triangles ({:.3g} %), {}\n", tally.from, tally.to,
             percent(tally.to, tally.from), sentence_of(tally.halted_by));
  const MeshRepairs& repairs = tally.repairs;
  if (repairs.dropped_triangles + repairs.cut_edges + repairs.parted_vertices > 0) {
    fmt::print("repaired before: {} triangles dropped, {} edges cut open, {} vertices split\n",
               repairs.dropped_triangles, repairs.cut_edges, repairs.parted_vertices);
  }
  fmt::print(
      "error, both ways: largest {:.4g} to {:.4g} m, mean {:.4g} m, root mean square {:.4g} m\n",
      largest.at_least_m, largest.at_most_m, error.mean_m(), error.rms_m());
  if (const auto& heights = tally.vertical) {
    fmt::print("error of heights: largest {:.4g} m, mean {:.4g} m, root mean square {:.4g} m",
               heights->largest_m, heights->mean_m, heights->rms_m);
    if (heights->aside_m > 0)
      fmt::print("; the border moved inwards by up to {:.4g} m", heights->aside_m);
    fmt::print("\n");
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
  return {{"name", scan.name},
          {"rows", scan.rows},
          {"no_returns", scan.no_returns},
          {"other_returns", scan.other_returns},
          {"crowded", scan.crowded},
          {"used", scan.used},
          {"accepted_faces", scan.accepted},
          {"rejected_faces", scan.rejected}};
}

Json json_of(const MergeCounts& counts) {
  return {{"redundant", counts.redundant}, {"seen_through", counts.visibility_conflicts},
          {"clipped", counts.clipped},     {"filled", counts.filled},
          {"bridged", counts.bridged},     {"moved", counts.moved},
          {"left_out", counts.left_out}};
}

Json json_of(const HoleTally& holes) {
  Json left = Json::array();
  for (const auto& [rim, why] : holes.left) {
    left.push_back({{"why", word_of(why)},
                    {"rim_m", rim.length_m},
                    {"edges", rim.vertices.size()},
                    {"middle_m", {rim.middle_m.x, rim.middle_m.y, rim.middle_m.z}}});
  }
  return {{"filled", holes.filled}, {"triangles", holes.triangles}, {"left", std::move(left)}};
}

Json json_of(const SimplifyTally& tally) {
  const HausdorffDistance hausdorff = tally.error.largest();
  return {{"from_triangles", tally.from},
          {"to_triangles", tally.to},
          {"halted_by", word_of(tally.halted_by)},
          {"repairs",
           {{"dropped_triangles", tally.repairs.dropped_triangles},
            {"unused_vertices", tally.repairs.unused_vertices},
            {"cut_edges", tally.repairs.cut_edges},
            {"parted_vertices", tally.repairs.parted_vertices}}},
          {"hausdorff", {{"at_least_m", hausdorff.at_least_m}, {"at_most_m", hausdorff.at_most_m}}},
          {"to_simplified", json_of(tally.error.forth)},
          {"to_original", json_of(tally.error.back)},
          {"vertical", tally.vertical ? json_of(*tally.vertical) : Json()}};
}

template <typename T>
Json json_of(const std::optional<T>& part) {
  return part ? json_of(*part) : Json();
}

}  // namespace

void print(const RebuildReport& report) {
  if (!report.scans.empty()) print_scans(report.scans);
  if (const auto& merged = report.merged; merged && report.scans.size() > 1) {
    fmt::print(
        "merged: {} redundant triangles and {} in visibility conflicts removed, {} clipped, {} "
        "left out; {} slits filled, {} gaps bridged, {} vertices moved\n",
        merged->redundant, merged->visibility_conflicts, merged->clipped, merged->left_out,
        merged->filled, merged->bridged, merged->moved);
  }
  if (report.holes) print_holes(*report.holes);
  if (report.simplified) print_simplified(*report.simplified);
  fmt::print("mesh: {} triangles, {} vertices, {:.6g} m²\n", report.triangles, report.vertices,
             report.area_m2);
  for (const std::string& note : report.notes) fmt::print("note: {}\n", note);
}

void write_json(const std::filesystem::path& path, const RebuildReport& report) {
  Json facts = Json::object(), seconds = Json::object(), scans = Json::array();
  for (const auto& [name, value] : report.facts) facts[name] = value;
  for (const auto& [stage, spent_s] : report.seconds) seconds[stage] = spent_s;
  for (const ScanTally& scan : report.scans) scans.push_back(json_of(scan));
  const glm::dvec3 origin_m = report.georeference.origin_w_m;
  const Json whole{{"groundray_reconstruction", 1},
                   {"facts", std::move(facts)},
                   {"origin_w_m", {origin_m.x, origin_m.y, origin_m.z}},
                   {"crs", report.georeference.crs_name},
                   {"scans", std::move(scans)},
                   {"merged", json_of(report.merged)},
                   {"holes", json_of(report.holes)},
                   {"simplified", json_of(report.simplified)},
                   {"mesh",
                    {{"triangles", report.triangles},
                     {"vertices", report.vertices},
                     {"area_m2", report.area_m2}}},
                   {"seconds", std::move(seconds)},
                   {"notes", report.notes}};
  // Names of files may be invalid UTF-8.
  write_text(path, whole.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace groundray
