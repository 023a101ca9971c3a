#include "reconstruction/mesh/merge/zippering.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {
namespace {

constexpr double snap_share = 0.25;
constexpr std::size_t most_steps = 64;   // boundary vertices followed between two crossings
constexpr std::size_t most_in_slit = 8;  // edges
constexpr double narrow = 0.02;          // area of a slit relative to the square of its perimeter
// Largest overlap of a slit's sides, relative to the area of the connected surface; a loop around
// more is that surface's outline.
constexpr double fold_share = 1.0 / 64;

/// Vertices by the edges of a patch: see patch_edge().
using EdgeVertices = std::unordered_map<std::uint64_t, std::uint32_t>;

std::uint64_t patch_edge(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// Returns the merged mesh's vertex at each crossing; `no_vertex` where there is no boundary.
EdgeVertices put_on_border(StitchedMesh& stitched, const StitchedMesh& patch,
                           std::span<const BorderCrossing> crossings) {
  struct Stop {
    std::uint32_t from, to;
    double share;
    std::size_t crossing;
  };
  std::vector<std::uint32_t> vertices(crossings.size(), no_vertex);
  std::vector<Stop> stops;
  std::vector<double> snap_m(crossings.size());
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const BorderCrossing& crossing = crossings[i];
    if (crossing.from == no_vertex) continue;
    stops.push_back({crossing.from, crossing.to, crossing.share, i});
    snap_m[i] = snap_share * glm::distance(patch.vertices[crossing.inside].p,
                                           patch.vertices[crossing.outside].p);
  }
  std::ranges::sort(stops, [](const Stop& a, const Stop& b) {
    return std::tie(a.from, a.to, a.share, a.crossing) <
           std::tie(b.from, b.to, b.share, b.crossing);
  });
  std::vector<EdgePlace> places;
  std::vector<std::size_t> place_of(crossings.size());
  for (const Stop& stop : stops) {
    const std::uint32_t from = stop.from, to = stop.to;
    const double length_m = glm::distance(stitched.vertices[from].p, stitched.vertices[to].p);
    const double near_m = std::min(snap_m[stop.crossing], snap_share * length_m);
    const bool follows = !places.empty() && places.back().from == from && places.back().to == to;
    if (!(stop.share * length_m > near_m)) {
      vertices[stop.crossing] = from;
    } else if (!((1 - stop.share) * length_m > near_m)) {
      vertices[stop.crossing] = to;
    } else {
      if (!follows || (stop.share - places.back().share) * length_m > near_m)
        places.push_back({from, to, stop.share});
      place_of[stop.crossing] = places.size();
    }
  }
  const std::vector<std::uint32_t> added = split_edges(stitched, places);
  for (const Stop& stop : stops) {
    if (place_of[stop.crossing] > 0) vertices[stop.crossing] = added[place_of[stop.crossing] - 1];
  }
  EdgeVertices at;
  for (std::size_t i = 0; i < crossings.size(); ++i)
    at[patch_edge(crossings[i].inside, crossings[i].outside)] = vertices[i];
  return at;
}

/// Returns the half-edge of the boundary that begins at a vertex of a manifold; invalid if the
/// vertex is not on a boundary. The triangles are to its right.
SurfaceMesh::HalfedgeHandle border_at(const SurfaceMesh& surface, std::uint32_t vertex) {
  const auto h = surface.halfedge_handle(surface.vertex_handle(vertex));
  return h.is_valid() && surface.is_boundary(h) ? h : SurfaceMesh::InvalidHalfedgeHandle;
}

/// State of the corner of a triangle that differs from the other two.
enum class LoneCorner : std::uint8_t { Inside, Outside };

/// Transfers a patch's triangles to a merged mesh.
class Zippering {
 public:
  Zippering(StitchedMesh& stitched, const StitchedMesh& patch, const BorderCrossings& found)
      : quilt_(stitched),
        patch_(patch),
        covers_(found.covers),
        numbers_(patch.vertices.size(), no_vertex),
        crossings_(put_on_border(stitched, patch, found.crossings)),
        border_(surface_of(stitched)) {}

  ZipperingCounts run() {
    for (const glm::uvec3& t : patch_.triangles) add(t);
    counts_.left_out = make_manifold(quilt_);
    return counts_;
  }

 private:
  void add(const glm::uvec3& t) {
    std::array<bool, 3> is_in{};
    int inside = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      is_in[k] = covers_[t[static_cast<int>(k)]] == Cover::Inside;
      inside += is_in[k] ? 1 : 0;
    }
    if (inside == 0) {
      quilt_.triangles.emplace_back(taken(t.x), taken(t.y), taken(t.z));
    } else if (inside == 3) {
      ++counts_.covered;
    } else {
      int odd = 0;  // the corner that differs
      while (is_in[static_cast<std::size_t>(odd)] != (inside == 1)) ++odd;
      clip({t[odd], t[(odd + 1) % 3], t[(odd + 2) % 3]},
           inside == 1 ? LoneCorner::Inside : LoneCorner::Outside);
    }
  }

  /// Clips a triangle at the boundary.
  /// @param t  its first corner is the one that differs.
  void clip(const glm::uvec3& t, LoneCorner lone) {
    const std::uint32_t leaving = crossings_.at(patch_edge(t.x, t.y));
    const std::uint32_t coming = crossings_.at(patch_edge(t.z, t.x));
    if (leaving == no_vertex || coming == no_vertex) {
      quilt_.triangles.emplace_back(taken(t.x), taken(t.y), taken(t.z));
      return;
    }
    ++counts_.clipped;
    std::vector<std::uint32_t> loop;
    if (lone == LoneCorner::Inside) {
      loop = {taken(t.y), taken(t.z)};
      append_border(coming, leaving, t, loop);
    } else {
      loop = {taken(t.x)};
      append_border(leaving, coming, t, loop);
    }
    if (loop.size() >= 3) append(t, loop);
  }

  /// Appends the boundary vertices from one to another, both included, against its direction; only
  /// these two if they are not close to each other along it.
  void append_border(std::uint32_t from, std::uint32_t to, const glm::uvec3& t,
                     std::vector<std::uint32_t>& loop) const {
    const auto p = [&](std::uint32_t v) { return patch_.vertices[v].p; };
    const double most_m = 2 * (glm::distance(p(t.x), p(t.y)) + glm::distance(p(t.y), p(t.z)) +
                               glm::distance(p(t.z), p(t.x)));
    const std::size_t first = loop.size();
    double length_m = 0;
    loop.push_back(from);
    for (std::uint32_t v = from; v != to;) {
      const auto border = border_at(border_, v);
      const std::uint32_t next =
          border.is_valid() ? number_of(border_.to_vertex_handle(border)) : no_vertex;
      if (next != no_vertex)
        length_m += glm::distance(quilt_.vertices[v].p, quilt_.vertices[next].p);
      if (next == no_vertex || length_m > most_m || loop.size() - first > most_steps) {
        loop.resize(first + 1);
        loop.push_back(to);
        return;
      }
      loop.push_back(next);
      v = next;
    }
  }

  void append(const glm::uvec3& t, const std::vector<std::uint32_t>& loop) {
    std::vector<glm::dvec3> points;
    for (const std::uint32_t v : loop) points.push_back(quilt_.vertices[v].p);
    const auto p = [&](std::uint32_t v) { return patch_.vertices[v].p; };
    const glm::dvec3 normal = glm::cross(p(t.y) - p(t.x), p(t.z) - p(t.x));
    const double length = glm::length(normal);
    const LoopTriangles cut =
        triangulate_loop(points, length > 0 ? normal / length : glm::dvec3(0));
    for (const glm::uvec3& c : cut.triangles)
      quilt_.triangles.emplace_back(loop[c.x], loop[c.y], loop[c.z]);
  }

  /// Returns the number in the merged mesh of a vertex of the patch.
  std::uint32_t taken(std::uint32_t vertex) {
    if (numbers_[vertex] == no_vertex) {
      numbers_[vertex] = static_cast<std::uint32_t>(quilt_.vertices.size());
      quilt_.vertices.push_back(patch_.vertices[vertex]);
    }
    return numbers_[vertex];
  }

  StitchedMesh& quilt_;
  const StitchedMesh& patch_;
  const std::vector<Cover>& covers_;
  std::vector<std::uint32_t> numbers_;
  EdgeVertices crossings_;
  const SurfaceMesh border_;  // of the merged mesh, before triangles are added
  ZipperingCounts counts_;
};

bool is_seen(const StitchedVertex& place, std::span<const RatedSurface> seen) {
  return std::ranges::any_of(seen, [&](const RatedSurface& scan) {
    const CoverAnswer answer = scan.surface.at({place.p, place.normal, place.sd_m}, 0, 0);
    return answer.cover == Cover::Inside && !scan.refutes(answer.nearest.triangle);
  });
}

/// Closed loop of boundary edges with triangles on its right.
struct Rim {
  std::vector<std::uint32_t> vertices;
  std::vector<glm::dvec3> points;
  glm::dvec3 normal{0};  // unit, mean of the vertices'
  double area_m2 = 0;    // enclosed, as seen along the normal; negative if triangles are there

  double length_m = 0;

  Rim(const StitchedMesh& stitched, std::vector<std::uint32_t> loop) : vertices(std::move(loop)) {
    for (const std::uint32_t v : vertices) {
      points.push_back(stitched.vertices[v].p);
      normal += stitched.vertices[v].normal;
    }
    if (const double length = glm::length(normal); length > 0) normal /= length;
    for (std::size_t i = 0; i < points.size(); ++i)
      length_m += glm::distance(points[i], points[(i + 1) % points.size()]);
    for (std::size_t i = 2; i < points.size(); ++i) {
      area_m2 +=
          0.5 * glm::dot(glm::cross(points[i - 1] - points[0], points[i] - points[0]), normal);
    }
  }
};

/// Returns the triangles of a slit that lie on a scanned surface. They may have no area, or fold
/// over.
std::vector<glm::uvec3> filling(const StitchedMesh& stitched, const Rim& rim,
                                std::span<const RatedSurface> seen) {
  std::vector<glm::uvec3> triangles;
  for (const glm::uvec3& c : triangulate_loop(rim.points, rim.normal).triangles) {
    const glm::uvec3 t(rim.vertices[c.x], rim.vertices[c.y], rim.vertices[c.z]);
    const StitchedVertex &x = stitched.vertices[t.x], &y = stitched.vertices[t.y],
                         &z = stitched.vertices[t.z];
    if (is_seen(between(between(x, y, 0.5), z, 1.0 / 3), seen)) triangles.push_back(t);
  }
  return triangles;
}

/// Returns for each triangle the area of its connected surface.
std::vector<double> areas_of_pieces(const SurfaceMesh& surface) {
  std::vector<double> areas_m2(surface.n_faces());
  const Buckets pieces = pieces_of(surface);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    double area_m2 = 0;
    for (const std::uint32_t triangle : pieces.at(i))
      area_m2 += surface.calc_sector_area(half_edge_of(surface, triangle, 0));
    for (const std::uint32_t triangle : pieces.at(i)) areas_m2[triangle] = area_m2;
  }
  return areas_m2;
}

}  // namespace

ZipperingCounts zipper(StitchedMesh& stitched, StitchedMesh patch, const CoverTolerance& limits) {
  if (stitched.triangles.empty()) {
    stitched = std::move(patch);
    return {.left_out = make_manifold(stitched)};
  }
  if (patch.triangles.empty()) return {};
  TriangleMesh shared = mesh_of(stitched);
  std::erase_if(shared.triangles, [&](const glm::uvec3& t) {
    return !stitched.vertices[t.x].is_shared && !stitched.vertices[t.y].is_shared &&
           !stitched.vertices[t.z].is_shared;
  });
  if (shared.triangles.empty()) shared.triangles.push_back(stitched.triangles.front());
  const CoverSurface surface(std::move(shared), sds_of(stitched), limits);
  const BorderCrossings found = find_border_crossings(patch, surface);
  return Zippering(stitched, patch, found).run();
}

std::size_t fill_slits(StitchedMesh& stitched, std::span<const RatedSurface> seen,
                       const RunControl& work) {
  const SurfaceMesh surface = surface_of(stitched);
  const std::vector<double> areas_m2 = areas_of_pieces(surface);
  const auto vertices = static_cast<std::uint32_t>(surface.n_vertices());
  std::vector<char> is_done(vertices);
  std::size_t added = 0;
  for (std::uint32_t begin = 0; begin < vertices; ++begin) {
    if (begin % 4096 == 0) work.report(static_cast<double>(begin) / vertices);
    const auto first = border_at(surface, begin);
    if (!first.is_valid() || is_done[begin] != 0) continue;
    std::vector<std::uint32_t> loop;
    auto border = first;
    do {
      loop.push_back(number_of(surface.from_vertex_handle(border)));
      is_done[loop.back()] = 1;
      border = surface.next_halfedge_handle(border);
    } while (border != first);
    if (loop.size() < 3 || loop.size() > most_in_slit) continue;
    const Rim rim(stitched, std::move(loop));
    const double most_m2 = narrow * rim.length_m * rim.length_m;
    const double around_m2 = areas_m2[triangle_across(surface, first)];
    if (rim.area_m2 > most_m2 || rim.area_m2 < -std::min(most_m2, fold_share * around_m2)) continue;
    const std::vector<glm::uvec3> triangles = filling(stitched, rim, seen);
    stitched.triangles.insert(stitched.triangles.end(), triangles.begin(), triangles.end());
    added += triangles.size();
  }
  return added - make_manifold(stitched);
}

}  // namespace groundray
