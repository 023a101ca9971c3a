#include "apps/golden/compare/mesh_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numeric>
#include <utility>
#include <vector>

#include "apps/golden/compare/error_figures.h"
#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/io/mesh_io.h"
#include "core/model/mesh_reader.h"
#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "reconstruction/mesh/accuracy/agreement.h"

namespace groundray::golden {
namespace {

constexpr std::size_t bin_count = 60;

/// Distances from one mesh to the other.
struct Way {
  std::string name;
  const TriangleMesh& from;
  LargestDistance largest;
  MeanDistance mean;
  std::vector<AreaShare> within;
};

double size_m(const TriangleMesh& mesh) {
  const ModelBounds bounds = bounds_of(mesh);
  return glm::length(bounds.high_m - bounds.low_m);
}

Way measured(const std::string& name, const TriangleMesh& from, const TriangleMesh& to,
             double reference_size_m, MeshFineness fineness) {
  const MeshDistance distance(from, to);
  if (fineness.tolerance_m == 0)
    fineness.tolerance_m = std::max(1e-6 * reference_size_m, 8 * distance.rounding_m());
  if (fineness.step_m == 0) fineness.step_m = distance.step_for_m(1e6);
  const LargestDistance largest = distance.largest(fineness.tolerance_m);
  const DistanceBins bins{.width_m = largest.at_most_m / bin_count, .count = bin_count};
  Way way{name, from, largest, distance.mean(fineness.step_m, bins), {}};
  if (!fineness.within_m.empty())
    way.within = distance.within(fineness.within_m, {.step_m = fineness.step_m});
  return way;
}

void tell_bounded(Section& into, const std::string& name, const BoundedLength& length) {
  tell(into, name, length.value_m, "m");
  tell(into, name + ", at least", length.at_least_m, "m");
  tell(into, name + ", at most", length.at_most_m, "m");
}

void tell_way(Section& into, const Way& way) {
  tell(into, way.name + ": largest distance, at least", way.largest.at_least_m, "m");
  tell(into, way.name + ": largest distance, at most", way.largest.at_most_m, "m");
  tell_bounded(into, way.name + ": mean distance", way.mean.mean);
  tell_bounded(into, way.name + ": RMS distance", way.mean.rms);
  const AngleSpread& turn = way.mean.turn;
  const std::string angle = way.name + ": angle between normals";
  tell(into, way.name + ": mean angle between normals", glm::degrees(turn.mean_rad()), "deg");
  tell(into, way.name + ": RMS angle between normals", glm::degrees(turn.rms_rad()), "deg");
  for (const int percent : {50, 90, 99}) {
    tell(into, fmt::format("{}, {} % of the area up to", angle, percent),
         glm::degrees(turn.percentile_rad(percent / 100.0)), "deg");
  }
  tell(into, way.name + ": samples", static_cast<double>(way.mean.samples), "samples");
}

void tell_share(Section& into, const std::string& name, const AreaShare& share) {
  tell(into, name, 100 * share.value, "%");
  tell(into, name + ", at least", 100 * share.at_least, "%");
  tell(into, name + ", at most", 100 * share.at_most, "%");
}

void tell_agreement(Section& into, const Way& there, const Way& back,
                    const std::vector<double>& within_m) {
  for (std::size_t k = 0; k < within_m.size(); ++k) {
    const Agreement at{within_m[k], there.within[k], back.within[k]};
    const std::string within = fmt::format(" within {} m", within_m[k]);
    tell_share(into, "precision" + within, at.precision);
    tell_share(into, "completeness" + within, at.completeness);
    tell_share(into, "F1" + within, at.f1());
  }
}

/// Adds a histogram of area by distance, in millionths of the whole area.
void draw_spread(Section& into, const Way& way) {
  Histogram histogram{.title = way.name + ": area by distance, in millionths",
                      .unit = "m",
                      .low = 0,
                      .high = way.largest.at_most_m};
  const auto millionths = [&](double area_m2) {
    return static_cast<std::uint64_t>(std::llround(1e6 * area_m2 / way.mean.area_m2));
  };
  for (std::size_t k = 0; k < bin_count; ++k)
    histogram.counts.push_back(millionths(way.mean.bins_m2[k]));
  histogram.above = millionths(way.mean.bins_m2[bin_count]);
  into.histograms.push_back(std::move(histogram));
}

/// Adds a table of the positions of the largest distances: the largest, then centroids of triangles
/// by their largest sampled distance, spaced by at least 2 % of the mesh's size.
void list_largest(Section& into, const Way& way) {
  constexpr std::size_t most_rows = 10;
  const double apart_m = 0.02 * size_m(way.from);
  Table table{way.name + ": where distances are largest",
              {"triangle", "x, m", "y, m", "z, m", "distance, m"},
              {}};
  std::vector<glm::dvec3> listed;
  const auto list = [&](std::uint32_t triangle, const glm::dvec3& p, double distance_m) {
    if (std::ranges::any_of(listed,
                            [&](const glm::dvec3& q) { return glm::distance(p, q) < apart_m; }))
      return;
    listed.push_back(p);
    table.rows.push_back({fmt::format("{}", triangle), fmt::format("{:.3f}", p.x),
                          fmt::format("{:.3f}", p.y), fmt::format("{:.3f}", p.z),
                          fmt::format("{:.6g}", distance_m)});
  };
  list(way.largest.from_triangle, way.largest.from, way.largest.at_least_m);
  const std::vector<double>& largest_m = way.mean.largest_m;
  std::vector<std::uint32_t> order(largest_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return largest_m[a] > largest_m[b]; });
  for (std::size_t i = 0; i < order.size() && listed.size() < most_rows; ++i) {
    const glm::uvec3& t = way.from.triangles[order[i]];
    const auto& at = way.from.vertices_m;
    if (largest_m[order[i]] > 0)
      list(order[i], (at[t.x] + at[t.y] + at[t.z]) / 3.0, largest_m[order[i]]);
  }
  into.tables.push_back(std::move(table));
}

void check_mesh_crs(const std::filesystem::path& reference, const Georeference& of_reference,
                    const std::filesystem::path& other, const Georeference& of_other) {
  if (of_reference.crs_name.empty() || of_other.crs_name.empty()) return;
  if (of_reference.crs_name == of_other.crs_name) return;
  throw Error(
      "{}: its reference system is {} and that of {} is {}; they must be the same: reproject one "
      "of them first",
      other.string(), of_other.crs_name, reference.string(), of_reference.crs_name);
}

bool says_where(const Georeference& georeference) {
  return georeference.origin_w_m != glm::dvec3(0) || !georeference.crs_name.empty();
}

/// Reports elements that were dropped or skipped in reading, and the rounding of coordinates.
void tell_reading(Section& into, const std::string& name, const MeshFile& file) {
  if (file.dropped > 0)
    tell(into, name + ": broken polygons left out", static_cast<double>(file.dropped));
  if (file.skipped > 0)
    tell(into, name + ": points, lines and patches skipped", static_cast<double>(file.skipped));
  if (file.rounding_m > 0)
    tell(into, name + ": coordinates rounded by up to", file.rounding_m, "m");
}

}  // namespace

Section compare_meshes(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const MeshFineness& fineness) {
  const MeshFile of_reference = read_mesh(reference);
  MeshFile of_other = read_mesh(other);
  check_mesh_crs(reference, of_reference.georeference, other, of_other.georeference);
  const bool both_say = says_where(of_reference.georeference) && says_where(of_other.georeference);
  if (both_say) {
    const glm::dvec3 shift_m =
        of_other.georeference.origin_w_m - of_reference.georeference.origin_w_m;
    for (glm::dvec3& vertex_m : of_other.mesh.vertices_m) vertex_m += shift_m;
  }
  Section section =
      compare_meshes(of_reference.mesh, of_other.mesh,
                     fmt::format("{} against {}", other.string(), reference.string()), fineness);
  if (says_where(of_reference.georeference) != says_where(of_other.georeference)) {
    const bool silent_other = says_where(of_reference.georeference);
    section.text +=
        fmt::format(" The {} has no georeference: it is assumed to be in the {}'s frame.",
                    silent_other ? "other" : "reference", silent_other ? "reference" : "other");
  }
  tell_reading(section, "reference", of_reference);
  tell_reading(section, "other", of_other);
  return section;
}

Section compare_meshes(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const MeshFineness& fineness) {
  check_mesh(reference, "reference", EmptyMesh::Refuse);
  check_mesh(other, "other", EmptyMesh::Refuse);
  const double reference_size_m = size_m(reference);
  const Way there = measured("other to reference", other, reference, reference_size_m, fineness);
  const Way back = measured("reference to other", reference, other, reference_size_m, fineness);
  const HausdorffDistance both = hausdorff(there.largest, back.largest);
  Section section;
  section.title = title;
  section.text =
      "Distances from the other to the reference measure its errors, those from the reference to "
      "the other its gaps. Bounds of largest distances hold between vertices too; bounds of means "
      "follow from the Lipschitz constant 1 of a distance.";
  tell(section, "Hausdorff distance, at least", both.at_least_m, "m");
  tell(section, "Hausdorff distance, at most", both.at_most_m, "m");
  tell_agreement(section, there, back, fineness.within_m);
  for (const Way& way : {there, back}) {
    tell_way(section, way);
    draw_spread(section, way);
    list_largest(section, way);
  }
  tell(section, "reference: triangles", static_cast<double>(reference.triangles.size()));
  tell(section, "other: triangles", static_cast<double>(other.triangles.size()));
  tell(section, "reference: area", back.mean.area_m2, "m2");
  tell(section, "other: area", there.mean.area_m2, "m2");
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace groundray::golden
