#include "reconstruction/mesh/accuracy/true_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/math.h"
#include "core/model/model.h"
#include "reconstruction/mesh/accuracy/surface_parts.h"

namespace groundray {
namespace {

glm::dvec3 direction_of(const glm::dvec3& v, std::string_view what) {
  const double length = glm::length(v);
  if (length > 0 && std::isfinite(length)) return v / length;
  throw Error("true surface: {} = {} {} {} must be finite and not zero", what, v.x, v.y, v.z);
}

void check_radius(double radius_m) {
  if (!(radius_m > 0) || !std::isfinite(radius_m))
    throw Error("true surface: radius_m = {} must be positive and finite", radius_m);
}

/// Part that may contain the largest distance.
struct TrueSuspect {
  SurfacePart part;
  double at_most_m = 0;
};

constexpr std::size_t most_suspects = 300'000;

/// Sums over a batch of parts.
struct TrueLot {
  DistanceSums sums;
  ShareSums shares;
  AngleSpread turn;
  // Largest sampled distance, and bound of the parts that are no suspects.
  double at_least_m = 0, at_most_m = 0;
  std::vector<TrueSuspect> suspects;

  void see(const SurfacePart& part, const PartDistance& distance) {
    at_least_m = std::max(at_least_m, distance.middle_m);
    suspects.push_back({part, distance.at_most_m});
  }

  /// Removes suspects that cannot exceed the largest sampled distance by more than 1 %.
  void settle() {
    std::erase_if(suspects, [&](const TrueSuspect& suspect) {
      if (suspect.at_most_m > 1.01 * at_least_m) return false;
      at_most_m = std::max(at_most_m, suspect.at_most_m);
      return true;
    });
  }

  void take(const TrueLot& more) {
    sums += more.sums;
    shares += more.shares;
    turn.add(more.turn);
    at_least_m = std::max(at_least_m, more.at_least_m);
    at_most_m = std::max(at_most_m, more.at_most_m);
    for (const TrueSuspect& suspect : more.suspects) {
      // If too many parts are equally distant, the excess is not refined.
      if (suspect.at_most_m > 1.01 * at_least_m && suspects.size() < most_suspects) {
        suspects.push_back(suspect);
      } else {
        at_most_m = std::max(at_most_m, suspect.at_most_m);
      }
    }
  }
};

class TrueMeasure {
 public:
  TrueMeasure(const TriangleMesh& mesh, const TrueSurface& truth,
              std::span<const double> tolerances_m, unsigned quarterings)
      : mesh_(mesh), truth_(truth), tolerances_m_(tolerances_m), quarterings_(quarterings) {
    const ModelBounds bounds = bounds_of(mesh);
    const double away_m = glm::length(glm::max(glm::abs(bounds.low_m), glm::abs(bounds.high_m)));
    rounding_m_ = 64 * std::numeric_limits<double>::epsilon() * away_m;
  }

  double rounding_m() const { return rounding_m_; }

  PartDistance distance(const QuadratureTriangle& facet, const SurfacePart& part) const {
    const double d_m = distance_at(part.middle);
    const double radius_m =
        truth_.most_change * std::abs(part.scale) * facet.radius_m + rounding_m_;
    return {d_m, d_m - radius_m, d_m + radius_m};
  }

  double distance_at(const glm::dvec3& p) const {
    const double d_m = truth_.distance_m(p);
    if (d_m >= 0 && std::isfinite(d_m)) return d_m;
    throw Error("true surface: the distance of {} {} {} is {}; it must be 0 or more, and finite",
                p.x, p.y, p.z, d_m);
  }

  void add(const QuadratureTriangle& facet, const SurfacePart& part, TrueLot& lot) const {
    const PartDistance found = distance(facet, part);
    const double area_m2 = part.area_m2(facet);
    const double change_m = truth_.most_change * std::abs(part.scale);
    const double spread_m = change_m * std::sqrt(facet.spread_m2);
    const double high_m = found.middle_m + spread_m;
    lot.sums.add(found.middle_m, spread_m, high_m, high_m * high_m, area_m2);
    lot.see(part, found);
    if (truth_.normal) lot.turn.add(facet.normal, truth_.normal(part.middle), area_m2);
    if (tolerances_m_.empty()) return;
    const auto distance_of = [this](const QuadratureTriangle& of, const SurfacePart& some,
                                    std::uint32_t&) { return distance(of, some); };
    const auto weight = [](const SurfacePart&) { return 1.0; };
    add_shares(facet, part, tolerances_m_, quarterings_, distance_of, weight, lot.shares);
  }

  /// Divides suspects into four until the bounds are within 1 %, or there are too many suspects.
  void narrow(TrueLot& lot) const {
    constexpr int most_rounds = 30;
    lot.settle();
    for (int round = 0; round < most_rounds && lot.suspects.size() < most_suspects; ++round) {
      const std::vector<TrueSuspect> before = std::exchange(lot.suspects, {});
      std::vector<std::array<PartDistance, 4>> found(before.size());
      std::vector<std::array<SurfacePart, 4>> quarters(before.size());
      tbb::parallel_for(std::size_t{0}, before.size(), [&](std::size_t i) {
        const QuadratureTriangle facet(mesh_, before[i].part.triangle);
        quarters[i] = before[i].part.quarters(facet);
        for (std::size_t k = 0; k < 4; ++k) found[i][k] = distance(facet, quarters[i][k]);
      });
      for (std::size_t i = 0; i < before.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) lot.see(quarters[i][k], found[i][k]);
      }
      lot.settle();
    }
    for (const TrueSuspect& suspect : lot.suspects)
      lot.at_most_m = std::max(lot.at_most_m, suspect.at_most_m);
  }

 private:
  const TriangleMesh& mesh_;
  const TrueSurface& truth_;
  std::span<const double> tolerances_m_;
  unsigned quarterings_;
  double rounding_m_ = 0;
};

double area_of(const TriangleMesh& mesh) {
  double area_m2 = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    area_m2 += QuadratureTriangle(mesh, i).area_m2;
  if (area_m2 > 0) return area_m2;
  throw Error("mesh: all triangles are degenerate, so there is no mean over its area");
}

void check_truth(const TrueSurface& truth) {
  if (!truth.distance_m) throw Error("true surface: distance_m must be given");
  if (!(truth.most_change > 0) || !std::isfinite(truth.most_change))
    throw Error("true surface: most_change = {} must be positive and finite", truth.most_change);
}

}  // namespace

TrueSurface true_sphere(const glm::dvec3& centre_m, double radius_m) {
  check_radius(radius_m);
  return {.distance_m =
              [=](const glm::dvec3& p) { return std::abs(glm::distance(p, centre_m) - radius_m); },
          .normal = [=](const glm::dvec3& p) { return p - centre_m; }};
}

TrueSurface true_plane(const glm::dvec3& point_m, const glm::dvec3& normal) {
  const glm::dvec3 n = direction_of(normal, "normal");
  return {.distance_m = [=](const glm::dvec3& p) { return std::abs(glm::dot(p - point_m, n)); },
          .normal = [=](const glm::dvec3&) { return n; }};
}

TrueSurface true_cylinder(const glm::dvec3& point_m, const glm::dvec3& axis, double radius_m) {
  check_radius(radius_m);
  const glm::dvec3 along = direction_of(axis, "axis");
  const auto across = [=](const glm::dvec3& p) {
    return p - point_m - glm::dot(p - point_m, along) * along;
  };
  return {.distance_m =
              [=](const glm::dvec3& p) { return std::abs(glm::length(across(p)) - radius_m); },
          .normal = across};
}

TrueSurface true_heights(std::function<double(double, double)> height_m, double steepest,
                         std::function<glm::dvec2(double, double)> gradient) {
  if (!(steepest >= 0) || !std::isfinite(steepest))
    throw Error("true surface: steepest = {} must be 0 or more, and finite", steepest);
  TrueSurface truth{.most_change = math::hypot(1, steepest)};
  truth.distance_m = [height = std::move(height_m)](const glm::dvec3& p) {
    return std::abs(p.z - height(p.x, p.y));
  };
  if (gradient) {
    truth.normal = [slope = std::move(gradient)](const glm::dvec3& p) {
      const glm::dvec2 rise = slope(p.x, p.y);
      return glm::dvec3(-rise.x, -rise.y, 1);
    };
  }
  return truth;
}

TrueDistance true_distance(const TriangleMesh& mesh, const TrueSurface& truth,
                           std::span<const double> tolerances_m, const ShareFineness& fineness) {
  check_mesh(mesh, "mesh", EmptyMesh::Refuse);
  check_truth(truth);
  if (!tolerances_m.empty()) check_tolerances(tolerances_m);
  check_quarterings(fineness.quarterings);
  const double area_m2 = area_of(mesh);
  constexpr double samples = 1e5;
  const double step_m = fineness.step_m == 0 ? SurfaceParts::widened_m(
                                                   mesh, std::sqrt(2 * area_m2 / samples), samples)
                                             : fineness.step_m;
  const SurfaceParts parts(mesh, step_m);
  const TrueMeasure measure(mesh, truth, tolerances_m, fineness.quarterings);
  const auto visit = [&](const QuadratureTriangle& facet, const SurfacePart& part, TrueLot& lot) {
    measure.add(facet, part, lot);
  };
  TrueLot total;
  parts.sum_up(TrueLot(), visit, [&](const TrueLot& lot) { total.take(lot); });
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k)
      total.at_least_m = std::max(total.at_least_m, measure.distance_at(mesh.vertices_m[t[k]]));
  }
  measure.narrow(total);
  const double rounding_m = measure.rounding_m();
  const DistanceSums::Means means = total.sums.means(rounding_m, parts.sum_rounding());
  TrueDistance found{.at_least_m = std::max(0.0, total.at_least_m - rounding_m),
                     .at_most_m = std::max(total.at_most_m, total.at_least_m + rounding_m),
                     .mean = means.mean,
                     .rms = means.rms,
                     .turn = total.turn,
                     .area_m2 = area_m2,
                     .samples = total.sums.samples};
  if (!tolerances_m.empty()) found.within = total.shares.shares(parts.sum_rounding());
  return found;
}

}  // namespace groundray
