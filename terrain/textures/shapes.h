#pragma once

// Private to the library: shapes to lay on a canvas. Places and lengths are in pixels, heights in
// m.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "terrain/textures/canvas.h"
#include "terrain/textures/noise.h"

namespace groundray::ground {

/// Returns the share of a pixel that lies within `reach` of a line at `distance`.
inline float edge_cover(float reach, float distance) noexcept {
  return std::clamp(reach - distance + 0.5f, 0.0f, 1.0f);
}

/// Straight piece of a blade, needle, stalk or twig.
struct Strip {
  glm::vec2 begin{0}, along{1, 0};  ///< `along` is a unit vector
  float length = 1;
  float half_begin = 1, half_end = 1;  ///< half of its width
  float z_begin_m = 0, z_end_m = 0;
  float round_m = 0;  ///< height of its middle above its sides
  glm::vec3 color_begin{0}, color_end{0};
  float crease = 0;  ///< how much one side is brighter than the other, relative
  float roughness = 1;

  float reach() const noexcept { return std::max(half_begin, half_end) + 1; }
  Span columns() const noexcept { return bounds(begin.x, along.x); }
  Span rows() const noexcept { return bounds(begin.y, along.y); }
  Span columns(float y) const noexcept {
    const Span all = columns();
    if (std::abs(along.y) < 0.05f) return all;
    const float x = begin.x + (y - begin.y) * along.x / along.y;
    const float side = reach() / std::abs(along.y);
    return {std::max(all.low, x - side), std::min(all.high, x + side)};
  }
  Paint paint(float x, float y) const noexcept {
    const glm::vec2 p = glm::vec2(x, y) - begin;
    const float far = glm::dot(p, along), t = std::clamp(far / length, 0.0f, 1.0f);
    const float side = p.y * along.x - p.x * along.y;
    const float half = half_begin + t * (half_end - half_begin);
    const float cover = edge_cover(half, std::abs(side)) *
                        edge_cover(length / 2, std::abs(far - length / 2)) *
                        std::min(1.0f, 2 * half + 0.3f);
    const float across = std::clamp(side / std::max(half, 0.5f), -1.0f, 1.0f);
    const float z_m = z_begin_m + t * (z_end_m - z_begin_m) + round_m * (1 - across * across);
    return {
        cover,
        {z_m, (color_begin + t * (color_end - color_begin)) * (1 + crease * across), roughness}};
  }

 private:
  Span bounds(float from, float direction) const noexcept {
    const float to = from + direction * length;
    return {std::min(from, to) - reach(), std::max(from, to) + reach()};
  }
};

/// Half widths of a leaf at equal steps from its stalk to its tip, as shares of the widest.
using LeafOutline = std::array<float, 25>;

/// Leaf of a tree that lies on the ground.
struct Leaf {
  const LeafOutline* outline = nullptr;
  glm::vec2 middle{0}, along{1, 0};  ///< `along` is a unit vector from stalk to tip
  float length = 1, half = 1;        ///< half of the greatest width
  float z_m = 0;                     ///< of its middle
  glm::vec2 tilt_m{0};               ///< rise from the middle to the tip, and to the left side
  float curl_m = 0;                  ///< rise of the sides; negative if they hang
  glm::vec3 color{0};
  float vein = 0.2f;  ///< by how much the veins are brighter, relative
  float mottle = 0.1f;
  std::uint32_t pattern = 0;
  const Field* spots = nullptr;  ///< for its mottling
  float roughness = 0.8f;

  float reach() const noexcept { return std::max(length / 2, half) + 1; }
  Span columns() const noexcept {
    return {middle.x - bound(along.x, along.y), middle.x + bound(along.x, along.y)};
  }
  Span rows() const noexcept {
    return {middle.y - bound(along.y, along.x), middle.y + bound(along.y, along.x)};
  }
  Span columns(float) const noexcept { return columns(); }
  Paint paint(float x, float y) const noexcept {
    const glm::vec2 p = glm::vec2(x, y) - middle;
    const float far = glm::dot(p, along), side = p.y * along.x - p.x * along.y;
    const float t = far / length + 0.5f;
    if (t <= 0 || t >= 1) return {};
    const float place = t * static_cast<float>(outline->size() - 1);
    const auto step = static_cast<std::size_t>(place);
    const float part = place - static_cast<float>(step);
    const float width =
        half * ((*outline)[step] + part * ((*outline)[step + 1] - (*outline)[step]));
    const float cover = edge_cover(width, std::abs(side));
    if (cover <= 0) return {};
    const float across = side / half;
    // The midrib, and side veins that point to the tip.
    float shade = std::abs(side) < std::max(0.03f * half, 0.6f) ? 1 + vein : 1;
    const float order = t * 9 - std::abs(across) * 1.6f, gap = order - std::floor(order);
    if (gap < 0.14f) shade += 0.5f * vein;
    shade *= 1 + mottle * spots->at(static_cast<int>(x) + static_cast<int>(pattern & 0xfff),
                                    static_cast<int>(y) + static_cast<int>(pattern >> 12 & 0xfff));
    // A leaf dries from its rim.
    shade *= 0.82f + 0.18f * std::min(1.0f, 3 * (width - std::abs(side)) / half);
    const float wave = (gap - 0.5f) * (gap - 0.5f) - 0.125f;
    const float z = z_m + tilt_m.x * (2 * t - 1) + tilt_m.y * across +
                    curl_m * (across * across + 0.35f * (2 * t - 1) * (2 * t - 1)) + 0.002f * wave;
    return {cover, {z, color * shade, roughness}};
  }

 private:
  float bound(float a, float b) const noexcept {
    return std::abs(a) * length / 2 + std::abs(b) * half + 1;
  }
};

/// Stone, clod or grain: the upper half of an ellipsoid, from which planes have cut facets.
struct Stone {
  glm::vec2 middle{0}, along{1, 0};
  float half_long = 1, half_short = 1;
  float z_m = 0, height_m = 0;  ///< of its rim; of its top above that
  struct Cut {
    glm::vec2 slope{0};  ///< relative to the axes
    float level = 1;     ///< height above the middle; relative to `height_m`
  };
  std::array<Cut, 4> cuts{};
  glm::vec3 color{0};
  float mottle = 0.1f;
  float uneven = 0;  ///< of its outline and surface, relative
  std::uint32_t pattern = 0;
  const Field* spots = nullptr;
  float roughness = 0.9f;

  Span columns() const noexcept { return {middle.x - half_long - 1, middle.x + half_long + 1}; }
  Span rows() const noexcept { return {middle.y - half_long - 1, middle.y + half_long + 1}; }
  Span columns(float y) const noexcept {
    const float away = y - middle.y, r = half_long + 1;
    const float side = std::sqrt(std::max(r * r - away * away, 0.0f));
    return {middle.x - side, middle.x + side};
  }
  Paint paint(float x, float y) const noexcept {
    const glm::vec2 p = glm::vec2(x, y) - middle;
    const glm::vec2 q(glm::dot(p, along) / half_long, (p.y * along.x - p.x * along.y) / half_short);
    float square = glm::dot(q, q);
    if (square >= 1.6f) return {};
    const float spot = spots->at(static_cast<int>(x) + static_cast<int>(pattern & 0xfff),
                                 static_cast<int>(y) + static_cast<int>(pattern >> 12 & 0xfff));
    square *= std::max(1 + uneven * spot, 0.2f);
    const float cover = edge_cover(half_short, half_short * std::sqrt(square));
    if (cover <= 0) return {};
    float level = std::sqrt(std::max(1 - square, 0.0f));
    for (const Cut& cut : cuts) level = std::min(level, cut.level + glm::dot(cut.slope, q));
    if (level < 0) return {};  // cut off
    return {cover, {z_m + height_m * level, color * (1 + mottle * spot), roughness}};
  }
};

/// Shoot of moss or of lichen, seen from its tip: a dome of leaflets that point outwards.
struct Tuft {
  glm::vec2 middle{0};
  float radius = 2;
  glm::vec2 turn{1, 0};  ///< direction of its first leaflet, unit
  float z_m = 0, height_m = 0.003f;
  glm::vec3 color{0}, tip_color{0};
  float gaps = 0.28f;  ///< depth of the gaps between leaflets, relative to the radius
  float roughness = 0.95f;

  Span columns() const noexcept { return {middle.x - radius - 1, middle.x + radius + 1}; }
  Span rows() const noexcept { return {middle.y - radius - 1, middle.y + radius + 1}; }
  Span columns(float) const noexcept { return columns(); }
  Paint paint(float x, float y) const noexcept {
    const glm::vec2 p = (glm::vec2(x, y) - middle) / radius;
    const float square = glm::dot(p, p);
    if (square >= 1) return {};
    const glm::vec2 q(p.x * turn.x + p.y * turn.y, p.y * turn.x - p.x * turn.y);
    // The real part of (q_x + i q_y)^5 is |q|^5 cos(5 angle).
    const float x2 = q.x * q.x, y2 = q.y * q.y;
    const float five = q.x * (x2 * x2 - 10 * x2 * y2 + 5 * y2 * y2);
    const float r = std::sqrt(square);
    const float star = five / std::max(square * square * r, 1e-4f);
    const float reach = 1 - gaps + gaps * star;
    const float cover = std::clamp((reach - r) * radius + 0.5f, 0.0f, 1.0f);
    if (cover <= 0) return {};
    const float share = std::min(r / reach, 1.0f);
    const float light = 0.75f + 0.25f * star;
    return {cover,
            {z_m + height_m * (1 - share * share),
             (tip_color + share * (color - tip_color)) * light, roughness}};
  }
};

}  // namespace groundray::ground
