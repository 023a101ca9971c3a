#include "reconstruction/mesh/merge/redundant_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>

#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {
namespace {

constexpr int worth_smoothing_rounds = 10;
constexpr int border_rings = 3;                 // of triangles with reduced weights
constexpr std::size_t in_island = 64;           // triangles, at most
constexpr std::size_t vertices_in_block = 512;  // consecutive vertices are close in space

/// Returns the number of triangles between each triangle and the boundary, at most `border_rings`.
std::vector<int> rings_to_border(const CoverSurface& surface) {
  const std::vector<glm::uvec3>& triangles = surface.mesh().triangles;
  std::vector<int> of_vertices(surface.mesh().vertices_m.size(), border_rings);
  for (std::uint32_t v = 0; v < of_vertices.size(); ++v) {
    if (surface.is_at_border(v)) of_vertices[v] = 0;
  }
  std::vector<int> of_triangles(triangles.size());
  for (int round = 0; round < border_rings; ++round) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const glm::uvec3& t = triangles[i];
      of_triangles[i] = std::min({of_vertices[t.x], of_vertices[t.y], of_vertices[t.z]});
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        int& rings = of_vertices[triangles[i][k]];
        rings = std::min(rings, of_triangles[i] + 1);
      }
    }
  }
  return of_triangles;
}

/// Returns points of a triangle other than its corners, about `step_m` apart: rows between its
/// shortest edge and the opposite corner.
std::vector<glm::dvec3> places_in(const TriangleMesh& mesh, std::size_t triangle, double step_m) {
  constexpr double most_rows = 16, most_in_row = 8;
  const glm::uvec3& t = mesh.triangles[triangle];
  std::array<glm::dvec3, 3> p{mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]};
  const auto length = [&](std::size_t k) { return glm::distance(p[k], p[(k + 1) % 3]); };
  std::size_t shortest = 0;
  for (const std::size_t k : {1, 2}) {
    if (length(k) < length(shortest)) shortest = k;
  }
  std::ranges::rotate(p, p.begin() + static_cast<std::ptrdiff_t>(shortest));
  const double rows = std::min(most_rows, std::floor(length(1) / step_m));
  std::vector<glm::dvec3> places;
  for (double row = 0; row <= rows; ++row) {
    const glm::dvec3 a = glm::mix(p[0], p[2], row / (rows + 1));
    const glm::dvec3 b = glm::mix(p[1], p[2], row / (rows + 1));
    const double parts = std::min(most_in_row, std::floor(glm::distance(a, b) / step_m)) + 1;
    const bool has_corners = row == 0;
    for (double k = has_corners ? 1 : 0; k <= (has_corners ? parts - 1 : parts); ++k)
      places.push_back(glm::mix(a, b, k / parts));
  }
  return places;
}

/// Tests whether triangles of one scan lie, between their corners, on what other scans keep.
class PlaceQuestions {
 public:
  PlaceQuestions(std::span<const RatedSurface> scans, const VertexCovers& covers, std::size_t scan,
                 double interpolation)
      : scans_(scans), covers_(covers), own_(scans[scan].surface), interpolation_(interpolation) {}

  /// Returns true if kept triangles cover each sample of a triangle other than its corners. There
  /// are such samples where the triangles that cover its corners are finer.
  bool are_covered(std::size_t triangle, const std::vector<std::vector<char>>& kept) const {
    const glm::uvec3& t = own_.mesh().triangles[triangle];
    const double step_m = step_over(t, kept);
    const glm::dvec3 a = own_.mesh().vertices_m[t.x], b = own_.mesh().vertices_m[t.y],
                     c = own_.mesh().vertices_m[t.z];
    const double longest_m =
        std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    if (!(longest_m >= step_m)) return true;
    const glm::vec3 sum = own_.normals()[t.x] + own_.normals()[t.y] + own_.normals()[t.z];
    MeasuredPlace place{.normal = glm::length(sum) > 0 ? glm::normalize(sum) : sum,
                        .sd_m = (own_.sd_m(t.x) + own_.sd_m(t.y) + own_.sd_m(t.z)) / 3};
    std::vector<std::uint32_t> near = covers_near(t);
    std::size_t first = 0;  // scan that covered the previous sample, queried first for speed
    for (const glm::dvec3& p : places_in(own_.mesh(), triangle, step_m)) {
      place.p = p;
      if (!is_covered(place, interpolation_ * longest_m, kept, near, first)) return false;
    }
    return true;
  }

 private:
  double step_over(const glm::uvec3& t, const std::vector<std::vector<char>>& kept) const {
    double step_m = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      const std::span<const std::uint32_t> covers = covers_.of(t[k]);
      for (std::size_t s = 0; s < covers.size(); ++s) {
        if (covers[s] == not_covered || kept[s][covers[s]] == 0) continue;
        step_m = std::min(step_m, 24 * std::sqrt(2 * scans_[s].surface.area_m2(covers[s])));
      }
    }
    return step_m;
  }

  /// Returns for each scan a triangle that covers a corner, if there is one.
  std::vector<std::uint32_t> covers_near(const glm::uvec3& t) const {
    std::vector<std::uint32_t> near(scans_.size());
    for (std::size_t s = 0; s < near.size(); ++s)
      near[s] = std::min({covers_.of(t.x)[s], covers_.of(t.y)[s], covers_.of(t.z)[s]});
    return near;
  }

  bool is_covered(const MeasuredPlace& place, double slack_m,
                  const std::vector<std::vector<char>>& kept, std::vector<std::uint32_t>& near,
                  std::size_t& first) const {
    for (std::size_t i = 0; i < near.size(); ++i) {
      const std::size_t s = (first + i) % near.size();
      if (near[s] == not_covered) continue;
      const CoverAnswer answer = scans_[s].surface.at(place, slack_m, near[s]);
      near[s] = answer.nearest.triangle;
      if (answer.cover != Cover::Inside || kept[s][near[s]] == 0) continue;
      first = s;
      return true;
    }
    return false;
  }

  std::span<const RatedSurface> scans_;
  const VertexCovers& covers_;
  const CoverSurface& own_;
  double interpolation_;
};

struct RankedFace {
  float worth = 0;
  std::uint32_t scan = 0, triangle = 0;
};

std::vector<RankedFace> ranked(std::span<const RatedSurface> scans) {
  std::vector<RankedFace> faces;
  for (std::uint32_t s = 0; s < scans.size(); ++s) {
    for (std::uint32_t i = 0; i < scans[s].worth.size(); ++i) {
      if (!scans[s].refutes(i)) faces.push_back({scans[s].worth[i], s, i});
    }
  }
  std::ranges::sort(faces, [](const RankedFace& a, const RankedFace& b) {
    return std::tie(b.worth, a.scan, a.triangle) < std::tie(a.worth, b.scan, b.triangle);
  });
  return faces;
}

bool any_is_kept(std::span<const std::uint32_t> covers,
                 const std::vector<std::vector<char>>& kept) {
  for (std::size_t s = 0; s < covers.size(); ++s) {
    if (covers[s] != not_covered && kept[s][covers[s]] != 0) return true;
  }
  return false;
}

/// Calls `visit(part, is_on_border)` for each edge-connected part of a surface that has at most
/// `in_island` triangles, all with the state `is_kept`.
template <typename Visit>
void for_islands(const CoverSurface& cover, const std::vector<char>& kept, char is_kept,
                 const Visit& visit) {
  const SurfaceMesh surface = to_surface(cover.mesh());
  const Buckets parts = pieces_of(surface, [&](SurfaceMesh::HalfedgeHandle h) {
    const std::uint32_t one = number_of(surface.face_handle(h)),
                        other = triangle_across(surface, h);
    return one != none && other != none && kept[one] != kept[other];
  });
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::span<const std::uint32_t> part = parts.at(i);
    if (part.size() > in_island || kept[part.front()] != is_kept) continue;
    visit(part, std::ranges::any_of(part, [&](std::uint32_t triangle) {
            return surface.is_boundary(surface.face_handle(triangle));
          }));
  }
}

/// Selection of the triangles to keep.
class Selection {
 public:
  Selection(std::span<const RatedSurface> scans, std::span<const VertexCovers> covers,
            double interpolation)
      : scans_(scans), covers_(covers) {
    for (std::size_t s = 0; s < scans.size(); ++s) {
      kept_.emplace_back(scans[s].worth.size());
      questions_.emplace_back(scans, covers[s], s, interpolation);
    }
  }

  std::vector<std::vector<char>> run(const RunControl& work) && {
    // The best come first, so that kept triangles have greater weights.
    const std::vector<RankedFace> faces = ranked(scans_);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (i % 16384 == 0) work.report(static_cast<double>(i) / static_cast<double>(faces.size()));
      kept_[faces[i].scan][faces[i].triangle] =
          is_covered(faces[i].scan, faces[i].triangle) ? 0 : 1;
    }
    for (std::size_t s = 0; s < scans_.size(); ++s) close_holes(s);
    for (std::size_t s = 0; s < scans_.size(); ++s) remove_islands(s);
    return std::move(kept_);
  }

 private:
  /// Returns true if the triangles kept so far cover a triangle completely.
  bool is_covered(std::size_t scan, std::size_t triangle) const {
    const glm::uvec3& t = scans_[scan].surface.mesh().triangles[triangle];
    const VertexCovers& covers = covers_[scan];
    return any_is_kept(covers.of(t.x), kept_) && any_is_kept(covers.of(t.y), kept_) &&
           any_is_kept(covers.of(t.z), kept_) && questions_[scan].are_covered(triangle, kept_);
  }

  void close_holes(std::size_t scan) {
    for_islands(scans_[scan].surface, kept_[scan], 0,
                [&](std::span<const std::uint32_t> part, bool is_on_border) {
                  if (is_on_border) return;
                  for (const std::uint32_t triangle : part)
                    kept_[scan][triangle] = scans_[scan].refutes(triangle) ? 0 : 1;
                });
  }

  void remove_islands(std::size_t scan) {
    for_islands(scans_[scan].surface, kept_[scan], 1,
                [&](std::span<const std::uint32_t> part, bool) {
                  for (const std::uint32_t triangle : part)
                    if (is_covered(scan, triangle)) kept_[scan][triangle] = 0;
                });
  }

  std::span<const RatedSurface> scans_;
  std::span<const VertexCovers> covers_;
  std::vector<PlaceQuestions> questions_;  // one per scan
  std::vector<std::vector<char>> kept_;
};

/// Records which vertices of a surface another scan covers.
void note_covers(const CoverSurface& own, const RatedSurface& other, std::size_t number,
                 VertexCovers& covers) {
  for_blocks(
      own.mesh().vertices_m.size(), vertices_in_block, [&](std::size_t begin, std::size_t end) {
        std::uint32_t near = 0;
        for (std::size_t v = begin; v < end; ++v) {
          const auto vertex = static_cast<std::uint32_t>(v);
          const MeasuredPlace place{own.mesh().vertices_m[v], own.normals()[v], own.sd_m(vertex)};
          const CoverAnswer answer = other.surface.at(place, 0, near);
          near = answer.nearest.triangle;
          if (answer.cover == Cover::Inside && !other.refutes(near))
            covers.triangles[v * covers.scans + number] = near;
        }
      });
}

}  // namespace

std::vector<float> rate_faces(const CoverSurface& surface, std::span<const float> confidence) {
  std::vector<float> worth(surface.mesh().triangles.size(), 1);
  std::ranges::copy(confidence, worth.begin());
  const std::vector<int> rings = rings_to_border(surface);
  const SurfaceMesh half_edges = to_surface(surface.mesh());
  std::vector<float> before(worth.size());
  for (int round = 0; round < worth_smoothing_rounds; ++round) {
    before = worth;
    for (std::uint32_t i = 0; i < worth.size(); ++i) {
      float sum = before[i], count = 1;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t other = triangle_across(half_edges, half_edge_of(half_edges, i, k));
        if (other == none) continue;
        sum += before[other];
        ++count;
      }
      worth[i] = sum / count;
    }
  }
  for (std::size_t i = 0; i < worth.size(); ++i)
    worth[i] *= static_cast<float>(rings[i] + 1) / (border_rings + 1);
  return worth;
}

std::vector<float> worth_of_vertices(const RatedSurface& rated) {
  const TriangleMesh& mesh = rated.surface.mesh();
  std::vector<float> sums(mesh.vertices_m.size()), counts(sums.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      sums[mesh.triangles[i][k]] += rated.worth[i];
      ++counts[mesh.triangles[i][k]];
    }
  }
  for (std::size_t v = 0; v < sums.size(); ++v) sums[v] /= std::max(1.f, counts[v]);
  return sums;
}

std::vector<VertexCovers> find_covers(std::span<const RatedSurface> scans, const RunControl& work) {
  std::vector<VertexCovers> covers;
  for (const RatedSurface& scan : scans) {
    const std::size_t vertices = scan.surface.mesh().vertices_m.size();
    covers.push_back({scans.size(), std::vector(vertices * scans.size(), not_covered)});
  }
  const std::size_t count = scans.size();
  for (std::size_t s = 0; s < count; ++s) {
    for (std::size_t by = 0; by < count; ++by) {
      if (s != by) note_covers(scans[s].surface, scans[by], by, covers[s]);
      work.report(static_cast<double>(s * count + by + 1) / static_cast<double>(count * count));
    }
  }
  return covers;
}

std::vector<std::vector<char>> keep_best_faces(std::span<const RatedSurface> scans,
                                               std::span<const VertexCovers> covers,
                                               double interpolation, const RunControl& work) {
  return Selection(scans, covers, interpolation).run(work);
}

}  // namespace groundray
