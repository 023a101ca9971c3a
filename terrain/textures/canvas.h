#pragma once

// Private to the library: ground seen from above, on which shapes are laid.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

#include "terrain/lod/pass.h"

namespace groundray::ground {

/// A point of the ground.
struct Texel {
  float z_m = 0;
  glm::vec3 color{0};  ///< linear
  float roughness = 1;
};

/// Appearance of a shape at a pixel.
struct Paint {
  float cover = 0;  ///< share of the pixel that it covers, at most 1
  Texel texel;
};

/// Square of ground whose side is a power of two of pixels; both axes wrap.
struct Canvas {
  int side;
  double size_m;
  PassRunner runner;
  std::vector<Texel> texels;

  Canvas(int pixels, double metres, PassRunner with)
      : side(pixels),
        size_m(metres),
        runner(std::move(with)),
        texels(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels)) {}

  float px_per_m() const noexcept { return static_cast<float>(side / size_m); }
  double area_m2() const noexcept { return size_m * size_m; }
};

/// Calls `base(x, y)` for the Texel of every pixel.
template <typename Base>
void fill(Canvas& canvas, const Base& base) {
  const auto side = static_cast<std::size_t>(canvas.side);
  run_pass(canvas.runner, side, [&](std::size_t row) {
    Texel* const texels = canvas.texels.data() + row * side;
    for (int x = 0; x < canvas.side; ++x) texels[x] = base(x, static_cast<int>(row));
  });
}

/// Interval of pixel coordinates.
struct Span {
  float low = 0, high = 0;
};

/// Lays the part of a shape that lies in a square of pixels with this corner.
template <typename Shape>
void lay_in(Canvas& canvas, const Shape& shape, glm::ivec2 corner, int width) {
  const auto pixel = [](float at) { return static_cast<int>(std::floor(at)); };
  const int mask = canvas.side - 1;
  const Span rows = shape.rows();
  const int last_row = std::min(pixel(rows.high), corner.y + width - 1);
  for (int y = std::max(pixel(rows.low), corner.y); y <= last_row; ++y) {
    const float y_px = static_cast<float>(y) + 0.5f;
    const Span span = shape.columns(y_px);
    const int last = std::min(pixel(span.high), corner.x + width - 1);
    Texel* const texels = canvas.texels.data() + static_cast<std::size_t>(y & mask) *
                                                     static_cast<std::size_t>(canvas.side);
    for (int x = std::max(pixel(span.low), corner.x); x <= last; ++x) {
      const Paint paint = shape.paint(static_cast<float>(x) + 0.5f, y_px);
      Texel& texel = texels[x & mask];
      if (paint.cover <= 0 || paint.texel.z_m < texel.z_m) continue;
      texel.z_m += paint.cover * (paint.texel.z_m - texel.z_m);
      texel.color += paint.cover * (paint.texel.color - texel.color);
      texel.roughness += paint.cover * (paint.texel.roughness - texel.roughness);
    }
  }
}

/// Lays shapes on a canvas, in their order: each hides what lies lower, in the share of a pixel
/// that it covers. A shape has `columns()` and `rows()`, its bounds in pixels, `columns(y)`, bounds
/// of its pixels in a row with that centre, and `paint(x, y)`. Tiles are independent, so that the
/// result is the same for any runner.
template <typename Shape>
void lay(Canvas& canvas, std::span<const Shape> shapes) {
  constexpr int tile = 64;
  const int tiles = canvas.side / tile;
  const auto count = static_cast<std::size_t>(tiles) * static_cast<std::size_t>(tiles);
  struct Entry {
    std::uint32_t shape;
    std::int16_t column, row;  // of the tile, not wrapped
  };
  const auto for_tiles = [&](const Shape& shape, const auto& act) {
    const Span columns = shape.columns(), rows = shape.rows();
    const auto number = [](float at) { return static_cast<int>(std::floor(at / tile)); };
    for (int row = number(rows.low); row <= number(rows.high); ++row) {
      for (int column = number(columns.low); column <= number(columns.high); ++column) {
        const int place = (row & (tiles - 1)) * tiles + (column & (tiles - 1));
        act(static_cast<std::size_t>(place), static_cast<std::int16_t>(column),
            static_cast<std::int16_t>(row));
      }
    }
  };
  std::vector<std::uint32_t> first(count + 1);
  for (const Shape& shape : shapes)
    for_tiles(shape, [&](std::size_t place, auto, auto) { ++first[place + 1]; });
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<Entry> entries(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t i = 0; i < shapes.size(); ++i) {
    for_tiles(shapes[i], [&](std::size_t place, std::int16_t column, std::int16_t row) {
      entries[next[place]++] = {i, column, row};
    });
  }
  run_pass(canvas.runner, count, [&](std::size_t place) {
    for (std::uint32_t i = first[place]; i < first[place + 1]; ++i) {
      const auto& [index, column, row] = entries[i];
      lay_in(canvas, shapes[index], glm::ivec2(column, row) * tile, tile);
    }
  });
}

}  // namespace groundray::ground
