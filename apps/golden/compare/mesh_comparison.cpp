#include "apps/golden/compare/mesh_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "apps/golden/compare/error_map.h"
#include "apps/golden/compare/mesh_clip.h"
#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/io/mesh_io.h"
#include "core/math.h"
#include "core/model/mesh_reader.h"
#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "reconstruction/mesh/accuracy/agreement.h"
#include "terrain/dem/dem_io.h"

namespace groundray::golden {
namespace {

constexpr std::size_t bin_count = 60;

/// Area by distance, in bins of 0.5 % of the distance.
class AreaByDistance {
 public:
  void add(double distance_m, double area_m2) {
    const double bin =
        bins_each * (math::log2(std::max(distance_m, least_m)) - math::log2(least_m));
    bins_m2_[std::min(static_cast<std::size_t>(bin), bins_m2_.size() - 1)] += area_m2;
    area_m2_ += area_m2;
  }
  /// Returns the distance that the fraction `share` of the area does not exceed.
  double percentile_m(double share) const {
    double below_m2 = 0;
    std::size_t k = 0;
    while (k + 1 < bins_m2_.size() && below_m2 + bins_m2_[k] < share * area_m2_)
      below_m2 += bins_m2_[k++];
    return k == 0 ? 0 : least_m * math::exp2((static_cast<double>(k) + 0.5) / bins_each);
  }

 private:
  static constexpr double least_m = 1e-12, bins_each = 138;  // per doubling

  double area_m2_ = 0;
  std::vector<double> bins_m2_ = std::vector<double>(12'000);  // to 1e14 m
};

/// Distances from the part of one mesh in the scope's box to all of the other.
struct Way {
  std::string whose, name;
  MeshPart part;
  LargestDistance largest{};
  MeanDistance mean{};
  double reach_m = 0;  // end of the bins of `mean`
  std::vector<AreaShare> within{};
  AreaByDistance spread{};
  Picture plan{};

  const TriangleMesh& from() const { return part.mesh; }
  double kept_m2() const { return mean.area_m2 - mean.ignored_m2; }
};

double size_m(const TriangleMesh& mesh) {
  const ModelBounds bounds = bounds_of(mesh);
  return glm::length(bounds.high_m - bounds.low_m);
}

/// Returns the fractions of the area within `ignore_beyond_m` that are within each tolerance.
std::vector<AreaShare> shares_within(const MeshDistance& distance, std::vector<double> within_m,
                                     double step_m, double ignore_beyond_m) {
  if (within_m.empty()) return {};
  const bool ignores = std::isfinite(ignore_beyond_m);
  if (ignores) within_m.push_back(ignore_beyond_m);
  std::vector<AreaShare> shares = distance.within(within_m, {.step_m = step_m});
  if (!ignores) return shares;
  const AreaShare all = shares.back();
  shares.pop_back();
  for (std::size_t k = 0; k < shares.size(); ++k) {
    AreaShare& share = shares[k];
    share = within_m[k] >= ignore_beyond_m
                ? AreaShare{1, 1, 1}
                : AreaShare{share.value / all.value, share.at_least / all.at_most,
                            std::min(1.0, share.at_most / all.at_least)};
  }
  return shares;
}

/// Replaces the bounds of the largest distance by those over the parts that are not left out.
void limit_largest(const Scope& scope, Way& way) {
  if (!(way.largest.at_most_m > scope.ignore_beyond_m)) return;
  way.largest.at_least_m = way.mean.largest_at_least_m;
  way.largest.at_most_m = std::min(way.largest.at_most_m, way.mean.largest_at_most_m);
}

void measure(const TriangleMesh& to, double reference_size_m, MeshFineness fineness,
             const Scope& scope, const glm::dvec3& origin_w_m, Way& way) {
  const MeshDistance distance(way.from(), to);
  if (fineness.tolerance_m == 0)
    fineness.tolerance_m = std::max(1e-6 * reference_size_m, 8 * distance.rounding_m());
  if (fineness.step_m == 0) fineness.step_m = distance.step_for_m(1e6);
  way.largest = distance.largest(fineness.tolerance_m);
  way.reach_m = std::min(way.largest.at_most_m, scope.ignore_beyond_m);
  constexpr int cells = 320;
  const ModelBounds bounds = bounds_of(way.from());
  ErrorMap plan(glm::dvec2(bounds.low_m + origin_w_m), glm::dvec2(bounds.high_m + origin_w_m),
                cells);
  way.mean =
      distance.mean(fineness.step_m, {.width_m = way.reach_m / bin_count, .count = bin_count},
                    scope.ignore_beyond_m, [&](const DistanceSample& sample) {
                      way.spread.add(sample.distance_m, sample.area_m2);
                      plan.add(glm::dvec2(sample.p + origin_w_m), sample.distance_m);
                    });
  if (!(way.kept_m2() > 0) || way.mean.samples == 0) {
    throw Error("{}: all of it is farther than {} m from the other mesh: allow a larger distance",
                way.whose, scope.ignore_beyond_m);
  }
  limit_largest(scope, way);
  way.within = shares_within(distance, fineness.within_m, fineness.step_m, scope.ignore_beyond_m);
  way.plan = plan.picture("distance " + way.name + ", in plan view", "x, m", "y, m", "distance, m");
}

Way way_of(const std::string& whose, const std::string& name, const TriangleMesh& from,
           const Scope& scope) {
  Way way{.whose = whose, .name = name, .part = clipped(from, scope)};
  if (way.from().triangles.empty()) {
    const ModelBounds bounds = bounds_of(from);
    throw Error(
        "{}: no part of it is within the area and heights; in their frame it reaches from ({}, {}, "
        "{}) to ({}, {}, {}) m",
        whose, bounds.low_m.x, bounds.low_m.y, bounds.low_m.z, bounds.high_m.x, bounds.high_m.y,
        bounds.high_m.z);
  }
  return way;
}

void tell_bounded(Section& into, const std::string& name, const BoundedLength& length) {
  tell(into, name, length.value_m, "m");
  tell(into, name + ", at least", length.at_least_m, "m");
  tell(into, name + ", at most", length.at_most_m, "m");
}

void tell_way(Section& into, const Way& way, const Scope& scope) {
  tell(into, way.name + ": largest distance, at least", way.largest.at_least_m, "m");
  tell(into, way.name + ": largest distance, at most", way.largest.at_most_m, "m");
  tell_bounded(into, way.name + ": mean distance", way.mean.mean);
  tell_bounded(into, way.name + ": RMS distance", way.mean.rms);
  for (const int percent : {50, 95, 99}) {
    tell(into, fmt::format("{}: {} % of the area within", way.name, percent),
         way.spread.percentile_m(percent / 100.0), "m");
  }
  const AngleSpread& turn = way.mean.turn;
  const std::string angle = way.name + ": angle between normals";
  tell(into, way.name + ": mean angle between normals", glm::degrees(turn.mean_rad()), "deg");
  tell(into, way.name + ": RMS angle between normals", glm::degrees(turn.rms_rad()), "deg");
  for (const int percent : {50, 90, 99}) {
    tell(into, fmt::format("{}, {} % of the area up to", angle, percent),
         glm::degrees(turn.percentile_rad(percent / 100.0)), "deg");
  }
  tell(into, way.name + ": samples", static_cast<double>(way.mean.samples), "samples");
  tell_ignored(into, way.whose, way.mean.ignored_m2, way.mean.area_m2, "m2", scope);
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

/// Adds a histogram of area by distance, in millionths of the area that is not left out.
void draw_spread(Section& into, const Way& way) {
  Histogram histogram{.title = "distance " + way.name,
                      .unit = "m",
                      .low = 0,
                      .high = way.reach_m,
                      .counted = "millionths of the area"};
  const auto millionths = [&](double area_m2) {
    return static_cast<std::uint64_t>(std::llround(1e6 * area_m2 / way.kept_m2()));
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
  const double apart_m = 0.02 * size_m(way.from());
  Table table{way.name + ": where distances are largest",
              {"triangle", "x, m", "y, m", "z, m", "distance, m"},
              {}};
  std::vector<glm::dvec3> listed;
  const auto list = [&](std::uint32_t triangle, const glm::dvec3& p, double distance_m) {
    if (std::ranges::any_of(listed,
                            [&](const glm::dvec3& q) { return glm::distance(p, q) < apart_m; }))
      return;
    listed.push_back(p);
    table.rows.push_back({fmt::format("{}", way.part.triangle_of[triangle]),
                          fmt::format("{:.3f}", p.x), fmt::format("{:.3f}", p.y),
                          fmt::format("{:.3f}", p.z), fmt::format("{:.6g}", distance_m)});
  };
  if (way.mean.ignored_m2 == 0)
    list(way.largest.from_triangle, way.largest.from, way.largest.at_least_m);
  const std::vector<double>& largest_m = way.mean.largest_m;
  std::vector<std::uint32_t> order(largest_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return largest_m[a] > largest_m[b]; });
  for (std::size_t i = 0; i < order.size() && listed.size() < most_rows; ++i) {
    const glm::uvec3& t = way.from().triangles[order[i]];
    const auto& at = way.from().vertices_m;
    if (largest_m[order[i]] > 0)
      list(order[i], (at[t.x] + at[t.y] + at[t.z]) / 3.0, largest_m[order[i]]);
  }
  into.tables.push_back(std::move(table));
}

void check_mesh_crs(const std::filesystem::path& reference, const Georeference& of_reference,
                    const std::filesystem::path& other, const Georeference& of_other) {
  if (of_reference.crs_name.empty() || of_other.crs_name.empty()) return;
  if (of_reference.crs_name == of_other.crs_name) return;
  if (is_same_crs(of_reference.crs_wkt, of_other.crs_wkt)) return;
  throw Error(
      "{}: its reference system is {} and that of {} is {}; they must be the same: reproject one "
      "of them first",
      other.string(), of_other.crs_name, reference.string(), of_reference.crs_name);
}

/// Returns the origin of a file's coordinates in W, as the file or the user states it.
std::optional<glm::dvec3> origin_of(const std::filesystem::path& path,
                                    const Georeference& georeference,
                                    const std::optional<glm::dvec3>& given_w_m) {
  const glm::dvec3& origin_m = georeference.origin_w_m;
  const bool is_stated = origin_m != glm::dvec3(0) || !georeference.crs_name.empty();
  if (is_stated && given_w_m) {
    throw Error("{}: the file states its origin, {} {} {} m: omit the one given by an option",
                path.string(), origin_m.x, origin_m.y, origin_m.z);
  }
  return is_stated ? std::optional(origin_m) : given_w_m;
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

/// Warns if the reference is far from the other at places, but not the other from the reference.
void suspect_cover(const Way& there, const Way& back, Section& into) {
  constexpr double far = 10;
  const double most_m = there.spread.percentile_m(0.95);
  if (!(back.largest.at_least_m > far * most_m &&
        back.largest.at_least_m > 2 * there.largest.at_most_m))
    return;
  into.text += fmt::format(
      " THE OTHER SEEMS NOT TO COVER ALL OF THE REFERENCE: points of the reference are up to "
      "{:.4g} m from it, though 95 % of its own area is within {:.2g} m of the reference. Restrict "
      "the comparison to what it covers (--area, --ignore-beyond-m).",
      back.largest.at_least_m, most_m);
}

void write_mesh_headline(const Way& there, const Way& back, const HausdorffDistance& both,
                         const std::vector<double>& within_m, Section& into) {
  into.headline = fmt::format(
      "The surfaces are at most {:.4g} m apart (Hausdorff distance); RMS {:.4g} m from the other "
      "to the reference, {:.4g} m from the reference to the other.",
      both.at_most_m, there.mean.rms.value_m, back.mean.rms.value_m);
  into.main = {"Hausdorff distance, at most", there.name + ": RMS distance",
               back.name + ": RMS distance"};
  if (within_m.empty()) {
    for (const Way* way : {&there, &back})
      into.main.push_back(way->name + ": 95 % of the area within");
  } else {
    for (const char* name : {"precision", "completeness"})
      into.main.push_back(fmt::format("{} within {} m", name, within_m.front()));
  }
}

/// Settings of a comparison in the frame of the reference.
struct Placed {
  MeshFineness fineness;
  Scope scope;            // its box is in W
  glm::dvec3 origin_w_m;  // of that frame
};

Section compare_placed(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const Placed& placed) {
  check_mesh(reference, "reference", EmptyMesh::Refuse);
  check_mesh(other, "other", EmptyMesh::Refuse);
  check_scope(placed.scope);
  Scope scope = placed.scope;
  scope.low_m -= placed.origin_w_m;
  scope.high_m -= placed.origin_w_m;
  Way there = way_of("other", "other to reference", other, scope);
  Way back = way_of("reference", "reference to other", reference, scope);
  const double reference_size_m = size_m(reference);
  measure(reference, reference_size_m, placed.fineness, scope, placed.origin_w_m, there);
  measure(other, reference_size_m, placed.fineness, scope, placed.origin_w_m, back);
  const HausdorffDistance both = hausdorff(there.largest, back.largest);
  Section section;
  section.title = title;
  section.text =
      scope_text(placed.scope, "both surfaces") +
      "Distances from the other to the reference measure its errors, those from the reference to "
      "the other its gaps. Bounds of largest distances hold between vertices too; bounds of means "
      "follow from the Lipschitz constant 1 of a distance.";
  tell(section, "Hausdorff distance, at least", both.at_least_m, "m");
  tell(section, "Hausdorff distance, at most", both.at_most_m, "m");
  tell_agreement(section, there, back, placed.fineness.within_m);
  for (const Way* way : {&there, &back}) {
    tell_way(section, *way, scope);
    draw_spread(section, *way);
    list_largest(section, *way);
    section.pictures.push_back(way->plan);
  }
  tell(section, "reference: triangles", static_cast<double>(reference.triangles.size()));
  tell(section, "other: triangles", static_cast<double>(other.triangles.size()));
  tell(section, "reference: area", back.mean.area_m2, "m2");
  tell(section, "other: area", there.mean.area_m2, "m2");
  suspect_cover(there, back, section);
  write_mesh_headline(there, back, both, placed.fineness.within_m, section);
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace

Section compare_meshes(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const MeshFineness& fineness, const Scope& scope,
                       const MeshOrigins& origins) {
  const MeshFile of_reference = read_mesh(reference);
  MeshFile of_other = read_mesh(other);
  check_mesh_crs(reference, of_reference.georeference, other, of_other.georeference);
  const auto reference_w_m = origin_of(reference, of_reference.georeference, origins.reference_w_m);
  const auto other_w_m = origin_of(other, of_other.georeference, origins.other_w_m);
  if (reference_w_m && other_w_m) {
    const glm::dvec3 shift_m = *other_w_m - *reference_w_m;
    for (glm::dvec3& vertex_m : of_other.mesh.vertices_m) vertex_m += shift_m;
  }
  Section section = compare_placed(of_reference.mesh, of_other.mesh,
                                   fmt::format("{} against {}", other.string(), reference.string()),
                                   {fineness, scope, reference_w_m.value_or(glm::dvec3(0))});
  if (reference_w_m.has_value() != other_w_m.has_value()) {
    section.text += fmt::format(
        " The {} has no georeference: it is assumed to be in the {}'s frame (--{}origin gives its "
        "origin in world coordinates).",
        reference_w_m ? "other" : "reference", reference_w_m ? "reference" : "other",
        reference_w_m ? "" : "reference-");
  }
  tell_reading(section, "reference", of_reference);
  tell_reading(section, "other", of_other);
  return section;
}

Section compare_meshes(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const MeshFineness& fineness, const Scope& scope) {
  return compare_placed(reference, other, title, {fineness, scope, glm::dvec3(0)});
}

}  // namespace groundray::golden
