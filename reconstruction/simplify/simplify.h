#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <variant>
#include <vector>

#include "reconstruction/accuracy/two_sided_error.h"
#include "reconstruction/accuracy/vertical_error.h"
#include "reconstruction/measured_mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// Stop before any vertex of the original is farther than this above or below the result, and its
/// border, as seen from above, farther than `border_m` from the result's. For terrain: no triangle
/// may hang over, and none does in the result. A vertex that is beyond the result's border is
/// measured at the border's nearest point in the plan, which is at most `border_m` aside; where
/// parts of the surface lie above each other or touch, as a VerticalDistance. It is so measured of
/// each result, at every vertex, and holds but for rounding.
struct VerticalBound {
  double error_m = 0;
  double border_m = 0;
};

/// Stop before any point of either surface is farther than this from the other, and any vertex of
/// either border farther than `border_m` from the other's. Proved of each result by bounds of the
/// distance between vertices as well.
struct DistanceBound {
  double error_m = 0;
  double border_m = 0;
};

/// Stop at so many triangles, or one less; with more where nothing is left that may collapse. No
/// error is bounded. As `reduce` does it; of a mesh with labels whose borders are to be kept, by
/// quadrics.
struct FaceBudget {
  std::size_t triangles = 0;
};

/// Stop where the error reaches so many standard deviations of the measurements: what is finer is
/// noise. Each vertex of the original is within so many of its own of the result: above or below
/// where no triangle hangs over, as for VerticalBound. Else in any direction, and so is every other
/// point, of both, within as many as vertices have there. Borders likewise.
struct NoiseBound {
  double sds = 2;
};

/// Stop at the knee of cost over triangles: where the logarithm of cost over that of how many
/// triangles there are is farthest from the straight line between where half of them are left, or
/// where cost begins, and where a thousandth is. Cost is the mean square of distances by quadrics.
/// Takes two runs, one of them to the end. A surface with noise has its knee where that is gone;
/// where roughness is alike at all scales it means little: give a bound instead.
/// @see Satopaa, Albrecht, Irwin, Raghavan, Finding a "kneedle" in a haystack, ICDCS (2011).
struct CostKnee {};

/// Where simplification halts.
using Halt = std::variant<VerticalBound, DistanceBound, FaceBudget, NoiseBound, CostKnee>;

/// Whether edges between labels stay where they are.
enum class LabelBorders { Keep, Ignore };

/// What is kept besides.
struct SimplifyOptions {
  /// Edges whose triangles' normals are farther apart are creases: they stay edges, within the
  /// error. Under a NoiseBound only if they are deeper than noise. Not asked by `reduce`. Pi for
  /// none.
  double crease_rad = std::numbers::pi / 3;
  /// Whether edges along either side of where labels change stay edges, within `border_m`.
  LabelBorders labels = LabelBorders::Keep;
  /// Of the error that is measured afterwards.
  ErrorFineness fineness{.samples = 2e4, .most_pieces = 20'000};
};

/// Why no more edges were collapsed.
enum class HaltReason {
  Bound,   ///< every further collapse would break a bound, move a line that is kept by more than
           ///< it, or do what Shape says; where nothing is left but Shape it is Bound as well
  Budget,  ///< there were as few triangles as asked
  Knee,    ///< the knee was reached
  Shape    ///< every further collapse would turn triangles over or change what is connected
};

/// Returns it as reports have it: "bound", "budget", "knee" or "shape".
const char* word_of(HaltReason reason);

/// What was wrong with the mesh and was put right.
struct MeshRepairs {
  std::size_t dropped_triangles = 0;  ///< that repeated a vertex or another triangle
  std::size_t unused_vertices = 0;    ///< that no triangle had
  std::size_t cut_edges = 0;          ///< of more than two triangles or wound unlike: cut open
  std::size_t parted_vertices = 0;    ///< added where surfaces touched at a point or were cut
};

/// A mesh with fewer triangles. Everything else but `reduce` leaves vertices where they were.
struct Simplified {
  MeasuredMesh mesh;                   ///< manifold, every vertex in use; without levels
  std::vector<std::uint32_t> sources;  ///< of each vertex: which of the original, or the nearest
  HaltReason halted_by = HaltReason::Bound;
  MeshRepairs repairs;
  /// Runs that it took. For a DistanceBound until a proof of the whole holds: one but for rounding,
  /// as each collapse is proved. For heights until all are measured to be within the bound: one
  /// where borders do not move over what others withdrew from. If that is not so for 20 of them
  /// nothing is simplified.
  std::size_t rounds = 1;
  TwoSidedError error;  ///< `forth` from the original to the result, `back` from there
  /// Of terrain, which hangs over neither before nor after: how far the original's vertices are
  /// above or below the result.
  std::optional<VerticalError> vertical;
};

/// Simplifies a mesh by collapsing edges, cheapest first, until `halt` says so. The same bytes for
/// equal meshes, whatever the number of threads.
/// @param work  progress is called between collapses; some 700 bytes are taken for each triangle.
/// @throws Error naming every fault of the mesh, as check_mesh, of its columns, of `halt` and
///         `options`; a triangle that hangs over under a VerticalBound; if there are no standard
///         deviations under a NoiseBound; if the surface has no area; or if more memory is needed
///         than `work` allows.
/// @see Garland, Heckbert, Surface simplification using quadric error metrics, SIGGRAPH (1997): the
///      order. Ciampalini, Cignoni, Montani, Scopigno, Multiresolution decimation based on global
///      error, The Visual Computer 13 (1997): what was is kept with the triangles that stand for
///      it.
Simplified simplify(const MeasuredMesh& mesh, const Halt& halt, const SimplifyOptions& options = {},
                    const Work& work = {});

}  // namespace groundray
