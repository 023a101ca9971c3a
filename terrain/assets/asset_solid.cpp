#include "terrain/assets/asset_solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <limits>
#include <unordered_map>
#include <vector>

namespace groundray {
namespace {

constexpr std::uint32_t no_vertex = 0xffffffff;

// Corner i of a cell is at bits 0, 1 and 2 of i along x, y and z. Edges 0 to 3 run along x, 4 to 7
// along y, 8 to 11 along z, each from the corner `edge_begin`.
constexpr std::array<int, 12> edge_begin = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};
constexpr int edge_end(int edge) {
  return edge_begin[static_cast<std::size_t>(edge)] | (1 << (edge / 4));
}

// Corners of the faces in cyclic order.
constexpr std::array<std::array<int, 4>, 6> faces = {
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

int edge_between(int a, int b) {
  const int low = std::min(a, b), axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  for (int e = 4 * axis; e < 4 * axis + 4; ++e) {
    if (edge_begin[static_cast<std::size_t>(e)] == low) return e;
  }
  return 0;
}

// Mesh of a solid: values at the corners of the grid, then vertices by cell, then a quadrilateral
// for each edge of the grid that crosses the surface.
class SolidMesher {
 public:
  SolidMesher(AssetBuilder& builder, const Solid& solid, const SolidGrid& grid,
              std::uint16_t surface)
      : builder_(builder), solid_(solid), cell_(grid.cell), surface_(surface) {
    low_ = grid.low - 1.5 * cell_;
    for (int k = 0; k < 3; ++k) {
      corners_[k] = static_cast<int>(std::ceil((grid.high[k] - grid.low[k]) / cell_)) + 4;
    }
    sample();
  }

  void run() {
    for_each_cell([&](const glm::ivec3& cell) { add_vertices(cell); });
    for (int axis = 0; axis < 3; ++axis) add_faces(axis);
  }

 private:
  static constexpr int block = 4;  // cells along a block

  std::size_t index(const glm::ivec3& at) const {
    return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(corners_.y) +
            static_cast<std::size_t>(at.y)) *
               static_cast<std::size_t>(corners_.x) +
           static_cast<std::size_t>(at.x);
  }
  glm::dvec3 position(const glm::ivec3& at) const { return low_ + cell_ * glm::dvec3(at); }
  static glm::ivec3 corner(const glm::ivec3& cell, int i) {
    return cell + glm::ivec3(i & 1, (i >> 1) & 1, i >> 2);
  }

  template <typename Act>
  void for_each_cell(const Act& act) const {
    for (int z = 0; z + 1 < corners_.z; ++z) {
      for (int y = 0; y + 1 < corners_.y; ++y) {
        for (int x = 0; x + 1 < corners_.x; ++x) act({x, y, z});
      }
    }
  }

  // Evaluates the solid at all corners; a block far from the surface takes the value at its centre.
  void sample() {
    values_.resize(index({0, 0, corners_.z}));
    const double reach = 1.5 * cell_ * block;
    for (int z = 0; z < corners_.z; z += block) {
      for (int y = 0; y < corners_.y; y += block) {
        for (int x = 0; x < corners_.x; x += block) sample_block({x, y, z}, reach);
      }
    }
  }

  void sample_block(const glm::ivec3& first, double reach) {
    const double centre = solid_(position(first) + cell_ * (block - 1) / 2.0);
    const glm::ivec3 end = glm::min(first + block, corners_);
    for (int z = first.z; z < end.z; ++z) {
      for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x) {
          values_[index({x, y, z})] =
              std::abs(centre) > reach ? centre : solid_(position({x, y, z}));
        }
      }
    }
  }

  // Joins the crossed edges of a cell into the outlines of its pieces of surface. On a face with
  // four crossings the inner corners are separated, in both cells that share it alike.
  std::array<int, 12> pieces_of(unsigned inside) const {
    std::array<int, 12> root{};
    for (int e = 0; e < 12; ++e) root[static_cast<std::size_t>(e)] = e;
    const auto find = [&](int e) {
      while (root[static_cast<std::size_t>(e)] != e) e = root[static_cast<std::size_t>(e)];
      return e;
    };
    const auto is_in = [&](int c) { return ((inside >> c) & 1u) != 0; };
    for (const auto& face : faces) {
      std::vector<int> crossed;
      for (std::size_t i = 0; i < 4; ++i) {
        if (is_in(face[i]) != is_in(face[(i + 1) % 4]))
          crossed.push_back(edge_between(face[i], face[(i + 1) % 4]));
      }
      if (crossed.size() == 2) root[static_cast<std::size_t>(find(crossed[0]))] = find(crossed[1]);
      if (crossed.size() != 4) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        if (is_in(face[i]))
          root[static_cast<std::size_t>(find(crossed[i]))] = find(crossed[(i + 3) % 4]);
      }
    }
    std::array<int, 12> pieces{};
    for (int e = 0; e < 12; ++e) pieces[static_cast<std::size_t>(e)] = find(e);
    return pieces;
  }

  void add_vertices(const glm::ivec3& cell) {
    std::array<double, 8> value{};
    unsigned inside = 0;
    for (int i = 0; i < 8; ++i) {
      value[static_cast<std::size_t>(i)] = values_[index(corner(cell, i))];
      if (value[static_cast<std::size_t>(i)] < 0) inside |= 1u << i;
    }
    if (inside == 0 || inside == 255) return;
    const std::array<int, 12> pieces = pieces_of(inside);
    std::array<glm::dvec3, 12> sum{};
    std::array<int, 12> count{};
    for (int e = 0; e < 12; ++e) {
      const int a = edge_begin[static_cast<std::size_t>(e)], b = edge_end(e);
      if (((inside >> a) & 1u) == ((inside >> b) & 1u)) continue;
      const double from = value[static_cast<std::size_t>(a)],
                   to = value[static_cast<std::size_t>(b)];
      const auto piece = static_cast<std::size_t>(pieces[static_cast<std::size_t>(e)]);
      sum[piece] +=
          glm::mix(position(corner(cell, a)), position(corner(cell, b)), from / (from - to));
      ++count[piece];
    }
    std::array<std::uint32_t, 12> vertex{};
    vertex.fill(no_vertex);
    for (std::size_t e = 0; e < 12; ++e) {
      if (count[e] > 0)
        vertex[e] = builder_.add_vertex(on_surface(sum[e] / double(count[e]), position(cell)));
    }
    std::array<std::uint32_t, 12> of_edge{};
    for (std::size_t e = 0; e < 12; ++e) of_edge[e] = vertex[static_cast<std::size_t>(pieces[e])];
    vertices_.emplace(index(cell), of_edge);
  }

  // Moves a point onto the surface by Newton's method, within its cell, so that the points of two
  // cells never coincide.
  glm::dvec3 on_surface(const glm::dvec3& start, const glm::dvec3& low) const {
    glm::dvec3 p = start;
    for (int step = 0; step < 3; ++step) {
      const double h = 1e-3 * cell_;
      glm::dvec3 slope;
      for (int k = 0; k < 3; ++k) {
        glm::dvec3 ahead = p, behind = p;
        ahead[k] += h;
        behind[k] -= h;
        slope[k] = (solid_(ahead) - solid_(behind)) / (2 * h);
      }
      const double square = glm::dot(slope, slope);
      if (square < 1e-6) break;
      p -= slope * (solid_(p) / square);
    }
    return glm::clamp(p, low + 0.05 * cell_, low + 0.95 * cell_);
  }

  void add_faces(int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for_each_cell([&](const glm::ivec3& at) {
      if (at[u] == 0 || at[v] == 0) return;
      glm::ivec3 next = at;
      ++next[axis];
      const bool is_in = values_[index(at)] < 0;
      if (is_in == (values_[index(next)] < 0)) return;
      std::array<std::uint32_t, 4> corner{};
      constexpr std::array<std::array<int, 2>, 4> around = {{{-1, -1}, {0, -1}, {0, 0}, {-1, 0}}};
      for (std::size_t i = 0; i < 4; ++i) {
        glm::ivec3 cell = at;
        cell[u] += around[i][0];
        cell[v] += around[i][1];
        const int begin = ((-around[i][0]) << u) | ((-around[i][1]) << v);
        corner[i] = vertices_.at(
            index(cell))[static_cast<std::size_t>(edge_between(begin, begin | (1 << axis)))];
      }
      if (!is_in) std::swap(corner[1], corner[3]);
      add_quad(corner);
    });
  }

  // Splits a quadrilateral along its shorter diagonal.
  void add_quad(const std::array<std::uint32_t, 4>& c) {
    const auto& p = builder_.model().mesh.vertices_m;
    const auto first = glm::distance(p[c[0]], p[c[2]]), second = glm::distance(p[c[1]], p[c[3]]);
    const std::size_t k = second < first ? 1 : 0;
    builder_.add_triangle(c[k], c[k + 1], c[k + 2], surface_);
    builder_.add_triangle(c[k], c[k + 2], c[(k + 3) % 4], surface_);
  }

  AssetBuilder& builder_;
  const Solid& solid_;
  double cell_;
  std::uint16_t surface_;
  glm::dvec3 low_{0};
  glm::ivec3 corners_{0};
  std::vector<double> values_;
  std::unordered_map<std::size_t, std::array<std::uint32_t, 12>> vertices_;  // by cell and edge
};

}  // namespace

double round_cone(const glm::dvec3& p, const TubeRing& a, const TubeRing& b) {
  const glm::dvec3 axis = b.p - a.p, from = p - a.p;
  const double square = glm::dot(axis, axis), taper = a.radius - b.radius;
  const double flank = square - taper * taper;
  if (flank <= 0) {  // one sphere contains the other
    return std::min(glm::length(from) - a.radius, glm::distance(p, b.p) - b.radius);
  }
  const double y = glm::dot(from, axis);
  const glm::dvec3 across = from * square - axis * y;
  const double x = glm::dot(across, across), along = y - square;
  const double y2 = y * y * square, z2 = along * along * square;
  const auto sign = [](double value) { return value < 0 ? -1.0 : 1.0; };
  const double k = sign(taper) * taper * taper * x;
  if (sign(along) * flank * z2 > k) return std::sqrt(x + z2) / square - b.radius;
  if (sign(y) * flank * y2 < k) return std::sqrt(x + y2) / square - a.radius;
  return (std::sqrt(x * flank / square) + y * taper) / square - a.radius;
}

double ellipsoid(const glm::dvec3& p, const glm::dvec3& centre, const glm::dvec3& radii) {
  const glm::dvec3 scaled = (p - centre) / radii;
  const double size = glm::length(scaled), slope = glm::length(scaled / radii);
  if (slope == 0) return -std::min({radii.x, radii.y, radii.z});
  return size * (size - 1) / slope;
}

double round_box(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high,
                 double radius) {
  const glm::dvec3 out = glm::abs(p - (low + high) / 2.0) - (high - low) / 2.0 + radius;
  return glm::length(glm::max(out, 0.0)) + std::min(std::max({out.x, out.y, out.z}), 0.0) - radius;
}

double round_disc(const glm::dvec3& p, const glm::dvec3& centre, double radius, double half_width,
                  double edge) {
  const glm::dvec3 from = p - centre;
  const glm::dvec2 out(std::sqrt(from.x * from.x + from.z * from.z) - radius + edge,
                       std::abs(from.y) - half_width + edge);
  return glm::length(glm::max(out, 0.0)) + std::min(std::max(out.x, out.y), 0.0) - edge;
}

double polygon_distance(const glm::dvec2& p, std::span<const glm::dvec2> corners) {
  double square = std::numeric_limits<double>::infinity();
  bool is_in = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const glm::dvec2 side = corners[j] - corners[i], from = p - corners[i];
    const double share = std::clamp(glm::dot(from, side) / glm::dot(side, side), 0.0, 1.0);
    const glm::dvec2 off = from - side * share;
    square = std::min(square, glm::dot(off, off));
    if ((corners[i].y > p.y) != (corners[j].y > p.y) &&
        p.x < corners[i].x + side.x * (p.y - corners[i].y) / side.y) {
      is_in = !is_in;
    }
  }
  return is_in ? -std::sqrt(square) : std::sqrt(square);
}

double blend(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * width / 4;
}

void add_solid(AssetBuilder& builder, const Solid& solid, const SolidGrid& grid,
               std::uint16_t surface) {
  SolidMesher(builder, solid, grid, surface).run();
}

}  // namespace groundray
