// Exact mean of a texture over a footprint, weighted by each texel's area inside it.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "core/appearance/texture.h"
#include "core/geometry/footprint.h"

namespace groundray {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A convex polygon: a parallelogram clipped by up to eight lines.
struct ConvexPolygon {
  std::array<glm::dvec2, 12> corners;
  std::size_t size = 0;

  double least(glm::length_t axis) const noexcept {
    double value = infinity;
    for (std::size_t i = 0; i < size; ++i) value = std::min(value, corners[i][axis]);
    return value;
  }
  double greatest(glm::length_t axis) const noexcept {
    double value = -infinity;
    for (std::size_t i = 0; i < size; ++i) value = std::max(value, corners[i][axis]);
    return value;
  }
};

/// An interval along one axis.
struct Span {
  double begin, end;
};

/// Returns the part of a polygon on one side of the line coordinate `axis` = `bound`: beyond it if
/// `sign` is 1, before it if -1. The new corners lie exactly on the line.
/// @see Sutherland and Hodgman, Reentrant polygon clipping (1974).
ConvexPolygon cut(const ConvexPolygon& polygon, glm::length_t axis, double bound,
                  double sign) noexcept {
  ConvexPolygon kept;
  for (std::size_t i = 0; i < polygon.size; ++i) {
    const glm::dvec2& a = polygon.corners[i];
    const glm::dvec2& b = polygon.corners[i + 1 == polygon.size ? 0 : i + 1];
    const double from = sign * (a[axis] - bound), to = sign * (b[axis] - bound);
    if (from >= 0) kept.corners[kept.size++] = a;
    if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
      glm::dvec2 corner = a + from / (from - to) * (b - a);
      corner[axis] = bound;
      kept.corners[kept.size++] = corner;
    }
  }
  return kept;
}

/// Returns the part of a polygon in a span.
ConvexPolygon cut(const ConvexPolygon& polygon, glm::length_t axis, Span span) noexcept {
  const bool begins = polygon.least(axis)<span.begin, ends = polygon.greatest(axis)> span.end;
  if (!begins && !ends) return polygon;
  const ConvexPolygon beyond = begins ? cut(polygon, axis, span.begin, 1) : polygon;
  return ends ? cut(beyond, axis, span.end, -1) : beyond;
}

double area(const ConvexPolygon& polygon) noexcept {
  double doubled = 0;
  for (std::size_t i = 2; i < polygon.size; ++i) {
    const glm::dvec2 a = polygon.corners[i - 1] - polygon.corners[0];
    const glm::dvec2 b = polygon.corners[i] - polygon.corners[0];
    doubled += a.x * b.y - a.y * b.x;
  }
  return std::abs(doubled) / 2;
}

/// Returns the columns [begin, end) whose cells lie completely inside the polygon in one row.
/// @param strip  the polygon clipped to `row`; since it is convex, its chords at both ends of the
///               row determine the columns.
Span whole_columns(const ConvexPolygon& strip, Span row) noexcept {
  Span columns{-infinity, infinity};
  for (const double y : {row.begin, row.end}) {
    Span chord{infinity, -infinity};
    for (std::size_t i = 0; i < strip.size; ++i) {
      if (strip.corners[i].y != y) continue;
      chord.begin = std::min(chord.begin, strip.corners[i].x);
      chord.end = std::max(chord.end, strip.corners[i].x);
    }
    columns.begin = std::max(columns.begin, std::ceil(chord.begin));
    columns.end = std::min(columns.end, std::floor(chord.end));
  }
  return columns;
}

/// Cells of unit size along an axis: `count` of them, the first and last extended to infinity, or
/// infinitely many.
struct Cells {
  double count = infinity;
  double at(double x) const noexcept {
    return count < infinity ? std::clamp(std::floor(x), 0.0, count - 1) : std::floor(x);
  }
  Span span(double cell) const noexcept {
    const bool bounded = count < infinity;
    return {bounded && cell == 0 ? -infinity : cell,
            bounded && cell == count - 1 ? infinity : cell + 1};
  }
};

/// Decomposes a polygon by cells: calls whole(row, begin, end) for columns [begin, end) of cells
/// that lie inside, and part(row, column, clipped polygon) for each cell on its boundary.
template <typename Whole, typename Part>
void cover(const ConvexPolygon& polygon, Cells columns, Cells rows, const Whole& whole,
           const Part& part) noexcept {
  const double last_row = rows.at(polygon.greatest(1));
  for (double row = rows.at(polygon.least(1)); row <= last_row; ++row) {
    const ConvexPolygon strip = cut(polygon, 1, rows.span(row));
    if (strip.size < 3) continue;
    Span inside = whole_columns(strip, rows.span(row));
    if (columns.count < infinity) {
      inside = {std::max(inside.begin, 1.0), std::min(inside.end, columns.count - 1)};
    }
    const bool has_inside = inside.begin < inside.end;
    if (has_inside) whole(row, inside.begin, inside.end);
    const double last_column = columns.at(strip.greatest(0));
    for (double column = columns.at(strip.least(0)); column <= last_column; ++column) {
      if (has_inside && column == inside.begin) column = inside.end;
      if (column > last_column) break;
      const ConvexPolygon cell = cut(strip, 0, columns.span(column));
      if (cell.size >= 3) part(row, column, cell);
    }
  }
}

/// Returns the sides of a footprint, made finite, at most `longest`, and not parallel.
std::array<glm::dvec2, 2> tamed(glm::dvec2 a, glm::dvec2 b, glm::dvec2 longest) noexcept {
  constexpr double thinnest = 1e-6;  // texels
  for (glm::dvec2* side : {&a, &b}) {
    const glm::dvec2 share = glm::abs(*side) / longest;
    const double excess = std::max(share.x, share.y);
    if (excess > 1) *side /= excess;
    if (!(share.x + share.y < infinity)) *side = glm::dvec2(0);  // also if NaN
  }
  glm::dvec2& major = glm::dot(a, a) >= glm::dot(b, b) ? a : b;
  glm::dvec2& minor = &major == &a ? b : a;
  const double length = glm::length(major);
  if (length < thinnest) return {glm::dvec2(thinnest, 0), glm::dvec2(0, thinnest)};
  const double width = (major.x * minor.y - major.y * minor.x) / length;
  if (std::abs(width) < thinnest) {
    minor += (std::copysign(thinnest, width) - width) / length * glm::dvec2(-major.y, major.x);
  }
  return {a, b};
}

/// Area-weighted sum over the part of a footprint that is covered so far.
struct Sum {
  glm::dvec4 light{0};
  double area = 0;
};

}  // namespace

glm::dvec3 Texture::exact_color(glm::dvec2 uv, const Footprint& footprint) const noexcept {
  constexpr double most_images = 1000;
  const glm::dvec2 texels(size());
  const bool repeats = wrap_ == Wrap::Repeat;
  const auto [a, b] = tamed(footprint.a_uv * texels, footprint.b_uv * texels, most_images * texels);
  // Texel coordinates, from the upper left corner of the image, rows downwards.
  const auto near = [&](double x) {  // offsets by whole images change nothing
    return repeats ? x - std::floor(x) : std::clamp(x, -most_images, most_images);
  };
  glm::dvec2 centre(near(uv.x), 1 - near(uv.y));
  for (const glm::length_t i : {0, 1}) {
    if (!(std::abs(centre[i]) <= 2 * most_images)) centre[i] = i == 0 ? 0 : 1;
  }
  const glm::dvec2 right = glm::dvec2(a.x, -a.y) / 2.0, up = glm::dvec2(b.x, -b.y) / 2.0;
  const glm::dvec2 c = centre * texels;
  const ConvexPolygon polygon{{c - right - up, c + right - up, c + right + up, c - right + up}, 4};

  Sum sum;
  const auto add_image = [&](const ConvexPolygon& part) {
    cover(
        part, {texels.x}, {texels.y},
        [&](double row, double begin, double end) {
          sum.light +=
              row_sum(static_cast<int>(row), static_cast<int>(begin), static_cast<int>(end) - 1);
          sum.area += end - begin;
        },
        [&](double row, double column, const ConvexPolygon& cell) {
          const double share = area(cell);
          const auto x = static_cast<int>(column);
          sum.light += share * row_sum(static_cast<int>(row), x, x);
          sum.area += share;
        });
  };
  if (!repeats) {
    add_image(polygon);
  } else {
    ConvexPolygon images = polygon;
    for (std::size_t i = 0; i < images.size; ++i) images.corners[i] /= texels;
    cover(
        images, {}, {},
        [&](double, double begin, double end) {
          const double count = (end - begin) * texels.x * texels.y;
          sum.light += count * mean_;
          sum.area += count;
        },
        [&](double row, double column, const ConvexPolygon& part) {
          ConvexPolygon image = part;
          for (std::size_t i = 0; i < image.size; ++i) {
            image.corners[i] = (image.corners[i] - glm::dvec2(column, row)) * texels;
          }
          add_image(image);
        });
  }
  return glm::dvec3(sum.light) / sum.area;
}

}  // namespace groundray
