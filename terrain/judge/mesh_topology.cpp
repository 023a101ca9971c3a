#include "terrain/judge/mesh_topology.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "terrain/judge/facet_set.h"

namespace groundray::judge {
namespace {

// V, E and F of the existing facets.
struct FacetCount {
  std::int64_t samples = 0, edges = 0, facets = 0;
};

FacetCount count(const FacetSet& facets) {
  FacetCount counted;
  for (int row = 0; row <= facets.last().y; ++row) {
    for (int column = 0; column <= facets.last().x; ++column) {
      const glm::ivec2 p(column, row);
      counted.samples += facets.sample_exists(p) ? 1 : 0;
      for (const Family& family : families) counted.edges += facets.edge_exists(family, p) ? 1 : 0;
      counted.facets +=
          (facets.exists(FacetSet::near(p)) ? 1 : 0) + (facets.exists(FacetSet::far(p)) ? 1 : 0);
    }
  }
  return counted;
}

class TopologyCheck {
 public:
  TopologyCheck(const HeightGrid& grid, std::span<const glm::ivec2> vertices,
                std::span<const glm::uvec3> triangles)
      : facets_(grid), vertices_(vertices), triangles_(triangles) {}

  std::vector<std::string> faults() {
    if (check_vertices() && check_triangles()) {
      check_edges();
      check_sums();
    }
    if (fault_count_ > faults_.size()) {
      faults_.push_back(fmt::format("and {} more", fault_count_ - faults_.size()));
    }
    return faults_;
  }

 private:
  template <typename... Args>
  void fault(fmt::format_string<Args...> format, Args&&... args) {
    if (++fault_count_ <= 10) faults_.push_back(fmt::format(format, std::forward<Args>(args)...));
  }
  static std::string text(glm::ivec2 p) { return fmt::format("({}, {})", p.x, p.y); }

  bool check_vertices() {
    std::vector<std::int64_t> places;
    for (const glm::ivec2 p : vertices_) {
      if (!facets_.has_height(p)) fault("vertex {} is not a sample with a height", text(p));
      places.push_back((std::int64_t{p.y} << 32) + p.x);
    }
    std::ranges::sort(places);
    for (auto same = std::ranges::adjacent_find(places); same != places.end();
         same = std::adjacent_find(same + 1, places.end())) {
      fault("vertex ({}, {}) occurs twice", *same & 0xffffffff, *same >> 32);
    }
    return fault_count_ == 0;
  }

  bool check_triangles() {
    std::vector<bool> used(vertices_.size());
    for (const glm::uvec3& t : triangles_) {
      if (std::max({t[0], t[1], t[2]}) >= vertices_.size()) {
        fault("a triangle refers to the vertices {}, {}, {}, but there are {}", t[0], t[1], t[2],
              vertices_.size());
        continue;
      }
      for (int i = 0; i < 3; ++i) used[t[i]] = true;
      const std::int64_t area = doubled_area({vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]});
      if (winding_ == 0) winding_ = area < 0 ? -1 : 1;
      if (area * winding_ <= 0) {
        fault("triangle {} {} {} has the doubled area {}, whose sign differs from the first",
              text(vertices_[t[0]]), text(vertices_[t[1]]), text(vertices_[t[2]]), area);
      }
      area_ += area * winding_;
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) fault("vertex {} is in no triangle", text(vertices_[i]));
    }
    return fault_count_ == 0;
  }

  void check_edges() {
    std::vector<std::uint64_t> edges;  // lower vertex, higher vertex, direction
    edges.reserve(3 * triangles_.size());
    for (const glm::uvec3& t : triangles_) {
      for (int i = 0; i < 3; ++i) {
        const std::uint64_t p = t[i];
        const std::uint64_t q = t[(i + 1) % 3];
        edges.push_back(p < q ? (p << 33) + (q << 1) : (q << 33) + (p << 1) + 1);
      }
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end, ++edge_count_) {
      while (end < edges.size() && edges[end] >> 1 == edges[i] >> 1) ++end;
      const glm::ivec2 p = vertices_[edges[i] >> 33];
      const glm::ivec2 q = vertices_[(edges[i] >> 1) & 0xffffffff];
      if (end - i == 1) {
        (edges[i] & 1) == 0 ? check_outline(p, q) : check_outline(q, p);
      } else if (end - i > 2 || edges[i] == edges[i + 1]) {
        fault("edge {} {} is used {} times, not once in each direction", text(p), text(q), end - i);
      }
    }
  }

  // Checks an edge with a triangle on one side only: facets must be missing on the other side.
  void check_outline(glm::ivec2 p, glm::ivec2 q) {
    const glm::ivec2 span = q - p;
    const int length = std::max(std::abs(span.x), std::abs(span.y));
    const auto family = std::ranges::find_if(families, [&](const Family& candidate) {
      return candidate.along * length == span || candidate.along * -length == span;
    });
    if (family == families.end()) {
      return fault("edge {} {} has one triangle and does not follow edges of facets", text(p),
                   text(q));
    }
    const bool backwards = family->along * length != span;
    for (int i = 0; i < length; ++i) {
      const glm::ivec2 a = (backwards ? q : p) + family->along * i;
      for (const Corners& facet : FacetSet::beside(*family, a)) {
        const std::int64_t side = cross(span, facet[0] + facet[1] + facet[2] - 3 * a);
        if (side * winding_ < 0 && facets_.exists(facet)) {
          return fault("edge {} {} has one triangle, but the surface continues at {}", text(p),
                       text(q), text(a));
        }
      }
    }
  }

  void check_sums() {
    const FacetCount expected = count(facets_);
    if (area_ != expected.facets) {
      fault("the doubled areas add up to {}, those of the facets to {}", area_, expected.facets);
    }
    const auto euler = std::ssize(vertices_) - edge_count_ + std::ssize(triangles_);
    const std::int64_t wanted = expected.samples - expected.edges + expected.facets;
    if (euler != wanted) fault("V - E + F = {}, but {} for the facets", euler, wanted);
  }

  FacetSet facets_;
  std::span<const glm::ivec2> vertices_;
  std::span<const glm::uvec3> triangles_;
  std::int64_t winding_ = 0;
  std::int64_t area_ = 0;
  std::ptrdiff_t edge_count_ = 0;
  std::size_t fault_count_ = 0;
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<std::string> topology_faults(const HeightGrid& grid,
                                         std::span<const glm::ivec2> vertices,
                                         std::span<const glm::uvec3> triangles) {
  return TopologyCheck(grid, vertices, triangles).faults();
}

}  // namespace groundray::judge
