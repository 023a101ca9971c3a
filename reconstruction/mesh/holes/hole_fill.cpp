#include "reconstruction/mesh/holes/hole_fill.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/math.h"
#include "reconstruction/mesh/holes/hole_patch.h"
#include "reconstruction/mesh/holes/mesh_boundary.h"
#include "reconstruction/mesh/holes/placed_patch.h"
#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {
namespace {

// Boundary within the limits, and the patch that closes it.
struct Candidate {
  std::size_t loop = 0;              // number of the boundary
  BridgedBoundary bridged;           // the boundary, joined with pieces of surface inside it
  std::vector<std::size_t> islands;  // numbers of these pieces' outlines
  std::optional<HolePatch> patch;
  std::vector<std::uint32_t> boundary;  // vertices, in the patch's order
  std::vector<std::uint32_t> crossed;
  PatchShape shape = PatchShape::Smooth;
  bool is_done = false;
  HoleLeft why = HoleLeft::NoFilling;  // valid unless is_done
};

HoleBoundary boundary_of(const SurfaceMesh& surface, const BoundaryLoop& loop) {
  HoleBoundary boundary{.vertices = vertices_of(surface, loop)};
  for (const auto h : loop) {
    const glm::dvec3 &a = surface.point(surface.from_vertex_handle(h)),
                     &b = surface.point(surface.to_vertex_handle(h));
    const double length_m = glm::distance(a, b);
    boundary.length_m += length_m;
    boundary.middle_m += length_m * 0.5 * (a + b);
  }
  boundary.middle_m = boundary.length_m > 0
                          ? boundary.middle_m / boundary.length_m
                          : surface.point(surface.from_vertex_handle(loop.front()));
  return boundary;
}

// Returns true if the surface along the boundary is oriented like a sheet inside it.
bool is_outline(const SurfaceMesh& surface, const BoundaryLoop& loop,
                const HoleBoundary& boundary) {
  glm::dvec3 area(0), facing(0);
  for (const auto h : loop) {
    const auto inner = surface.opposite_halfedge_handle(h);
    const auto from_middle = [&](auto vertex) { return surface.point(vertex) - boundary.middle_m; };
    const glm::dvec3 a = from_middle(surface.from_vertex_handle(inner));
    const glm::dvec3 b = from_middle(surface.to_vertex_handle(inner));
    const glm::dvec3 c = from_middle(surface.to_vertex_handle(surface.next_halfedge_handle(inner)));
    area += glm::cross(a, b);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double size = glm::length(normal);
    if (size > 0) facing += glm::length(b - a) / size * normal;
  }
  constexpr double cosine = 0.5;  // of 60 degrees
  return glm::dot(area, facing) > cosine * glm::length(area) * boundary.length_m;
}

std::optional<HoleLeft> why_left(const SurfaceMesh& surface, const BoundaryLoop& loop,
                                 const HoleBoundary& boundary, const HoleLimits& limits) {
  const auto is_tangled = [&](auto h) {
    return surface.status(surface.opposite_halfedge_handle(h)).tagged();
  };
  if (loop.size() < 3 || std::ranges::any_of(loop, is_tangled)) return HoleLeft::NotManifold;
  if (is_outline(surface, loop, boundary)) return HoleLeft::Outline;
  if (boundary.length_m > limits.longest_m) return HoleLeft::TooLong;
  if (loop.size() > limits.most_edges) return HoleLeft::TooManyEdges;
  return std::nullopt;
}

// Reports the fraction done, from one thread at a time.
class Progress {
 public:
  Progress(const RunControl* work, std::size_t total) : work_(work), total_(total) {}

  void one_more() {
    if (work_ == nullptr || !work_->progress) return;
    const std::scoped_lock lock(mutex_);
    work_->progress(std::min(1.0, static_cast<double>(++done_) / static_cast<double>(total_)));
  }

 private:
  const RunControl* work_;  // nullptr: nothing is reported
  std::size_t total_, done_ = 0;
  std::mutex mutex_;
};

// Fills the holes of one mesh.
class Filler {
 public:
  Filler(MeasuredMesh& mesh, const HoleLimits& limits, const RunControl& work)
      : mesh_(mesh),
        limits_(limits),
        work_(work),
        surface_(to_surface(mesh.shape)),
        loops_(find_boundary(surface_)),
        stars_(stars_of(surface_)) {}

  void fill(FilledMesh& out) {
    std::vector<Candidate> candidates = sort_out();
    std::vector<Task> tasks;
    for (Candidate& candidate : candidates) tasks.push_back({&candidate, &loops_[candidate.loop]});
    close(candidates, tasks, {mesh_.shape, surface_, stars_});
    constexpr int rounds = 3;  // a patch that avoids one piece may intersect another
    for (int round = 0; round < rounds && join_islands(candidates); ++round) {
    }
    report(candidates, out);
  }

 private:
  // Candidate and the boundary to close.
  struct Task {
    Candidate* candidate;
    const BoundaryLoop* loop;
  };

  // Returns the candidates, shortest boundary first: of patches in conflict, the one with the
  // shorter boundary stays.
  std::vector<Candidate> sort_out() {
    std::vector<std::size_t> holes;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      boundaries_.push_back(boundary_of(surface_, loops_[i]));
      why_.push_back(why_left(surface_, loops_[i], boundaries_[i], limits_));
      if (!why_[i]) holes.push_back(i);
    }
    std::ranges::stable_sort(holes, {}, [&](std::size_t i) { return boundaries_[i].length_m; });
    std::vector<Candidate> candidates;
    for (const std::size_t i : holes)
      candidates.push_back({.loop = i, .bridged = {boundaries_[i].vertices, {}}});
    return candidates;
  }

  void close(std::vector<Candidate>& candidates, std::span<const Task> tasks,
             const AdjacentMesh& at) {
    for (const PatchShape shape : {PatchShape::Smooth, PatchShape::Flat}) {
      Progress progress(is_begun_ ? nullptr : &work_, tasks.size());
      is_begun_ = true;
      tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t i) {
        if (!tasks[i].candidate->is_done) make_patch(tasks[i], at, shape);
        progress.one_more();
      });
      keep_fitting(candidates);
    }
  }

  static void make_patch(const Task& task, const AdjacentMesh& at, PatchShape shape) {
    Candidate& candidate = *task.candidate;
    candidate.boundary = vertices_of(at.surface, *task.loop);
    candidate.shape = shape;
    candidate.patch = patch_hole(at, *task.loop, shape);
    if (!candidate.patch) return;
    const auto number = [&](std::uint32_t vertex) {
      return static_cast<std::uint32_t>(std::ranges::find(candidate.boundary, vertex) -
                                        candidate.boundary.begin());
    };
    for (const glm::uvec3& t : candidate.bridged.bridges)
      candidate.patch->triangles.emplace_back(number(t.x), number(t.y), number(t.z));
  }

  void keep_fitting(std::vector<Candidate>& candidates) {
    std::vector<PlacedPatch> kept, tried;
    std::vector<Candidate*> owners;  // of `tried`
    for (Candidate& candidate : candidates) {
      if (!candidate.patch) continue;
      (candidate.is_done ? kept : tried).push_back({&*candidate.patch, candidate.boundary});
      if (!candidate.is_done) owners.push_back(&candidate);
    }
    if (tried.empty()) return;
    const std::vector<Fit> fits = find_fitting(mesh_.shape, stars_, kept, tried);
    for (std::size_t i = 0; i < owners.size(); ++i) {
      owners[i]->is_done = fits[i].is_good;
      owners[i]->crossed = fits[i].crossed;
      owners[i]->why = HoleLeft::Crossing;
    }
  }

  // Retries candidates whose patches intersected pieces of surface inside the hole, with these
  // joined to the boundary.
  bool join_islands(std::vector<Candidate>& candidates) {
    std::vector<Candidate*> again;
    for (Candidate& candidate : candidates) {
      if (!candidate.is_done && !candidate.crossed.empty() && take_islands(candidate))
        again.push_back(&candidate);
      if (!candidate.is_done) candidate.patch.reset();
    }
    if (again.empty()) return false;
    surface_.clear();  // no longer used: leaves its memory to the next
    TriangleMesh mesh = mesh_.shape;
    std::vector<Candidate*> owners;  // of the bridge triangles
    for (Candidate* candidate : again) {
      const auto& bridges = candidate->bridged.bridges;
      mesh.triangles.insert(mesh.triangles.end(), bridges.begin(), bridges.end());
      owners.resize(owners.size() + bridges.size(), candidate);
    }
    SurfaceMesh surface = to_surface(mesh);
    const std::vector<BoundaryLoop> loops = find_boundary(surface);
    const std::size_t first = mesh_.shape.triangles.size();  // of the bridges
    std::vector<Task> tasks;
    for (const BoundaryLoop& loop : loops) {
      const auto found =
          std::ranges::find_if(loop, [&](auto h) { return triangle_across(surface, h) >= first; });
      if (found == loop.end()) continue;
      Candidate* candidate = owners[triangle_across(surface, *found) - first];
      if (loop.size() == candidate->bridged.vertices.size()) tasks.push_back({candidate, &loop});
    }
    close(candidates, tasks, {mesh, surface, stars_of(surface)});
    return true;
  }

  // Joins the pieces that a patch intersected to its boundary. Returns false if none can be joined.
  bool take_islands(Candidate& candidate) {
    if (pieces_.empty()) number_outlines();
    const std::uint32_t own = piece_at_[candidate.loop];
    std::set<std::uint32_t> met;
    for (const std::uint32_t t : candidate.crossed) {
      if (pieces_[t] != own) met.insert(pieces_[t]);
    }
    bool is_joined = false;
    for (const std::uint32_t piece : met) {
      const std::size_t outline = outlines_[piece];
      if (outline == no_outline) continue;
      auto bridged = bridge(mesh_.shape, stars_, candidate.bridged, boundaries_[outline].vertices);
      if (!bridged || bridged->vertices.size() > limits_.most_edges) continue;
      candidate.bridged = std::move(*bridged);
      candidate.islands.push_back(outline);
      outlines_[piece] = no_outline;  // no longer available
      is_joined = true;
    }
    return is_joined;
  }

  // Finds the outline of each piece that has exactly one.
  void number_outlines() {
    pieces_ = number_pieces(surface_);
    for (const BoundaryLoop& loop : loops_)
      piece_at_.push_back(pieces_[triangle_across(surface_, loop.front())]);
    const std::uint32_t count = *std::ranges::max_element(pieces_) + 1;
    outlines_.assign(count, no_outline);
    std::vector<int> found(count, 0);
    for (std::size_t i = 0; i < why_.size(); ++i) {
      const std::uint32_t piece = piece_at_[i];
      if (why_[i] == HoleLeft::Outline) outlines_[piece] = ++found[piece] == 1 ? i : no_outline;
    }
  }

  // Appends the attributes of a patch's points.
  void append_measures(const Candidate& candidate) {
    const auto& vertices_m = mesh_.shape.vertices_m;
    for (const glm::dvec3& p : candidate.patch->points_m) {
      const std::uint32_t nearest = *std::ranges::min_element(
          candidate.boundary, {}, [&](std::uint32_t v) { return glm::distance(vertices_m[v], p); });
      const double apart_m = glm::distance(vertices_m[nearest], p);
      if (!mesh_.sd_m.empty())
        mesh_.sd_m.push_back(static_cast<float>(math::hypot(mesh_.sd_m[nearest], apart_m / 3)));
      if (!mesh_.labels.empty()) mesh_.labels.push_back(mesh_.labels[nearest]);
      if (!mesh_.confidence.empty()) mesh_.confidence.push_back(0);
    }
  }

  FilledHole added(const Candidate& candidate) {
    const auto first_vertex = static_cast<std::uint32_t>(mesh_.shape.vertices_m.size());
    const auto first_triangle = static_cast<std::uint32_t>(mesh_.shape.triangles.size());
    append(mesh_.shape, {&*candidate.patch, candidate.boundary});
    append_measures(candidate);
    return {.boundary = boundaries_[candidate.loop],
            .first_vertex = first_vertex,
            .vertices = static_cast<std::uint32_t>(candidate.patch->points_m.size()),
            .first_triangle = first_triangle,
            .triangles = static_cast<std::uint32_t>(candidate.patch->triangles.size()),
            .islands = static_cast<std::uint32_t>(candidate.islands.size()),
            .is_smooth = candidate.shape == PatchShape::Smooth};
  }

  void report(const std::vector<Candidate>& candidates, FilledMesh& out) {
    out.measured_vertices = mesh_.shape.vertices_m.size();
    out.measured_triangles = mesh_.shape.triangles.size();
    std::vector<const Candidate*> by_loop;
    for (const Candidate& candidate : candidates) by_loop.push_back(&candidate);
    std::ranges::sort(by_loop, {}, &Candidate::loop);
    for (const Candidate* const candidate : by_loop) {
      if (candidate->is_done) {
        out.filled.push_back(added(*candidate));
        for (const std::size_t outline : candidate->islands) why_[outline].reset();
      } else {
        why_[candidate->loop] = candidate->why;
      }
    }
    for (std::size_t i = 0; i < why_.size(); ++i) {
      if (why_[i]) out.left.push_back({std::move(boundaries_[i]), *why_[i]});
    }
  }

  MeasuredMesh& mesh_;
  const HoleLimits& limits_;
  const RunControl& work_;
  SurfaceMesh surface_;
  std::vector<BoundaryLoop> loops_;
  Buckets stars_;                             // of the surface
  std::vector<HoleBoundary> boundaries_;      // of each loop
  std::vector<std::optional<HoleLeft>> why_;  // of each loop
  static constexpr std::size_t no_outline = std::numeric_limits<std::size_t>::max();
  std::vector<std::uint32_t> pieces_;    // piece of each triangle
  std::vector<std::uint32_t> piece_at_;  // of each loop: the piece that ends there
  std::vector<std::size_t> outlines_;    // of each piece: its only outline, or no_outline
  bool is_begun_ = false;
};

void check(const MeasuredMesh& mesh, const HoleLimits& limits, const RunControl& work) {
  check_mesh(mesh.shape, "mesh to fill", EmptyMesh::Allow);
  Violations broken("filling holes");
  check_columns(mesh, broken);
  broken.unless(limits.longest_m >= 0, "longest_m = {} must be 0 (fill nothing) or more",
                limits.longest_m);
  // Measured, with islands: 293 per triangle of a grid, 594 of separate triangles.
  const std::size_t bytes = 240 * mesh.shape.triangles.size() + 120 * mesh.shape.vertices_m.size();
  broken.unless(bytes <= work.most_bytes,
                "{} triangles take about {} MB, more than the {} MB allowed; allow more memory or "
                "split the mesh",
                mesh.shape.triangles.size(), bytes / 1'000'000, work.most_bytes / 1'000'000);
  broken.throw_if_any();
}

}  // namespace

FilledMesh fill_holes(MeasuredMesh mesh, const HoleLimits& limits, const RunControl& work) {
  check(mesh, limits, work);
  FilledMesh out;
  mesh.shape.levels.clear();
  Filler(mesh, limits, work).fill(out);
  out.mesh = std::move(mesh);
  work.report(1);
  return out;
}

}  // namespace groundray
