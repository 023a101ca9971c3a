#include "reconstruction/mesh/accuracy/accuracy.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/accuracy/largest_distance.h"
#include "reconstruction/mesh/accuracy/surface_parts.h"

namespace groundray {
namespace {

glm::dvec3 middle_of(const TriangleMesh& mesh) {
  check_mesh(mesh, "mesh `to`", EmptyMesh::Refuse);
  const ModelBounds bounds = bounds_of(mesh);
  return 0.5 * (bounds.low_m + bounds.high_m);
}

TriangleMesh moved(const TriangleMesh& mesh, const glm::dvec3& by_m) {
  TriangleMesh out = mesh;
  for (glm::dvec3& vertex_m : out.vertices_m) vertex_m += by_m;
  return out;
}

/// Sample at a part's centroid, with an upper bound of the distance over the part.
struct Sample {
  NearestPoint nearest;
  double at_most_m = 0;
};

/// Adds the sample at a part's centroid to sums. Over the part, the distance is at most that to one
/// triangle, which is convex and thus at most the linear interpolation between the corners.
Sample add_sample(const ClosestPoint& to, const QuadratureTriangle& facet, const SurfacePart& part,
                  const NearestPoint& nearest, DistanceSums& sums) {
  const double d_m = nearest.distance_m;
  const auto corners = part.corners(facet);
  const double a = to.distance_m(corners[0], nearest.triangle);
  const double b = to.distance_m(corners[1], nearest.triangle);
  const double c = to.distance_m(corners[2], nearest.triangle);
  sums.add(d_m, std::abs(part.scale) * std::sqrt(facet.spread_m2), (a + b + c) / 3,
           (a * a + b * b + c * c + a * b + b * c + c * a) / 6, part.area_m2(facet));
  return {nearest, std::min(std::max({a, b, c}), d_m + std::abs(part.scale) * facet.radius_m)};
}

/// Sums over a batch of parts.
struct Lot : DistanceSums {
  AngleSpread turn;
  std::uint32_t near = 0;
  std::vector<double> bins_m2;
  double ignored_m2 = 0;
  double at_least_m = 0, at_most_m = 0;  // bounds of the largest distance
  std::vector<DistanceSample> visited;   // for the visitor
  struct Largest {
    std::uint32_t triangle = 0;
    double distance_m = -1;
  };
  std::vector<Largest> largest;  // of each triangle of the batch

  void take(const Lot& more) {
    *this += more;
    turn.add(more.turn);
    ignored_m2 += more.ignored_m2;
    at_least_m = std::max(at_least_m, more.at_least_m);
    at_most_m = std::max(at_most_m, more.at_most_m);
    for (std::size_t k = 0; k < more.bins_m2.size(); ++k) bins_m2[k] += more.bins_m2[k];
  }

  void note(std::uint32_t triangle, double distance_m) {
    if (largest.empty() || largest.back().triangle != triangle) largest.push_back({triangle});
    largest.back().distance_m = std::max(largest.back().distance_m, distance_m);
  }
};

/// Part that may contain the largest distance.
struct ErrorSuspect {
  SurfacePart part;
  double at_most_m = 0;
  std::uint32_t near = 0;
};

/// Sums over a batch of parts, and their largest distance.
struct ErrorLot : DistanceSums {
  std::uint32_t near = 0;
  FarthestProbe farthest{.probe = {.distance_m = -1}};
  std::vector<ErrorSuspect> suspects;

  void take(const ErrorLot& more) {
    *this += more;
    suspects.insert(suspects.end(), more.suspects.begin(), more.suspects.end());
    const double at_most_m = std::max(farthest.at_most_m, more.farthest.at_most_m);
    if (more.farthest.probe.distance_m > farthest.probe.distance_m) farthest = more.farthest;
    farthest.at_most_m = at_most_m;
  }
};

double tolerance_of(double largest_m, double share, double rounding_m) {
  return std::max(share / (1 - share) * largest_m, 4 * rounding_m);
}

/// Tightens the distance bounds of suspects by CoverBound.
void cover(std::vector<ErrorSuspect>& suspects, const TriangleMesh& from, const TriangleMesh& to,
           double rounding_m) {
  if (suspects.empty()) return;
  const CoverBound bound(to);
  tbb::parallel_for(std::size_t{0}, suspects.size(), [&](std::size_t i) {
    ErrorSuspect& suspect = suspects[i];
    const QuadratureTriangle facet(from, suspect.part.triangle);
    const auto corners = suspect.part.corners(facet);
    // Boundaries of terrain coincide only as seen along z.
    for (const glm::dvec3& direction : {facet.normal, glm::dvec3(0, 0, 1)}) {
      const double at_most_m = bound.bound_m(corners, direction, suspect.near) + rounding_m;
      suspect.at_most_m = std::min(suspect.at_most_m, at_most_m);
      if (std::isfinite(at_most_m)) break;
    }
  });
}

/// Refines the sampled result: searches the parts that may contain the largest distance.
FarthestProbe search_suspects(const TriangleMesh& from, const ClosestPoint& to, ErrorLot lot,
                              const ErrorFineness& fineness, double rounding_m) {
  FarthestProbe found = lot.farthest;
  const double tolerance_m =
      tolerance_of(found.probe.distance_m, fineness.largest_share, rounding_m);
  std::vector<ErrorSuspect>& suspects = lot.suspects;
  const auto settle = [&] {
    std::erase_if(suspects, [&](const ErrorSuspect& suspect) {
      if (suspect.at_most_m > found.probe.distance_m + tolerance_m) return false;
      found.at_most_m = std::max(found.at_most_m, suspect.at_most_m);
      return true;
    });
  };
  settle();
  cover(suspects, from, to.mesh(), rounding_m);
  settle();
  const std::size_t most = std::min(fineness.most_pieces, suspects.size());
  std::nth_element(
      suspects.begin(), suspects.begin() + static_cast<std::ptrdiff_t>(most), suspects.end(),
      [](const ErrorSuspect& a, const ErrorSuspect& b) { return a.at_most_m > b.at_most_m; });
  std::vector<SearchPiece> pieces;
  for (const ErrorSuspect& suspect : suspects) {
    if (pieces.size() < most) {
      const QuadratureTriangle facet(from, suspect.part.triangle);
      pieces.push_back(
          {suspect.part.corners(facet), suspect.part.triangle, suspect.near, suspect.at_most_m});
    } else {
      found.at_most_m = std::max(found.at_most_m, suspect.at_most_m);
    }
  }
  return find_farthest(pieces, to, found,
                       {tolerance_m - 2 * rounding_m, rounding_m, fineness.most_pieces});
}

/// Returns the step of the parts that area fractions are measured on.
double step_of(const ShareFineness& fineness, const MeshDistance& distance,
               const TriangleMesh& from) {
  constexpr double samples = 1e5;
  if (fineness.step_m != 0) return fineness.step_m;
  return SurfaceParts::widened_m(from, distance.step_for_m(samples), samples);
}

}  // namespace

HausdorffDistance hausdorff(const LargestDistance& forth, const LargestDistance& back) {
  return {std::max(forth.at_least_m, back.at_least_m), std::max(forth.at_most_m, back.at_most_m)};
}

MeshDistance::MeshDistance(const TriangleMesh& from, const TriangleMesh& to,
                           const RayDevice& device)
    : origin_m_(middle_of(to)), from_(moved(from, -origin_m_)), to_(moved(to, -origin_m_), device) {
  measure();
}

MeshDistance::MeshDistance(const TriangleMesh& from, const ClosestPoint& to)
    : from_(from), to_(to) {
  measure();
}

void MeshDistance::measure() {
  check_mesh(from_, "mesh `from`", EmptyMesh::Refuse);
  const ModelBounds near = bounds_of(to_.mesh()), far = bounds_of(from_);
  const glm::dvec3 high_m = glm::max(near.high_m, far.high_m);
  const glm::dvec3 low_m = glm::min(near.low_m, far.low_m);
  const double away_m = glm::length(glm::max(glm::abs(high_m), glm::abs(low_m)));
  // Rounding of a distance: 16 ulp, and one ulp for each split of a piece (fewer than a hundred).
  // Rounding of the two positions: 4 ulp each.
  rounding_m_ =
      std::numeric_limits<double>::epsilon() * (128 * glm::length(high_m - low_m) + 8 * away_m);
  for (std::size_t i = 0; i < from_.triangles.size(); ++i)
    area_m2_ += QuadratureTriangle(from_, i).area_m2;
}

LargestDistance MeshDistance::largest(double tolerance_m, std::size_t most_pieces) const {
  if (!(tolerance_m > 4 * rounding_m_)) {
    throw Error(
        "distance between meshes: tolerance_m = {} must exceed {:.2g}, the rounding error for "
        "meshes of this size",
        tolerance_m, 4 * rounding_m_);
  }
  const FarthestProbe found =
      find_farthest(from_, to_, {tolerance_m - 2 * rounding_m_, rounding_m_, most_pieces});
  const NearestPoint nearest = to_.nearest(found.probe.p, found.probe.nearest);
  return {.at_least_m = std::max(0.0, found.probe.distance_m - rounding_m_),
          .at_most_m = found.at_most_m + rounding_m_,
          .from = origin_m_ + found.probe.p,
          .to = origin_m_ + nearest.point,
          .from_triangle = found.triangle,
          .to_triangle = nearest.triangle,
          .pieces = found.pieces};
}

double MeshDistance::step_for_m(double samples) const noexcept {
  // A part whose legs are one step long has half the step's square as area.
  return std::sqrt(2 * area_m2_ / samples);
}

void MeshDistance::check_area() const {
  if (area_m2_ > 0) return;
  throw Error(
      "distance between meshes: all triangles of mesh `from` are degenerate, so there is no mean "
      "over its area");
}

MeanDistance MeshDistance::mean(double step_m, const DistanceBins& bins, double ignore_beyond_m,
                                const SampleVisitor& visit) const {
  const SurfaceParts parts(from_, step_m);
  check_area();
  Lot empty;
  if (bins.width_m > 0) empty.bins_m2.resize(bins.count + 1);
  const auto measure = [&](const QuadratureTriangle& facet, const SurfacePart& part, Lot& lot) {
    const NearestPoint nearest = to_.nearest(part.middle, lot.near);
    lot.near = nearest.triangle;
    const double part_m2 = part.area_m2(facet);
    if (nearest.distance_m > ignore_beyond_m) {
      lot.ignored_m2 += part_m2;
      return;
    }
    const Sample sample = add_sample(to_, facet, part, nearest, lot);
    lot.turn.add(facet.normal, QuadratureTriangle(to_.mesh(), nearest.triangle).normal, part_m2);
    lot.note(part.triangle, nearest.distance_m);
    lot.at_least_m = std::max(lot.at_least_m, nearest.distance_m);
    lot.at_most_m = std::max(lot.at_most_m, sample.at_most_m);
    if (visit) lot.visited.push_back({origin_m_ + part.middle, nearest.distance_m, part_m2});
    if (lot.bins_m2.empty()) return;
    const double bin = std::min(nearest.distance_m / bins.width_m, static_cast<double>(bins.count));
    lot.bins_m2[static_cast<std::size_t>(bin)] += part_m2;
  };
  Lot total = empty;
  MeanDistance mean{.area_m2 = area_m2_};
  mean.largest_m.resize(from_.triangles.size());
  parts.sum_up(empty, measure, [&](const Lot& lot) {
    total.take(lot);
    for (const Lot::Largest& each : lot.largest)
      mean.largest_m[each.triangle] = std::max(mean.largest_m[each.triangle], each.distance_m);
    for (const DistanceSample& sample : lot.visited) visit(sample);
  });
  mean.samples = total.samples;
  mean.turn = total.turn;
  mean.bins_m2 = std::move(total.bins_m2);
  mean.ignored_m2 = total.ignored_m2;
  mean.largest_at_least_m = std::max(0.0, total.at_least_m - rounding_m_);
  mean.largest_at_most_m = total.at_most_m + rounding_m_;
  const DistanceSums::Means means = total.means(rounding_m_, parts.sum_rounding());
  mean.mean = means.mean;
  mean.rms = means.rms;
  return mean;
}

OneSidedError MeshDistance::error(const ErrorFineness& fineness) const {
  check_area();
  if (!(fineness.samples > 0 && std::isfinite(fineness.samples) && fineness.largest_share > 0 &&
        fineness.largest_share < 1)) {
    throw Error(
        "distance between meshes: samples = {} must be positive and finite, and largest_share = {} "
        "between 0 and 1",
        fineness.samples, fineness.largest_share);
  }
  const double samples = fineness.samples;
  const SurfaceParts parts(from_, SurfaceParts::widened_m(from_, step_for_m(samples), samples));
  const auto visit = [&](const QuadratureTriangle& facet, const SurfacePart& part, ErrorLot& lot) {
    const Sample sample = add_sample(to_, facet, part, to_.nearest(part.middle, lot.near), lot);
    lot.near = sample.nearest.triangle;
    FarthestProbe& farthest = lot.farthest;
    if (sample.nearest.distance_m > farthest.probe.distance_m) {
      farthest.probe = {part.middle, sample.nearest.distance_m, lot.near};
      farthest.triangle = part.triangle;
    }
    const double least_m = farthest.probe.distance_m;
    if (sample.at_most_m > least_m + tolerance_of(least_m, fineness.largest_share, rounding_m_)) {
      lot.suspects.push_back({part, sample.at_most_m, lot.near});
    } else {
      farthest.at_most_m = std::max(farthest.at_most_m, sample.at_most_m);
    }
  };
  ErrorLot total;
  parts.sum_up(ErrorLot(), visit, [&](const ErrorLot& lot) { total.take(lot); });
  const DistanceSums::Means means = total.means(rounding_m_, parts.sum_rounding());
  const FarthestProbe found = search_suspects(from_, to_, std::move(total), fineness, rounding_m_);
  return {.at_least_m = std::max(0.0, found.probe.distance_m - rounding_m_),
          .at_most_m = found.at_most_m + rounding_m_,
          .mean = means.mean,
          .rms = means.rms};
}

std::vector<AreaShare> MeshDistance::within(std::span<const double> tolerances_m,
                                            const ShareFineness& fineness,
                                            const SurfaceWeight& weight) const {
  check_tolerances(tolerances_m);
  check_quarterings(fineness.quarterings);
  check_area();
  const SurfaceParts parts(from_, step_of(fineness, *this, from_));
  const auto distance = [&](const QuadratureTriangle& facet, const SurfacePart& part,
                            std::uint32_t& near) {
    const NearestPoint nearest = to_.nearest(part.middle, near);
    near = nearest.triangle;
    double corner_m = 0;
    for (const glm::dvec3& corner : part.corners(facet))
      corner_m = std::max(corner_m, to_.distance_m(corner, near));
    const double d_m = nearest.distance_m, radius_m = std::abs(part.scale) * facet.radius_m;
    return PartDistance{d_m, d_m - radius_m - rounding_m_,
                        std::min(corner_m, d_m + radius_m) + rounding_m_};
  };
  const auto weight_of = [&](const SurfacePart& part) {
    return weight ? weight(part.triangle, origin_m_ + part.middle) : 1.0;
  };
  const auto visit = [&](const QuadratureTriangle& facet, const SurfacePart& part,
                         ShareSums& sums) {
    add_shares(facet, part, tolerances_m, fineness.quarterings, distance, weight_of, sums);
  };
  ShareSums total;
  parts.sum_up(ShareSums(), visit, [&](const ShareSums& sums) { total += sums; });
  return total.shares(parts.sum_rounding());
}

}  // namespace groundray
