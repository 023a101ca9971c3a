#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <variant>
#include <vector>

#include "reconstruction/mesh/accuracy/agreement.h"
#include "reconstruction/mesh/accuracy/vertical_error.h"
#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Stopping criterion: no vertex of the original may be farther than `error_m` above or below the
/// result, nor its boundary, in plan view, farther than `border_m` from the result's. For terrain:
/// no triangle may overhang, and none does in the result. A vertex beyond the result's boundary is
/// measured at the nearest boundary point in plan view, at most `border_m` away; where parts of the
/// surface overlap or touch, as in VerticalDistance. Each result is measured in this way at every
/// vertex, so the bound holds except for rounding.
struct VerticalBound {
  double error_m = 0;
  double border_m = 0;
  /// Returns whether the result may have a new edge between two vertices of the mesh, given by
  /// number; any, if it is empty.
  std::function<bool(std::uint32_t, std::uint32_t)> may_join{};
};

/// Stopping criterion: no point of either surface may be farther than `error_m` from the other, nor
/// any boundary vertex farther than `border_m` from the other's boundary. Each result is proved,
/// between vertices as well.
struct DistanceBound {
  double error_m = 0;
  double border_m = 0;
};

/// Stopping criterion: a number of triangles, or one fewer; more if no permitted collapse is left.
/// The error is not bounded. Uses `reduce`, or quadrics if the mesh has labels whose boundaries are
/// kept.
struct FaceBudget {
  std::size_t triangles = 0;
};

/// Stopping criterion: the error reaches `sds` standard deviations of the measurements; finer
/// detail is noise. The distance of each original vertex from the result is at most `sds` of its
/// own standard deviations: vertically, as for VerticalBound, if no triangle overhangs. Otherwise
/// in any direction, and the same bound holds for every other point of both surfaces, with the
/// standard deviations of the vertices there. Boundaries likewise.
struct NoiseBound {
  double sds = 2;
};

/// Stopping criterion: the knee of cost over number of triangles, both as logarithms: the point
/// farthest from the straight line between the points where half of the triangles are left, or
/// where cost begins, and where a thousandth is left. Cost is the mean squared distance by
/// quadrics. Takes two runs, one of them to the end. Where roughness is similar at all scales,
/// prefer a bound.
/// @see Satopaa, Albrecht, Irwin, Raghavan, Finding a "kneedle" in a haystack, ICDCS (2011).
struct CostKnee {};

/// Stopping criterion of a simplification.
using StopCriterion = std::variant<VerticalBound, DistanceBound, FaceBudget, NoiseBound, CostKnee>;

/// Treatment of edges between labels: kept in place, or ignored.
enum class LabelBorders { Keep, Ignore };

/// Further options of a simplification.
struct SimplifyOptions {
  /// Angle between the normals of two triangles above which their edge is a crease, rad; pi for
  /// none. Creases stay edges, within the error; under a NoiseBound only if they are deeper than
  /// noise. Not used by `reduce`.
  double crease_rad = std::numbers::pi / 3;
  /// Treatment of edges on either side of a change of label: if kept, they stay within `border_m`.
  LabelBorders labels = LabelBorders::Keep;
  /// Resolution of the error measured afterwards.
  ErrorFineness fineness{.samples = 2e4, .most_pieces = 20'000};
};

/// Reason why simplification stopped.
enum class HaltReason {
  Bound,   ///< every further collapse would violate a bound, move a kept line beyond its bound, or
           ///< fail as under Shape; also if only Shape remains
  Budget,  ///< requested number of triangles reached
  Knee,    ///< the knee was reached
  Shape    ///< every further collapse would flip triangles or change the topology
};

/// Returns the word used in reports: "bound", "budget", "knee" or "shape".
const char* word_of(HaltReason reason);

/// Faults of the mesh that were repaired first.
struct MeshRepairs {
  std::size_t dropped_triangles = 0;  ///< repeated a vertex or another triangle
  std::size_t unused_vertices = 0;    ///< used by no triangle
  std::size_t cut_edges = 0;          ///< non-manifold or inconsistently wound, cut open
  std::size_t parted_vertices = 0;    ///< added where surfaces touched at a point or were cut
};

/// Simplified mesh. Except with `reduce`, vertices keep their positions.
struct Simplified {
  MeasuredMesh mesh;                   ///< manifold, every vertex in use; without levels
  std::vector<std::uint32_t> sources;  ///< of each vertex: original vertex, or the nearest one
  HaltReason halted_by = HaltReason::Bound;
  MeshRepairs repairs;
  /// Number of runs. With a DistanceBound, runs are repeated until the whole result is proved; one
  /// suffices except for rounding, because each collapse is proved. With a vertical bound, until
  /// all vertices are measured to be within it; one suffices unless a boundary moves over vertices
  /// that another withdrew from. After 20 runs without success, the mesh is not simplified.
  std::size_t rounds = 1;
  TwoSidedError error;  ///< `forth` from the original to the result, `back` from the result
  /// Vertical distances of the original's vertices from the result; for terrain without overhangs
  /// before and after.
  std::optional<VerticalError> vertical;
};

/// Simplifies a mesh by collapsing edges, cheapest first, until the criterion `stop` is met. Equal
/// meshes give identical bytes for any number of threads.
/// @param work  progress is reported between collapses; takes up to 400 bytes per triangle and
///              520 per vertex.
/// @throws Error listing every fault of the mesh, as check_mesh, of its columns, of `stop` and of
///         `options`; if a triangle overhangs under a VerticalBound; if there are no standard
///         deviations under a NoiseBound; if the surface has no area; or if more memory is needed
///         than `work` allows.
/// @see docs/theory/reconstruction.md; Garland, Heckbert, Surface simplification using quadric
///      error metrics, SIGGRAPH (1997): the order. Ciampalini, Cignoni, Montani, Scopigno,
///      Multiresolution decimation based on global error, The Visual Computer 13 (1997): the
///      original is kept with the triangles that represent it.
Simplified simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options = {}, const RunControl& work = {});

}  // namespace groundray
