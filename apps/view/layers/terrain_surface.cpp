#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "apps/view/layers/mesh_layer.h"
#include "apps/view/layers/terrain_follower.h"

namespace groundray {
namespace {

// Row and column of a sample of the DEM, packed into one number.
using Key = std::uint64_t;

Key key_of(glm::ivec2 sample) {
  return (static_cast<Key>(static_cast<std::uint32_t>(sample.y)) << 32U) |
         static_cast<std::uint32_t>(sample.x);
}
glm::ivec2 sample_of(Key key) {
  return {static_cast<int>(key & 0xffffffffU), static_cast<int>(key >> 32U)};
}

// Shape of a leaf; points are numbered in the leaf's own cells.
class LeafShape {
 public:
  LeafShape(const Level& level, const Leaf& leaf)
      : level_(level),
        leaf_(leaf),
        last_(level.frame.samples - 1),
        size_(count(leaf.column, last_.x), count(leaf.row, last_.y)) {}

  glm::ivec2 size() const { return size_; }
  glm::ivec2 sample(glm::ivec2 point) const {
    return {std::min(leaf_.column + point.x * leaf_.step, last_.x),
            std::min(leaf_.row + point.y * leaf_.step, last_.y)};
  }
  float height_m(glm::ivec2 at) const {
    return level_.heights(index(at.x, level_.first.x), index(at.y, level_.first.y));
  }

  // Calls `add` with the samples at the corners of each triangle, counter-clockwise if rows run
  // downwards. Points omitted on a thinned side move to the neighbour at which the diagonals start
  // (docs/theory/terrain.md); degenerate triangles are omitted.
  void for_each_triangle(const auto& add) const {
    for (int j = 0; j < size_.y; ++j) {
      for (int i = 0; i < size_.x; ++i) {
        const glm::ivec2 nw = kept({i, j}), ne = kept({i + 1, j}), sw = kept({i, j + 1}),
                         se = kept({i + 1, j + 1});
        try_triangle({nw, sw, ne}, add);
        try_triangle({se, ne, sw}, add);
      }
    }
  }

 private:
  int count(int first, int last) const {
    return std::min(level_.leaf_cells, (last - first + leaf_.step - 1) / leaf_.step);
  }
  int index(int sample, int first) const {
    return (sample - first + level_.step - 1) / level_.step;
  }
  bool thins(Leaf::Side side) const { return (leaf_.coarser & side) != 0; }

  glm::ivec2 kept(glm::ivec2 p) const {
    const glm::ivec2 at = sample(p);
    if (p.x % 2 == 1 && at.x < last_.x) {
      if (p.y == 0 && thins(Leaf::North)) return sample(p - glm::ivec2(1, 0));
      if (p.y == size_.y && thins(Leaf::South)) return sample(p + glm::ivec2(1, 0));
    }
    if (p.y % 2 == 1 && at.y < last_.y) {
      if (p.x == 0 && thins(Leaf::West)) return sample(p - glm::ivec2(0, 1));
      if (p.x == size_.x && thins(Leaf::East)) return sample(p + glm::ivec2(0, 1));
    }
    return at;
  }

  void try_triangle(const std::array<glm::ivec2, 3>& corner, const auto& add) const {
    const glm::ivec2 u = corner[1] - corner[0], v = corner[2] - corner[0];
    if (std::int64_t{u.x} * v.y == std::int64_t{u.y} * v.x) return;
    for (const glm::ivec2& at : corner) {
      if (std::isnan(height_m(at))) return;
    }
    add(corner);
  }

  const Level& level_;
  const Leaf& leaf_;
  glm::ivec2 last_, size_;
};

struct Triangle {
  std::array<Key, 3> corner;
};

// Triangles of all leaves, leaf by leaf.
struct GatheredLeaves {
  std::vector<Triangle> triangles;
  std::vector<float> clipmap_level, exponent, deviation_m;
  std::vector<std::pair<Key, float>> points;  // samples with their heights; may contain duplicates
};

GatheredLeaves gather(std::span<const Level> levels) {
  GatheredLeaves all;
  for (const Level& level : levels) {
    const auto number = static_cast<float>(std::countr_zero(static_cast<unsigned>(level.step)));
    for (const Leaf& leaf : level.leaves) {
      const LeafShape shape(level, leaf);
      const auto exponent = static_cast<float>(std::countr_zero(static_cast<unsigned>(leaf.step)));
      for (int j = 0; j <= shape.size().y; ++j) {
        for (int i = 0; i <= shape.size().x; ++i) {
          const glm::ivec2 sample = shape.sample({i, j});
          all.points.emplace_back(key_of(sample), shape.height_m(sample));
        }
      }
      shape.for_each_triangle([&](const std::array<glm::ivec2, 3>& corner) {
        all.triangles.push_back({{key_of(corner[0]), key_of(corner[1]), key_of(corner[2])}});
        all.clipmap_level.push_back(number);
        all.exponent.push_back(exponent);
        all.deviation_m.push_back(leaf.deviation_m);
      });
    }
  }
  return all;
}

void keep_one_of_each(std::vector<std::pair<Key, float>>& points) {
  std::erase_if(points, [](const auto& point) { return std::isnan(point.second); });
  tbb::parallel_sort(points.begin(), points.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto last = std::ranges::unique(points, {}, [](const auto& point) { return point.first; });
  points.erase(last.begin(), last.end());
}

std::vector<glm::uvec3> number_corners(const GatheredLeaves& all, bool is_mirrored) {
  std::vector<glm::uvec3> numbered(all.triangles.size());
  tbb::parallel_for(std::size_t{0}, numbered.size(), [&](std::size_t i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = std::ranges::lower_bound(all.points, all.triangles[i].corner[k], {},
                                                  [](const auto& point) { return point.first; });
      numbered[i][static_cast<glm::length_t>(k)] =
          static_cast<std::uint32_t>(found - all.points.begin());
    }
    if (is_mirrored) std::swap(numbered[i].y, numbered[i].z);
  });
  return numbered;
}

// Returns names for cell sizes, by the power of two relative to a cell of the DEM or relief.
std::map<int, std::string> cell_sizes(const Level& level, std::span<const float> exponents) {
  std::map<int, std::string> names;
  const double cell_m = std::abs(level.frame.step_m.x);
  for (const float exponent : exponents) {
    const int power = static_cast<int>(exponent);
    if (!names.contains(power)) names[power] = fmt::format("{:.4g} m", std::ldexp(cell_m, power));
  }
  return names;
}

// Returns names for clipmap levels: their numbers and finest cell sizes.
std::map<int, std::string> level_names(const Level& level, std::span<const float> numbers) {
  std::map<int, std::string> names = cell_sizes(level, numbers);
  for (auto& [number, name] : names) name = fmt::format("{}: {}", number, name);
  return names;
}

void add_columns(Layer& layer, const GatheredLeaves& all, const Level& level) {
  std::vector<float> height(all.points.size());
  std::ranges::transform(all.points, height.begin(), [&](const auto& p) { return p.second; });
  add_column(layer, {.name = "height", .unit = "m", .scale = ColourScale::Earth}, height);
  add_slopes(layer);
  LayerColumn ordered{.of = LayerColumn::Of::Cells, .is_ordered = true};
  ordered.name = "clipmap level";
  ordered.categories = level_names(level, all.clipmap_level);
  add_column(layer, ordered, all.clipmap_level);
  ordered.name = "cell size";
  ordered.categories = cell_sizes(level, all.exponent);
  add_column(layer, ordered, all.exponent);
  add_column(layer, {.name = "certified deviation", .unit = "m", .of = LayerColumn::Of::Cells},
             all.deviation_m);
}

}  // namespace

std::size_t count_triangles(std::span<const Level> levels) {
  std::size_t count = 0;
  for (const Level& level : levels) {
    for (const Leaf& leaf : level.leaves) {
      const glm::ivec2 size = LeafShape(level, leaf).size();
      count += std::size_t{2} * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
    }
  }
  return count;
}

Layer terrain_layer(std::span<const Level> levels, const glm::dvec3& origin_w_m,
                    const glm::dvec3& near_m) {
  GatheredLeaves all = gather(levels);
  keep_one_of_each(all.points);
  Layer layer{
      .name = "terrain", .kind = LayerKind::Terrain, .data = make_points(all.points.size())};
  if (levels.empty()) return layer;
  const GridFrame& frame = levels.front().frame;
  const glm::dvec3 origin(glm::round(near_m.x), glm::round(near_m.y), 0);
  layer.origin_w_m = origin_w_m + origin;
  const auto places = coordinates(*layer.data);
  tbb::parallel_for(std::size_t{0}, all.points.size(), [&](std::size_t i) {
    const glm::dvec2 p = frame.to_D(sample_of(all.points[i].first)) - glm::dvec2(origin);
    places[3 * i] = static_cast<float>(p.x);
    places[3 * i + 1] = static_cast<float>(p.y);
    places[3 * i + 2] = all.points[i].second;
  });
  // gather() assumes that rows run downwards: if they run from north to south, its triangles are
  // counter-clockwise from above.
  set_triangles(*layer.data, number_corners(all, frame.step_m.x * frame.step_m.y > 0));
  add_normals(layer);
  add_columns(layer, all, levels.front());
  layer.coloured_by = "height";
  return layer;
}

}  // namespace groundray
