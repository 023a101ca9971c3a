#include "test/support/terrain/node_oracle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/tracing/leaf.h"

namespace groundray::testing {
namespace {

using Triangle = SampleTriangle;

struct Point {
  Real x, y;
};

struct Plane {
  Real at_0, along_x, along_y;
  Plane(const HeightGrid& grid, const Triangle& t) {
    std::array<Real, 3> z{};
    for (std::size_t i = 0; i < 3; ++i) z[i] = Real(grid.height_m(t[i].x, t[i].y));
    const glm::ivec2 p = t[1] - t[0];
    const glm::ivec2 q = t[2] - t[0];
    const Real area = Real(p.x) * q.y - Real(p.y) * q.x;
    along_x = ((z[1] - z[0]) * q.y - (z[2] - z[0]) * p.y) / area;
    along_y = ((z[2] - z[0]) * p.x - (z[1] - z[0]) * q.x) / area;
    at_0 = z[0] - along_x * t[0].x - along_y * t[0].y;
  }
  Real operator()(Point p) const { return at_0 + along_x * p.x + along_y * p.y; }
};

// Intersection of two triangles (Sutherland, Hodgman): corners of a polygon.
std::vector<Point> common_part(const Triangle& a, const Triangle& b) {
  std::vector<Point> polygon;
  for (const glm::ivec2& p : a) polygon.push_back({Real(p.x), Real(p.y)});
  const auto cross = [](glm::ivec2 p, glm::ivec2 q) { return p.x * q.y - p.y * q.x; };
  const int turn = cross(b[1] - b[0], b[2] - b[0]) > 0 ? 1 : -1;
  for (std::size_t side = 0; side < 3; ++side) {
    const glm::ivec2 from = b[side];
    const glm::ivec2 along = b[(side + 1) % 3] - from;
    const auto inside = [&](Point p) {
      return turn * (along.x * (p.y - from.y) - along.y * (p.x - from.x));
    };
    std::vector<Point> rest;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point p = polygon[i];
      const Point q = polygon[(i + 1) % polygon.size()];
      const Real in_p = inside(p);
      const Real in_q = inside(q);
      if (in_p >= 0) rest.push_back(p);
      if ((in_p > 0 && in_q < 0) || (in_p < 0 && in_q > 0)) {
        const Real t = in_p / (in_p - in_q);
        rest.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
      }
    }
    polygon = rest;
  }
  return polygon;
}

// Largest vertical distance between a triangle of the mesh and the reference surface.
Real distance(const HeightGrid& grid, const Triangle& mesh) {
  if (!exists(grid, mesh)) return 0;
  const auto [left, right] = std::minmax({mesh[0].x, mesh[1].x, mesh[2].x});
  const auto [top, bottom] = std::minmax({mesh[0].y, mesh[1].y, mesh[2].y});
  const Plane plane(grid, mesh);
  Real worst = 0;
  for (int r = top; r < bottom; ++r) {
    for (int c = left; c < right; ++c) {
      const Triangle near{{{c, r}, {c, r + 1}, {c + 1, r}}};
      const Triangle far{{{c + 1, r + 1}, {c, r + 1}, {c + 1, r}}};
      for (const Triangle& facet : {near, far}) {
        if (!exists(grid, facet)) continue;
        const Plane reference(grid, facet);
        for (const Point p : common_part(mesh, facet)) {
          worst = std::max(worst, std::abs(plane(p) - reference(p)));
        }
      }
    }
  }
  return worst;
}

}  // namespace

bool exists(const HeightGrid& grid, const Triangle& t) {
  return std::ranges::none_of(t, [&](auto p) { return std::isnan(grid.height_m(p.x, p.y)); });
}

// The triangles of a block of cells under one template, on points of its own lattice: ordinary
// cells and, in each pair of a thinned side, T1, T2 and T3 as drawn for the north side, rotated for
// other sides.
std::vector<Triangle> template_triangles(glm::ivec2 cells, unsigned thinned) {
  std::vector<Triangle> triangles;
  std::vector<glm::ivec2> dropped;
  std::vector<glm::ivec2> paired;  // cells
  const auto draw = [&](int length, auto place, auto cell) {
    for (int c = 0; c + 1 < length; c += 2) {
      const auto o = [&](int along) { return place(c, along, 0); };
      const auto i = [&](int along) { return place(c, along, 1); };
      triangles.push_back({o(0), i(1), i(0)});
      triangles.push_back({o(0), o(2), i(1)});
      triangles.push_back({o(2), i(1), i(2)});
      dropped.push_back(o(1));
      paired.push_back(cell(c));
      paired.push_back(cell(c + 1));
    }
  };
  using P = glm::ivec2;
  const int right = cells.x;
  const int bottom = cells.y;
  if ((thinned & Leaf::North) != 0) {
    draw(
        cells.x, [](int c, int a, int in) { return P(c + a, in); }, [](int c) { return P(c, 0); });
  }
  if ((thinned & Leaf::West) != 0) {
    draw(
        cells.y, [](int c, int a, int in) { return P(in, c + a); }, [](int c) { return P(0, c); });
  }
  if ((thinned & Leaf::South) != 0) {
    draw(
        cells.x, [&](int c, int a, int in) { return P(c + 2 - a, bottom - in); },
        [&](int c) { return P(c, bottom - 1); });
  }
  if ((thinned & Leaf::East) != 0) {
    draw(
        cells.y, [&](int c, int a, int in) { return P(right - in, c + 2 - a); },
        [&](int c) { return P(right - 1, c); });
  }
  for (int r = 0; r < cells.y; ++r) {
    for (int c = 0; c < cells.x; ++c) {
      if (std::ranges::count(paired, P(c, r)) > 0) continue;
      triangles.push_back({P(c, r), P(c, r + 1), P(c + 1, r)});
      triangles.push_back({P(c + 1, r + 1), P(c, r + 1), P(c + 1, r)});
    }
  }
  // Where sides adjoin, the triangles of one replace those of the other, or both produce the same.
  std::erase_if(triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](P p) { return std::ranges::count(dropped, p) > 0; });
  });
  const auto before = [](P p, P q) { return std::pair(p.x, p.y) < std::pair(q.x, q.y); };
  for (Triangle& t : triangles) std::ranges::sort(t, before);
  const auto is_before = [&](const Triangle& s, const Triangle& t) {
    return std::ranges::lexicographical_compare(s, t, before);
  };
  std::ranges::sort(triangles, is_before);
  triangles.erase(std::ranges::unique(triangles).begin(), triangles.end());
  return triangles;
}

// Deviations of a node over all templates that its neighbours can require.
NodeDeviations certify_slowly(const HeightGrid& grid, const Lattice& lattice, int level,
                              glm::ivec2 node) {
  const glm::ivec2 first = node * lattice.block_cells;
  const glm::ivec2 whole = lattice.cells(level);
  const glm::ivec2 cells{std::min(lattice.block_cells, whole.x - first.x),
                         std::min(lattice.block_cells, whole.y - first.y)};
  const unsigned possible = (first.y > 0 ? Leaf::North : 0) | (first.x > 0 ? Leaf::West : 0) |
                            (first.y + cells.y < whole.y ? Leaf::South : 0) |
                            (first.x + cells.x < whole.x ? Leaf::East : 0);
  NodeDeviations worst;
  for (unsigned thinned = 0; thinned < 16; ++thinned) {
    if ((thinned & ~possible) != 0) continue;
    for (Triangle t : template_triangles(cells, thinned)) {
      for (glm::ivec2& p : t) p = lattice.sample(level, first + p);
      worst.all = std::max(worst.all, distance(grid, t));
    }
    if (thinned == 0) worst.full = worst.all;
  }
  return worst;
}

}  // namespace groundray::testing
