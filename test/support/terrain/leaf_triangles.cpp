#include "test/support/terrain/leaf_triangles.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "test/support/real.h"

namespace groundray::testing {
namespace {

// One leaf in its own coordinates: point (a, b) with 0 <= a <= columns, 0 <= b <= rows.
class LeafMesh {
 public:
  LeafMesh(const HeightGrid& grid, const Leaf& leaf, int leaf_cells)
      : grid_(grid), leaf_(leaf), side_(leaf_cells) {
    const glm::ivec2 last(grid.columns() - 1, grid.rows() - 1);
    columns_ = std::min(side_, (last.x - leaf.column + leaf.step - 1) / leaf.step);
    rows_ = std::min(side_, (last.y - leaf.row + leaf.step - 1) / leaf.step);
  }

  std::vector<SampleTriangle> triangles() {
    for (const Leaf::Side side : {Leaf::North, Leaf::East, Leaf::South, Leaf::West}) {
      if ((leaf_.coarser & side) != 0) thin(side);
    }
    for (int b = 0; b < rows_; ++b) {
      for (int a = 0; a < columns_; ++a) {
        if (covered_.contains({a, b})) continue;
        add({a, b}, {a + 1, b}, {a, b + 1});
        add({a + 1, b + 1}, {a + 1, b}, {a, b + 1});
      }
    }
    return out_;
  }

 private:
  using Point = std::array<int, 2>;

  // Maps points of the north side to another side.
  Point turned(Leaf::Side side, Point p) const {
    switch (side) {
      case Leaf::North:
        return p;
      case Leaf::West:
        return {p[1], p[0]};
      case Leaf::South:
        return {side_ - p[0], side_ - p[1]};
      case Leaf::East:
        break;
    }
    return {side_ - p[1], side_ - p[0]};
  }

  bool is_last(Point p, int axis) const {
    const int limit = axis == 0 ? grid_.columns() - 1 : grid_.rows() - 1;
    return (axis == 0 ? leaf_.column : leaf_.row) +
               p[static_cast<std::size_t>(axis)] * leaf_.step >=
           limit;
  }

  bool is_dropped(Point p) const {
    const bool odd_a = p[0] % 2 == 1 && !is_last(p, 0);
    const bool odd_b = p[1] % 2 == 1 && !is_last(p, 1);
    return (odd_a && p[1] == 0 && (leaf_.coarser & Leaf::North) != 0) ||
           (odd_a && p[1] == side_ && (leaf_.coarser & Leaf::South) != 0) ||
           (odd_b && p[0] == 0 && (leaf_.coarser & Leaf::West) != 0) ||
           (odd_b && p[0] == side_ && (leaf_.coarser & Leaf::East) != 0);
  }

  void thin(Leaf::Side side) {
    for (int c = 0; c < side_; c += 2) {
      const auto at = [&](int a, int b) { return turned(side, {a, b}); };
      const Point middle = at(c + 1, 0);
      if (!is_dropped(middle)) continue;  // the DEM ends within this pair
      const Point o0 = at(c, 0), o2 = at(c + 2, 0), i0 = at(c, 1), i1 = at(c + 1, 1),
                  i2 = at(c + 2, 1);
      cover(o0, i1);
      cover(middle, i2);
      for (const auto& [p, q, r] : {std::array{o0, i1, i0}, {o0, o2, i1}, {o2, i1, i2}}) {
        if (!is_dropped(p) && !is_dropped(q) && !is_dropped(r)) add(p, q, r);
      }
    }
  }

  void cover(Point p, Point q) { covered_.insert({std::min(p[0], q[0]), std::min(p[1], q[1])}); }

  void add(Point p, Point q, Point r) {
    SampleTriangle triangle;
    std::size_t k = 0;
    for (const Point& corner : {p, q, r}) {
      const glm::ivec2 sample(std::min(leaf_.column + corner[0] * leaf_.step, grid_.columns() - 1),
                              std::min(leaf_.row + corner[1] * leaf_.step, grid_.rows() - 1));
      if (std::isnan(grid_.height_m(sample.x, sample.y))) return;
      triangle[k++] = sample;
    }
    const glm::ivec2 u = triangle[1] - triangle[0], v = triangle[2] - triangle[0];
    if (static_cast<long long>(u.x) * v.y < static_cast<long long>(u.y) * v.x)
      std::swap(triangle[1], triangle[2]);
    out_.push_back(triangle);
  }

  const HeightGrid& grid_;
  const Leaf& leaf_;
  int side_;
  int columns_, rows_;
  std::set<Point> covered_;
  std::vector<SampleTriangle> out_;
};

}  // namespace

std::vector<SampleTriangle> leaf_triangles(const HeightGrid& grid, std::span<const Leaf> leaves,
                                           int leaf_cells) {
  std::vector<SampleTriangle> all;
  for (const Leaf& leaf : leaves) {
    const auto some = LeafMesh(grid, leaf, leaf_cells).triangles();
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

std::optional<double> trace_triangles(const HeightGrid& grid,
                                      std::span<const SampleTriangle> triangles, const Ray& ray) {
  const glm::dvec2 origin = grid.origin_m(), step = grid.step_m();
  const Real u0 = (Real(ray.origin.x) - origin.x) / step.x, du = Real(ray.direction.x) / step.x;
  const Real v0 = (Real(ray.origin.y) - origin.y) / step.y, dv = Real(ray.direction.y) / step.y;
  std::optional<double> nearest;
  for (const SampleTriangle& triangle : triangles) {
    const auto z = [&](int k) {
      const glm::ivec2 p = triangle[static_cast<std::size_t>(k)];
      return Real(grid.height_m(p.x, p.y));
    };
    const glm::ivec2 a = triangle[0], b = triangle[1] - a, c = triangle[2] - a;
    const Real area = Real(b.x) * c.y - Real(c.x) * b.y;
    const Real zu = ((z(1) - z(0)) * c.y - (z(2) - z(0)) * b.y) / area;
    const Real zv = ((z(2) - z(0)) * b.x - (z(1) - z(0)) * c.x) / area;
    const Real falling = -(Real(ray.direction.z) - zu * du - zv * dv);
    if (!(falling > 0)) continue;
    const Real t = (Real(ray.origin.z) - z(0) - zu * (u0 - a.x) - zv * (v0 - a.y)) / falling;
    if (!(t >= 0 && t <= Real(ray.far_m))) continue;
    const Real u = u0 + t * du - a.x, v = v0 + t * dv - a.y;
    const Real p = (u * c.y - c.x * v) / area, q = (b.x * v - u * b.y) / area;
    if (p < 0 || q < 0 || p + q > 1) continue;
    if (!nearest || t < *nearest) nearest = static_cast<double>(t);
  }
  return nearest;
}

}  // namespace groundray::testing
