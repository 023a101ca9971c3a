#include "terrain/judge/mesh_deviation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "terrain/judge/facet_set.h"

namespace groundray::judge {
namespace {

std::int64_t floor_of(std::int64_t numerator, std::int64_t denominator) {
  const std::int64_t quotient = numerator / denominator;
  const bool below = numerator % denominator != 0 && (numerator < 0) != (denominator < 0);
  return quotient - (below ? 1 : 0);
}

struct ColumnRange {
  std::int64_t low = std::numeric_limits<std::int64_t>::max();
  std::int64_t high = std::numeric_limits<std::int64_t>::min();
};

// Column range of the triangle between two rows: of samples if both are the same row, else of
// cells.
ColumnRange columns_between(const Corners& t, int row, int end_row) {
  ColumnRange range;
  const auto add = [&](std::int64_t numerator, std::int64_t denominator, std::int64_t offset) {
    const std::int64_t below = offset + floor_of(numerator, denominator);
    const std::int64_t above = offset - floor_of(-numerator, denominator);
    range.low = std::min(range.low, row == end_row ? above : below);
    range.high = std::max(range.high, row == end_row ? below : above);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::ivec2 p = t[i];
    const glm::ivec2 q = t[(i + 1) % 3];
    const int begin = std::max(row, std::min(p.y, q.y));
    const int end = std::min(end_row, std::max(p.y, q.y));
    if (begin > end) continue;
    for (const int y : {begin, end}) {
      if (p.y == q.y) {
        add(0, 1, p.x);
        add(0, 1, q.x);
      } else {
        add(std::int64_t{q.x - p.x} * (y - p.y), q.y - p.y, p.x);
      }
    }
  }
  return range;
}

bool all_outside(const Corners& of, const Corners& points) {
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::ivec2 edge = of[(i + 1) % 3] - of[i];
    if (std::ranges::all_of(points, [&](glm::ivec2 p) { return cross(edge, p - of[i]) <= 0; })) {
      return true;
    }
  }
  return false;
}

// True if two triangles of positive area overlap in more than boundary points: otherwise the line
// through an edge of one separates them.
bool overlap(const Corners& a, const Corners& b) {
  return !all_outside(a, b) && !all_outside(b, a);
}

class DeviationSearch {
 public:
  DeviationSearch(const HeightGrid& grid, const AllowedDeviation& allowed_m)
      : facets_(grid), allowed_m_(allowed_m), seen_(grid.heights_m().size()) {
    if (!facets_.whole()) count_missing();
  }

  void add(std::size_t index, Corners t) {
    if (doubled_area(t) < 0) std::swap(t[1], t[2]);
    triangle_ = index;
    at_samples(t);
    for (std::size_t i = 0; i < 3; ++i) {
      for (const Family& family : families) at_crossings(t[i], t[(i + 1) % 3], family);
    }
    if (!facets_.whole() && covers_missing(t)) ++found_.over_missing;
  }

  MeshDeviation found() const {
    MeshDeviation found = found_;
    const Real count = static_cast<Real>(std::max<std::size_t>(1, found.samples));
    found.rms_m = static_cast<double>(std::sqrt(sum_squared_ / count));
    return found;
  }

 private:
  void note(glm::dvec2 place, Real reference_m, Real difference_m) {
    const auto deviation_m = static_cast<double>(std::abs(difference_m));
    if (deviation_m > found_.largest_m) {
      found_.largest_m = deviation_m;
      found_.place = place;
      found_.triangle = triangle_;
    }
    if (!allowed_m_) return;
    const glm::dvec3 point(place, static_cast<double>(reference_m));
    found_.largest_excess_m = std::max(found_.largest_excess_m, deviation_m - allowed_m_(point));
  }

  void at_samples(const Corners& t) {
    const auto area = static_cast<Real>(doubled_area(t));
    const Real base = facets_.height_m(t[0]);
    const Real rise1 = facets_.height_m(t[1]) - base;
    const Real rise2 = facets_.height_m(t[2]) - base;
    const auto [first, last] = std::minmax({t[0].y, t[1].y, t[2].y});
    for (int row = first; row <= last; ++row) {
      const ColumnRange range = columns_between(t, row, row);
      for (std::int64_t column = range.low; column <= range.high; ++column) {
        const glm::ivec2 p(static_cast<int>(column), row);
        if (!facets_.whole() && !facets_.sample_exists(p)) continue;
        const Real reference_m = facets_.height_m(p);
        const auto w1 = static_cast<Real>(cross(p - t[0], t[2] - t[0]));
        const auto w2 = static_cast<Real>(cross(t[1] - t[0], p - t[0]));
        const Real difference_m = (base - reference_m) + (w1 * rise1 + w2 * rise2) / area;
        note(p, reference_m, difference_m);
        std::uint8_t& seen = seen_[index_of(p)];
        if (seen == 0) {
          sum_squared_ += difference_m * difference_m;
          ++found_.samples;
        }
        seen = 1;
      }
    }
  }

  // Visits the points between samples where the edge from p to q crosses lines of the family.
  void at_crossings(glm::ivec2 p, glm::ivec2 q, const Family& family) {
    const int begin = level_of(family, p);
    const int length = level_of(family, q) - begin;
    const bool by_row = family.along.x == 0;  // position on a line: by row, else by column
    const std::int64_t from = by_row ? p.y : p.x;
    const std::int64_t by = (by_row ? q.y : q.x) - from;
    if (length == 0 || by == 0 || by % length == 0) return;  // crosses lines at samples only
    const Real base = facets_.height_m(p);
    const Real rise = facets_.height_m(q) - base;
    for (int step = length < 0 ? -1 : 1, n = step; n != length; n += step) {
      const std::int64_t whole = floor_of(by * n, length);
      const std::int64_t rest = by * n - whole * length;
      if (rest == 0) continue;
      const Real part = static_cast<Real>(rest) / static_cast<Real>(length);
      const int across = static_cast<int>(from + whole);
      const int level = begin + n;
      const glm::ivec2 a =
          by_row ? glm::ivec2(level, across) : glm::ivec2(across, level - family.level.x * across);
      if (!facets_.whole() && !facets_.edge_exists(family, a)) continue;
      const Real start_m = facets_.height_m(a);
      const Real reference_m = start_m + part * (facets_.height_m(a + family.along) - start_m);
      const Real mesh_m = base + rise * static_cast<Real>(n) / static_cast<Real>(length);
      note(glm::dvec2(a) + static_cast<double>(part) * glm::dvec2(family.along), reference_m,
           mesh_m - reference_m);
    }
  }

  bool covers_missing(const Corners& t) {
    const auto [left, right] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [first, last] = std::minmax({t[0].y, t[1].y, t[2].y});
    if (missing_within({left, first}, {right, last}) == 0) return false;
    for (int row = first; row < last; ++row) {
      const ColumnRange range = columns_between(t, row, row + 1);
      for (std::int64_t column = range.low; column < range.high; ++column) {
        const glm::ivec2 cell(static_cast<int>(column), row);
        for (const Corners& facet : {FacetSet::near(cell), FacetSet::far(cell)}) {
          if (facets_.exists(facet) || !overlap(t, facet)) continue;
          if (found_.over_missing == 0) found_.missing_cell = cell;
          return true;
        }
      }
    }
    return false;
  }

  std::size_t index_of(glm::ivec2 p) const {
    return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(facets_.last().x + 1) +
           static_cast<std::size_t>(p.x);
  }

  // missing_[p]: number of cells above and to the left of sample p that lack a facet.
  void count_missing() {
    missing_.resize(seen_.size());
    for (int row = 0; row < facets_.last().y; ++row) {
      std::int64_t in_row = 0;
      for (int column = 0; column < facets_.last().x; ++column) {
        const glm::ivec2 cell(column, row);
        in_row +=
            facets_.exists(FacetSet::near(cell)) && facets_.exists(FacetSet::far(cell)) ? 0 : 1;
        missing_[index_of(cell + 1)] = missing_[index_of(cell + rows.along)] + in_row;
      }
    }
  }

  std::int64_t missing_within(glm::ivec2 low, glm::ivec2 high) const {
    return missing_[index_of(high)] - missing_[index_of({low.x, high.y})] -
           missing_[index_of({high.x, low.y})] + missing_[index_of(low)];
  }

  FacetSet facets_;
  const AllowedDeviation& allowed_m_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::int64_t> missing_;
  std::size_t triangle_ = 0;
  Real sum_squared_ = 0;
  MeshDeviation found_;
};

}  // namespace

MeshDeviation largest_deviation(const HeightGrid& grid, std::span<const glm::ivec2> vertices,
                                std::span<const glm::uvec3> triangles,
                                const AllowedDeviation& allowed_m) {
  DeviationSearch search(grid, allowed_m);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3& t = triangles[i];
    search.add(i, {vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  }
  return search.found();
}

}  // namespace groundray::judge
