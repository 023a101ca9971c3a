#include "reconstruction/mesh/simplify/simplify.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "core/error.h"
#include "reconstruction/mesh/mesh_arrays.h"
#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/distance_proof.h"
#include "reconstruction/mesh/simplify/distance_rules.h"
#include "reconstruction/mesh/simplify/edge_collapse.h"
#include "reconstruction/mesh/simplify/lindstrom_turk.h"
#include "reconstruction/mesh/simplify/simplify_original.h"
#include "reconstruction/mesh/simplify/vertical_rules.h"
#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {
namespace {

constexpr double line_weight = 1;         // where lines are not bounded
constexpr std::size_t most_rounds = 20;   // until a proof succeeds
constexpr std::size_t steps_each = 1024;  // per call of progress

/// Part of the work, which reports its progress as a fraction of the whole.
struct Stage {
  const RunControl& work;
  double begin = 0, end = 1;

  void tell(double share) const { work.report(begin + share * (end - begin)); }
};

/// Simplifies one mesh, with a method for each stopping criterion.
class Simplifier {
 public:
  Simplifier(const MeasuredMesh& mesh, const SimplifyOptions& options, const RunControl& work)
      : original_(mesh), options_(options), work_(work) {}

  Simplified operator()(const VerticalBound& stop) const {
    VerticalRules::MayJoin may_join;
    if (stop.may_join) {
      may_join = [&](std::uint32_t a, std::uint32_t b) {
        return stop.may_join(original_.sources()[a], original_.sources()[b]);
      };
    }
    return bounded_above(original_.equal(stop.error_m, stop.border_m), may_join);
  }
  Simplified operator()(const DistanceBound& stop) const;
  Simplified operator()(const FaceBudget& stop) const;
  Simplified operator()(const NoiseBound& stop) const {
    const Tolerances tolerances = original_.noise(stop.sds);
    if (!original_.hangs_over()) return bounded_above(tolerances);
    return result_of(remaining_mesh(bounded_around(tolerances, {work_}).mesh), HaltReason::Bound);
  }
  Simplified operator()(const CostKnee& stop) const;

 private:
  Simplified bounded_above(const Tolerances& tolerances,
                           const VerticalRules::MayJoin& may_join = {}) const;
  DecimationState bounded_around(const Tolerances& tolerances, const Stage& stage) const;
  DecimationState free_piece() const { return original_.state(options_, original_.equal(0, 0)); }
  std::vector<CostStep> collapse_to(DecimationState& piece, std::size_t triangles,
                                    const Stage& stage) const;
  bool tighten(const TriangleMesh& local, double error_m, double share,
               Tolerances& tolerances) const;
  bool keep_covered(const std::vector<VerticalDistance>& distances, const Tolerances& tolerances,
                    std::vector<bool>& stay_covered) const;
  Simplified result_of(const RemainingMesh& remainder, HaltReason reason,
                       std::optional<VerticalError> vertical = {}) const;
  Simplified measured(Simplified result, TriangleMesh local) const;

  SimplifyOriginal original_;
  const SimplifyOptions& options_;
  const RunControl& work_;
};

void run(EdgeCollapse& collapse, const Stage& stage) {
  for (std::size_t steps = 0; collapse.step(); ++steps) {
    if (steps % steps_each == 0) stage.tell(collapse.share());
  }
}

// Marks vertices that are too far above or below a result. Returns true if there is none.
bool Simplifier::keep_covered(const std::vector<VerticalDistance>& distances,
                              const Tolerances& tolerances, std::vector<bool>& stay_covered) const {
  const double rounding_m = 1e-12 * original_.size_m();
  bool is_near = true;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const auto tolerance_m = static_cast<double>(tolerances.each_m[i]);
    if (distances[i].above_m <= (1 + 1e-9) * tolerance_m + rounding_m) continue;
    stay_covered[i] = true;
    is_near = false;
  }
  return is_near;
}

// A vertex that a boundary withdrew from is stored with that boundary, but another boundary may
// have come nearer. Each round therefore starts anew, and boundaries do not withdraw from vertices
// that were too far in earlier rounds, nor, in the last round, from any.
Simplified Simplifier::bounded_above(const Tolerances& tolerances,
                                     const VerticalRules::MayJoin& may_join) const {
  const std::vector<glm::dvec3>& places_m = original_.surface().mesh().vertices_m;
  std::vector<bool> stay_covered(places_m.size());
  double begin = 0;
  for (std::size_t round = 1; round < most_rounds; ++round) {
    const double end = 0.9 + 0.1 * begin;
    DecimationState piece = original_.state(options_, tolerances);
    VerticalRules rules(piece, tolerances.border_m, stay_covered, original_.rounding_m(), may_join);
    EdgeCollapse collapse(piece, rules, 0);
    run(collapse, {work_, begin, end});
    const RemainingMesh remainder = remaining_mesh(piece.mesh);
    const auto distances = vertical_distances(places_m, remainder.mesh);
    if (keep_covered(distances, tolerances, stay_covered)) {
      Simplified result = result_of(remainder, HaltReason::Bound, sum_up(distances));
      result.rounds = round;
      return result;
    }
    if (round + 2 == most_rounds) stay_covered.assign(places_m.size(), true);
    begin = end;
  }
  Simplified result = result_of(remaining_mesh(free_piece().mesh), HaltReason::Bound);
  result.rounds = most_rounds;
  return result;
}

DecimationState Simplifier::bounded_around(const Tolerances& tolerances, const Stage& stage) const {
  DecimationState piece = original_.state(options_, tolerances);
  DistanceRules rules(piece, original_.surface(), tolerances.border_m);
  EdgeCollapse collapse(piece, rules, 0);
  run(collapse, stage);
  return piece;
}

// Lowers tolerances where a result is not proved to be near enough, in both directions. Returns
// true if it is proved everywhere.
bool Simplifier::tighten(const TriangleMesh& local, double error_m, double share,
                         Tolerances& tolerances) const {
  const ClosestPoint result(local);
  const std::vector<glm::uvec3>& triangles = original_.surface().mesh().triangles;
  const auto lower = [&](const Beyond& beyond, std::uint32_t triangle) {
    // A small excess could recur if the tolerance were lowered by no more than that.
    const double lower_m = std::max(2 * (beyond.distance_m - error_m), share * error_m);
    const glm::uvec3& t = triangles[triangle];
    for (int k = 0; k < 3; ++k) {
      float& tolerance_m = tolerances.each_m[t[k]];
      const double before_m = static_cast<double>(tolerance_m);
      tolerance_m = static_cast<float>(std::max(before_m - lower_m, 0.5 * before_m));
    }
  };
  const std::vector<Beyond> forth = find_beyond(original_.surface().mesh(), result, error_m);
  for (const Beyond& beyond : forth) lower(beyond, beyond.triangle);
  const std::vector<Beyond> back = find_beyond(local, original_.surface(), error_m);
  for (const Beyond& beyond : back) lower(beyond, beyond.nearest);
  return forth.empty() && back.empty();
}

// Each round starts anew, with tolerances that the previous round showed to be necessary. If that
// does not converge, all are lowered.
Simplified Simplifier::operator()(const DistanceBound& stop) const {
  Tolerances tolerances = original_.equal(stop.error_m, stop.border_m);
  double begin = 0;
  for (std::size_t round = 1; round <= most_rounds; ++round) {
    const double end = 0.5 * (1 + begin);
    const RemainingMesh remainder =
        remaining_mesh(bounded_around(tolerances, {work_, begin, end}).mesh);
    if (tighten(remainder.mesh, stop.error_m, 0.03 * static_cast<double>(round), tolerances)) {
      Simplified result = result_of(remainder, HaltReason::Bound);
      result.rounds = round;
      for (OneSidedError* way : {&result.error.forth, &result.error.back})
        way->at_most_m = std::min(way->at_most_m, stop.error_m);
      return result;
    }
    if (2 * round > most_rounds) {
      for (float& tolerance_m : tolerances.each_m) tolerance_m *= 0.5f;
    }
    begin = end;
  }
  Simplified result = result_of(remaining_mesh(free_piece().mesh), HaltReason::Bound);
  result.rounds = most_rounds;
  return result;
}

// Collapses edges down to a number of triangles, regardless of cost.
std::vector<CostStep> Simplifier::collapse_to(DecimationState& piece, std::size_t triangles,
                                              const Stage& stage) const {
  ShapeRules rules(piece, original_.hangs_over() ? Overhang::Allow : Overhang::Refuse);
  EdgeCollapse collapse(piece, rules, line_weight);
  const double rounding_m2 = 1e-15 * original_.size_m() * original_.size_m();
  std::vector<CostStep> steps{{0, piece.triangles}};
  while (piece.triangles > triangles && collapse.step()) {
    const double cost = collapse.mean_square_m2();
    steps.push_back({cost > rounding_m2 ? cost : 0, piece.triangles});
    if (steps.size() % steps_each == 0) {
      const double all = static_cast<double>(steps.front().triangles - triangles);
      stage.tell(static_cast<double>(steps.front().triangles - piece.triangles) / all);
    }
  }
  return steps;
}

Simplified Simplifier::operator()(const CostKnee&) const {
  std::vector<CostStep> steps;
  {
    DecimationState piece = free_piece();
    steps = collapse_to(piece, 1, {work_, 0, 0.5});
  }
  const std::size_t knee = find_knee(steps);
  DecimationState piece = free_piece();
  collapse_to(piece, knee, {work_, 0.5, 1});
  const bool is_end = knee == steps.back().triangles;
  return result_of(remaining_mesh(piece.mesh), is_end ? HaltReason::Shape : HaltReason::Knee);
}

Simplified Simplifier::operator()(const FaceBudget& stop) const {
  const std::vector<std::uint16_t>& labels = original_.mesh().labels;
  const bool has_labels =
      std::adjacent_find(labels.begin(), labels.end(), std::not_equal_to<>()) != labels.end();
  const auto reason = [&](std::size_t triangles) {
    return triangles <= stop.triangles ? HaltReason::Budget : HaltReason::Shape;
  };
  if (has_labels && options_.labels == LabelBorders::Keep) {
    DecimationState piece = free_piece();
    collapse_to(piece, stop.triangles, {work_});
    return result_of(remaining_mesh(piece.mesh), reason(piece.triangles));
  }
  ReducedMesh reduced = reduce(original_.mesh().shape, stop.triangles, work_);
  Simplified result{.sources = std::move(reduced.sources),
                    .halted_by = reason(reduced.mesh.triangles.size()),
                    .repairs = original_.repairs()};
  TriangleMesh local = original_.localised(reduced.mesh);
  result.mesh.shape = std::move(reduced.mesh);
  return measured(std::move(result), std::move(local));
}

Simplified Simplifier::result_of(const RemainingMesh& remainder, HaltReason reason,
                                 std::optional<VerticalError> vertical) const {
  Simplified result{.sources = picked(original_.sources(), remainder.sources),
                    .halted_by = reason,
                    .repairs = original_.repairs(),
                    .vertical = vertical};
  // Exact original positions.
  result.mesh.shape = {
      picked(original_.mesh().shape.vertices_m, result.sources), remainder.mesh.triangles, {}};
  return measured(std::move(result), remainder.mesh);
}

Simplified Simplifier::measured(Simplified result, TriangleMesh local) const {
  const MeasuredMesh& mesh = original_.mesh();
  result.mesh.sd_m = picked(mesh.sd_m, result.sources);
  result.mesh.labels = picked(mesh.labels, result.sources);
  result.mesh.confidence = picked(mesh.confidence, result.sources);
  if (!result.vertical && !original_.hangs_over() && overhanging_triangle(local) == none)
    result.vertical = vertical_error(original_.surface().mesh().vertices_m, local);
  result.error =
      two_sided_error(original_.surface(), ClosestPoint(std::move(local)), options_.fineness);
  Stage{work_}.tell(1);
  return result;
}

}  // namespace

const char* word_of(HaltReason reason) {
  constexpr std::array words{"bound", "budget", "knee", "shape"};
  return words[static_cast<std::size_t>(reason)];
}

Simplified simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options, const RunControl& work) {
  check_simplify(mesh, stop, options);
  // Measured: 594 per triangle of a grid, 1888 of separate triangles.
  const double bytes = 400 * static_cast<double>(mesh.shape.triangles.size()) +
                       520 * static_cast<double>(mesh.shape.vertices_m.size());
  if (bytes > static_cast<double>(work.most_bytes)) {
    throw Error(
        "simplify: {} triangles take about {:.0f} MB, more than the {:.0f} MB allowed: allow more "
        "memory, or split the mesh",
        mesh.shape.triangles.size(), bytes * 1e-6, static_cast<double>(work.most_bytes) * 1e-6);
  }
  if (std::holds_alternative<VerticalBound>(stop)) {
    if (const std::uint32_t bad = overhanging_triangle(mesh.shape); bad != none)
      refuse_overhang(mesh.shape, bad);
  }
  return std::visit(Simplifier(mesh, options, work), stop);
}

}  // namespace groundray
