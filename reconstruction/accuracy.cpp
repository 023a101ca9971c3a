#include "reconstruction/accuracy.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/mesh_check.h"
#include "core/model.h"
#include "reconstruction/largest_distance.h"

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

/// A triangle as quadrature sees it.
struct Facet {
  glm::dvec3 a, ab, ac;
  glm::dvec3 normal;  // twice the area long
  double area_m2 = 0;
  double longest_m = 0;  // edge
  double spread_m2 = 0;  // mean square of the distance from its middle

  Facet(const TriangleMesh& mesh, std::size_t triangle) {
    const glm::uvec3& t = mesh.triangles[triangle];
    a = mesh.vertices_m[t.x];
    ab = mesh.vertices_m[t.y] - a;
    ac = mesh.vertices_m[t.z] - a;
    const glm::dvec3 bc = ac - ab;
    normal = glm::cross(ab, ac);
    area_m2 = 0.5 * glm::length(normal);
    const double squares = glm::dot(ab, ab) + glm::dot(ac, ac) + glm::dot(bc, bc);
    longest_m = std::max({glm::length(ab), glm::length(ac), glm::length(bc)});
    spread_m2 = squares / 36;
  }
};

/// Some rows of a triangle's parts: the triangle is cut into splits^2 of its own shape.
struct Strip {
  std::uint32_t triangle = 0;
  std::uint32_t splits = 1;
  std::uint32_t begin_row = 0, end_row = 0;
};

/// What some samples add up to; each stands for the same area.
struct Sums {
  double distance = 0, square = 0;           // m and m^2 at the samples
  double low = 0, low_square = 0;            // that the parts have at least in the mean
  double high = 0, high_square = 0;          // and at most
  double spread = 0, turn = 0, samples = 0;  // m^2, rad
};

struct StripSums : Sums {
  double largest_m = 0;
  std::vector<std::uint32_t> bins;
};

constexpr double most_samples = 1e9;
constexpr std::uint32_t samples_each = 4096;  // strip, where a row has no more

std::vector<Strip> strips_of(const TriangleMesh& mesh, double step_m) {
  double samples = 0;
  std::vector<double> splits(mesh.triangles.size());
  for (std::size_t i = 0; i < splits.size(); ++i) {
    splits[i] = std::max(1.0, std::ceil(Facet(mesh, i).longest_m / step_m));
    samples += splits[i] * splits[i];
  }
  if (samples > most_samples) {
    throw Error(
        "distance between meshes: step_m = {} takes {:.2g} samples, which must be at most {:.0e}; "
        "take a larger step",
        step_m, samples, most_samples);
  }
  std::vector<Strip> strips;
  for (std::uint32_t i = 0; i < splits.size(); ++i) {
    const auto rows = static_cast<std::uint32_t>(splits[i]);
    const std::uint32_t each = std::max(1u, samples_each / (2 * rows));
    for (std::uint32_t row = 0; row < rows; row += each)
      strips.push_back({i, rows, row, std::min(rows, row + each)});
  }
  return strips;
}

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Takes the samples of strips of one mesh.
class Sampler {
 public:
  Sampler(const TriangleMesh& from, const ClosestPoint& to, const DistanceBins& bins)
      : from_(from), to_(to), bins_(bins) {}

  StripSums sums_of(const Strip& strip) const {
    const Facet facet(from_, strip.triangle);
    StripSums sums;
    if (bins_.width_m > 0) sums.bins.resize(bins_.count + 1);
    std::uint32_t near = 0;
    const double third = 1 / (3.0 * strip.splits);
    for (std::uint32_t row = strip.begin_row; row < strip.end_row; ++row) {
      const std::uint32_t in_row = 2 * (strip.splits - row) - 1;  // upright parts and turned ones
      for (std::uint32_t k = 0; k < in_row; ++k) {
        const bool is_turned = k % 2 != 0;
        const double middle = is_turned ? 2 : 1, column = (k - k % 2) / 2.0;
        const glm::dvec3 p = facet.a + (3 * column + middle) * third * facet.ab +
                             (3 * row + middle) * third * facet.ac;
        near = add(facet, p, (is_turned ? -1.0 : 1.0) / strip.splits, near, sums);
      }
    }
    return sums;
  }

 private:
  /// @param scale  of the part whose middle is p, negative if it is turned by half.
  std::uint32_t add(const Facet& facet, const glm::dvec3& p, double scale, std::uint32_t near,
                    StripSums& sums) const {
    const NearestPoint nearest = to_.nearest(p, near);
    const double d_m = nearest.distance_m;
    const double spread_m2 = scale * scale * facet.spread_m2, spread_m = std::sqrt(spread_m2);
    ++sums.samples;
    sums.distance += d_m;
    sums.square += d_m * d_m;
    sums.spread += spread_m2;
    const double low_m = std::max(0.0, d_m - spread_m);
    sums.low += low_m;
    sums.low_square += low_m * low_m;
    // Over the part, the distance is at most that to one triangle, and that at most what is
    // linear between the corners.
    const glm::dvec3 ab = scale / 3 * facet.ab, ac = scale / 3 * facet.ac;
    const double a = to_.distance_m(p - ab - ac, nearest.triangle);
    const double b = to_.distance_m(p + 2.0 * ab - ac, nearest.triangle);
    const double c = to_.distance_m(p + 2.0 * ac - ab, nearest.triangle);
    sums.high += std::min((a + b + c) / 3, d_m + spread_m);
    sums.high_square += (a * a + b * b + c * c + a * b + b * c + c * a) / 6;
    sums.turn += angle_between(facet.normal, Facet(to_.mesh(), nearest.triangle).normal);
    sums.largest_m = std::max(sums.largest_m, d_m);
    if (!sums.bins.empty()) {
      const double bin = std::min(d_m / bins_.width_m, static_cast<double>(bins_.count));
      ++sums.bins[static_cast<std::size_t>(bin)];
    }
    return nearest.triangle;
  }

  const TriangleMesh& from_;
  const ClosestPoint& to_;
  DistanceBins bins_;
};

/// Adds up what strips found, in their order.
Sums total_of(const std::vector<Strip>& strips, const std::vector<StripSums>& all,
              const TriangleMesh& from, MeanDistance& mean) {
  Sums total;
  for (std::size_t i = 0; i < strips.size(); ++i) {
    const double splits = strips[i].splits;
    const double part_m2 = Facet(from, strips[i].triangle).area_m2 / (splits * splits);
    const StripSums& sums = all[i];
    for (double Sums::*sum : {&Sums::distance, &Sums::square, &Sums::low, &Sums::low_square,
                              &Sums::high, &Sums::high_square, &Sums::spread, &Sums::turn})
      total.*sum += part_m2 * (sums.*sum);
    total.samples += sums.samples;
    double& largest_m = mean.largest_m[strips[i].triangle];
    largest_m = std::max(largest_m, sums.largest_m);
    for (std::size_t k = 0; k < sums.bins.size(); ++k) mean.bins_m2[k] += part_m2 * sums.bins[k];
  }
  return total;
}

}  // namespace

HausdorffDistance hausdorff(const LargestDistance& forth, const LargestDistance& back) {
  return {std::max(forth.at_least_m, back.at_least_m), std::max(forth.at_most_m, back.at_most_m)};
}

MeshDistance::MeshDistance(const TriangleMesh& from, const TriangleMesh& to,
                           const RayDevice& device)
    : origin_m_(middle_of(to)), from_(moved(from, -origin_m_)), to_(moved(to, -origin_m_), device) {
  check_mesh(from_, "mesh `from`", EmptyMesh::Refuse);
  const ModelBounds near = bounds_of(to_.mesh()), far = bounds_of(from_);
  const double size_m =
      glm::length(glm::max(near.high_m, far.high_m) - glm::min(near.low_m, far.low_m));
  // 16 ulp for a distance, and one for each split of a piece, which are fewer than a hundred.
  rounding_m_ = 128 * std::numeric_limits<double>::epsilon() * size_m;
  for (std::size_t i = 0; i < from_.triangles.size(); ++i) area_m2_ += Facet(from_, i).area_m2;
}

LargestDistance MeshDistance::largest(double tolerance_m, std::size_t most_pieces) const {
  if (!(tolerance_m > 4 * rounding_m_)) {
    throw Error(
        "distance between meshes: tolerance_m = {} must exceed {:.2g}, which rounding takes of "
        "meshes of this size",
        tolerance_m, 4 * rounding_m_);
  }
  const FarthestProbe found =
      find_farthest(from_, to_, tolerance_m - 2 * rounding_m_, rounding_m_, most_pieces);
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
  // A part with legs of one step has half its square.
  return std::sqrt(2 * area_m2_ / samples);
}

// The distance changes by no more than the place does. Over a part, it differs from that amid the
// part by at most the distance from there, whose mean is at most its root mean square, the spread's
// root; and by Minkowski's inequality root mean squares differ by at most that of the difference.
MeanDistance MeshDistance::mean(double step_m, const DistanceBins& bins) const {
  if (!(step_m > 0)) throw Error("distance between meshes: step_m = {} must be positive", step_m);
  if (!(area_m2_ > 0)) {
    throw Error(
        "distance between meshes: all triangles of mesh `from` are needles or points, so that "
        "there is no mean by area");
  }
  const std::vector<Strip> strips = strips_of(from_, step_m);
  std::vector<StripSums> sums(strips.size());
  const Sampler sampler(from_, to_, bins);
  tbb::parallel_for(std::size_t{0}, strips.size(),
                    [&](std::size_t i) { sums[i] = sampler.sums_of(strips[i]); });
  MeanDistance mean{.area_m2 = area_m2_};
  mean.largest_m.resize(from_.triangles.size());
  if (bins.width_m > 0) mean.bins_m2.resize(bins.count + 1);
  const Sums total = total_of(strips, sums, from_, mean);
  mean.samples = static_cast<std::size_t>(total.samples);
  mean.turn_rad = total.turn / area_m2_;
  // Adding up n numbers takes n ulp / 2 of the sum at most; they are added by strips.
  const double sum_error =
      static_cast<double>(strips.size() + samples_each) * std::numeric_limits<double>::epsilon();
  const double slack_m = rounding_m_ + sum_error * total.high / area_m2_;
  mean.mean = {total.distance / area_m2_, std::max(0.0, total.low / area_m2_ - slack_m),
               total.high / area_m2_ + slack_m};
  const double rms_m = std::sqrt(total.square / area_m2_);
  const double spread_m = std::sqrt(total.spread / area_m2_);
  const double low_m = std::max(rms_m - spread_m, std::sqrt(total.low_square / area_m2_));
  const double high_m = std::min(rms_m + spread_m, std::sqrt(total.high_square / area_m2_));
  mean.rms = {rms_m, std::max(0.0, low_m - slack_m), high_m + slack_m};
  return mean;
}

}  // namespace groundray
