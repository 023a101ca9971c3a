#include "core/appearance/texture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <type_traits>
#include <utility>

#include "core/appearance/tiling.h"
#include "core/error.h"
#include "core/image/srgb.h"

namespace groundray {
namespace {

using DecodingTable = std::array<float, 256>;

const DecodingTable& linear_table() {
  static const DecodingTable table = [] {
    DecodingTable values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) / 255;
    return values;
  }();
  return table;
}

const DecodingTable& srgb_table() {
  static const DecodingTable table = [] {
    DecodingTable values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(linear_of_srgb(static_cast<double>(i) / 255));
    }
    return values;
  }();
  return table;
}

/// Texels of one level as they are stored.
template <typename T>
struct Texels {
  const T* values;
  int width, height;
  std::size_t channels;
  const T* at(int column, int row) const noexcept {
    return values + (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(column)) *
                        channels;
  }
};

struct FloatTexels : Texels<float> {
  static float decode(float value, std::size_t) noexcept { return value; }
};

struct WordTexels : Texels<std::uint16_t> {
  static float decode(std::uint16_t value, std::size_t) noexcept {
    return static_cast<float>(value) * (1.0f / 65535);  // 65535 gives 1 exactly
  }
};

struct ByteTexels : Texels<std::uint8_t> {
  const float* colors;
  const float* alphas;
  float decode(std::uint8_t value, std::size_t channel) const noexcept {
    return (channel == channels - 1 ? alphas : colors)[value];
  }
};

/// Expands grey or colour, with or without alpha, to red, green, blue and alpha.
template <typename T>
glm::vec<4, T> spread(const std::array<T, 4>& v, std::size_t channels) noexcept {
  switch (channels) {
    case 1:
      return {v[0], v[0], v[0], 1};
    case 2:
      return {v[0], v[0], v[0], v[1]};
    case 3:
      return {v[0], v[1], v[2], 1};
    default:
      return {v[0], v[1], v[2], v[3]};
  }
}

double wrapped(double u, Wrap wrap) noexcept {
  const double inside = wrap == Wrap::Repeat ? u - std::floor(u) : std::clamp(u, 0.0, 1.0);
  return inside >= 0 && inside <= 1 ? inside : 0;  // 0 if `inside` is NaN
}

/// The two texels nearest a point along one axis, and the fraction of the way from the first to the
/// second.
struct Taps {
  int first, second;
  float t;
};

Taps taps(double inside, int size, Wrap wrap) noexcept {
  const double at = inside * size - 0.5;
  const double whole = std::floor(at);
  const int first = static_cast<int>(whole);
  const int last = size - 1;
  const bool repeats = wrap == Wrap::Repeat;
  return {first < 0 ? (repeats ? last : 0) : first,
          first >= last ? (repeats ? 0 : last) : first + 1, static_cast<float>(at - whole)};
}

float mix(float a, float b, float t) noexcept { return a + t * (b - a); }

template <typename Store>
glm::vec4 interpolate(const Store& texels, glm::dvec2 inside, Wrap wrap) noexcept {
  const Taps x = taps(inside.x, texels.width, wrap);
  const Taps y = taps(1 - inside.y, texels.height, wrap);
  const auto* const a = texels.at(x.first, y.first);
  const auto* const b = texels.at(x.second, y.first);
  const auto* const c = texels.at(x.first, y.second);
  const auto* const d = texels.at(x.second, y.second);
  std::array<float, 4> values{};
  for (std::size_t i = 0; i < texels.channels; ++i) {
    values[i] = mix(mix(texels.decode(a[i], i), texels.decode(b[i], i), x.t),
                    mix(texels.decode(c[i], i), texels.decode(d[i], i), x.t), y.t);
  }
  return spread(values, texels.channels);
}

/// Weights of up to three texels in a texel of the next level, along one axis. If their number is
/// odd, 2 m + 1, each of the m texels covers 2 + 1/m of them (docs/reference/textures.md).
struct Shares {
  int first;
  std::size_t count;
  std::array<double, 3> weights;
};

Shares shares(int index, int fine, int coarse) noexcept {
  if (fine == 1) return {0, 1, {1}};
  if (fine == 2 * coarse) return {2 * index, 2, {0.5, 0.5}};
  const double m = coarse, whole = 2 + 1 / m;
  return {2 * index, 3, {(m - index) / m / whole, 1 / whole, (index + 1) / m / whole}};
}

template <typename T>
T encode(double value) noexcept {
  if constexpr (std::is_same_v<T, std::uint16_t>) {
    return static_cast<T>(std::nearbyint(value * 65535));  // ties to even: no drift
  } else {
    return static_cast<T>(value);
  }
}

/// Writes row `row` of the level after `fine`.
template <typename Store, typename T>
void halve_row(const Store& fine, int row, glm::ivec2 size, T* to) noexcept {
  const Shares y = shares(row, fine.height, size.y);
  for (int column = 0; column < size.x; ++column) {
    const Shares x = shares(column, fine.width, size.x);
    std::array<double, 4> sums{};
    for (std::size_t j = 0; j < y.count; ++j) {
      const auto* value = fine.at(x.first, y.first + static_cast<int>(j));
      for (std::size_t i = 0; i < x.count; ++i) {
        const double weight = x.weights[i] * y.weights[j];
        for (std::size_t c = 0; c < fine.channels; ++c) {
          sums[c] += weight * static_cast<double>(fine.decode(*value++, c));
        }
      }
    }
    for (std::size_t c = 0; c < fine.channels; ++c) *to++ = encode<T>(sums[c]);
  }
}

void check_texture_channels(int channels) {
  if (channels < 1 || channels > 4) {
    throw Error(
        "texture: its image has {} channels; it must have 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 "
        "(RGB, alpha)",
        channels);
  }
}

}  // namespace

Texture::Texture(Image8 image, Encoding encoding, Wrap wrap)
    : channels_(image.channels()),
      wrap_(wrap),
      color_table_((encoding == Encoding::Srgb ? srgb_table() : linear_table()).data()),
      bytes_(std::move(image)) {
  check_texture_channels(channels_);
  build();
  build_mips(byte_mips_);
  if (!has_alpha()) return;
  const auto values = bytes_.values();
  const auto step = static_cast<std::size_t>(channels_);
  alpha_.resize(values.size() / step);
  for (std::size_t i = 0; i < alpha_.size(); ++i) alpha_[i] = values[i * step + step - 1];
}

Texture::Texture(ImageF image, Wrap wrap)
    : channels_(image.channels()), wrap_(wrap), floats_(std::move(image)) {
  check_texture_channels(channels_);
  if (!std::ranges::all_of(floats_.values(), [](float value) { return std::isfinite(value); })) {
    throw Error("texture: its image contains a value that is not finite: correct the image");
  }
  build();
  build_mips(float_mips_);
}

template <typename Act>
auto Texture::with_level(int level, const Act& act) const noexcept {
  const auto& [width, height, first] = levels_[static_cast<std::size_t>(level)];
  const auto channels = static_cast<std::size_t>(channels_);
  if (color_table_ == nullptr) {
    const float* const values = level == 0 ? floats_.values().data() : &float_mips_[first];
    return act(FloatTexels{{values, width, height, channels}});
  }
  if (level > 0) {
    return act(WordTexels{{byte_mips_.data() + first, width, height, channels}});
  }
  const float* const alphas = has_alpha() ? linear_table().data() : color_table_;
  return act(ByteTexels{{bytes_.values().data(), width, height, channels}, color_table_, alphas});
}

void Texture::build() {
  int width = std::max(bytes_.width(), floats_.width());
  int height = std::max(bytes_.height(), floats_.height());
  std::size_t first = 0;
  levels_.push_back({width, height, 0});
  while (width > 1 || height > 1) {
    width = std::max(width / 2, 1);
    height = std::max(height / 2, 1);
    levels_.push_back({width, height, first});
    first += static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
             static_cast<std::size_t>(channels_);
  }
  std::vector<glm::dvec4> sums(static_cast<std::size_t>(size().y));
  tbb::parallel_for(0, size().y, [&](int row) {
    sums[static_cast<std::size_t>(row)] = row_sum(row, 0, size().x - 1);
  });
  for (const glm::dvec4& sum : sums) mean_ += sum;
  mean_ /= static_cast<double>(size().x) * size().y;
}

template <typename T>
void Texture::build_mips(std::vector<T>& mips) {
  const auto channels = static_cast<std::size_t>(channels_);
  const Level& last = levels_.back();
  if (levels_.size() > 1) mips.resize(last.first + channels);
  for (int level = 1; level < levels(); ++level) {
    T* const to = &mips[levels_[static_cast<std::size_t>(level)].first];
    const glm::ivec2 half = size(level);
    with_level(level - 1, [&](const auto& fine) {
      tbb::parallel_for(0, half.y, [&](int row) {
        const auto skipped = static_cast<std::size_t>(row) * static_cast<std::size_t>(half.x);
        halve_row(fine, row, half, to + skipped * channels);
      });
    });
  }
}

glm::ivec2 Texture::size(int level) const noexcept {
  const Level& chosen = levels_[static_cast<std::size_t>(level)];
  return {chosen.width, chosen.height};
}

std::size_t Texture::memory_bytes() const noexcept {
  return bytes_.values().size_bytes() + floats_.values().size_bytes() + alpha_.size() +
         byte_mips_.size() * sizeof(byte_mips_[0]) + float_mips_.size() * sizeof(float_mips_[0]);
}

glm::vec4 Texture::texel(int level, int column, int row) const noexcept {
  return with_level(level, [&](const auto& texels) {
    const auto* const texel = texels.at(column, row);
    std::array<float, 4> values{};
    for (std::size_t i = 0; i < texels.channels; ++i) values[i] = texels.decode(texel[i], i);
    return spread(values, texels.channels);
  });
}

glm::dvec4 Texture::row_sum(int row, int first, int last) const noexcept {
  return with_level(0, [&](const auto& texels) {
    std::array<double, 4> sums{};
    const auto* texel = texels.at(first, row);
    for (int column = first; column <= last; ++column, texel += texels.channels) {
      for (std::size_t i = 0; i < texels.channels; ++i) {
        sums[i] += static_cast<double>(texels.decode(texel[i], i));
      }
    }
    glm::dvec4 sum = spread(sums, texels.channels);
    if (!has_alpha()) sum.w = last - first + 1;
    return sum;
  });
}

glm::vec4 Texture::bilinear(int level, glm::dvec2 uv) const noexcept {
  const glm::dvec2 inside(wrapped(uv.x, wrap_), wrapped(uv.y, wrap_));
  return with_level(level, [&](const auto& texels) { return interpolate(texels, inside, wrap_); });
}

glm::vec3 Texture::color(glm::dvec2 uv) const noexcept { return glm::vec3(bilinear(0, uv)); }

glm::vec3 Texture::color(glm::dvec2 uv, const Footprint& footprint,
                         Filtering filtering) const noexcept {
  return filtering == Filtering::Exact ? glm::vec3(exact_color(uv, footprint))
                                       : fast_color(uv, footprint);
}

float Texture::alpha(glm::dvec2 uv) const noexcept {
  if (!has_alpha()) return 1;
  if (alpha_.empty()) return bilinear(0, uv).w;
  const int width = levels_[0].width, height = levels_[0].height;
  const Taps x = taps(wrapped(uv.x, wrap_), width, wrap_);
  const Taps y = taps(1 - wrapped(uv.y, wrap_), height, wrap_);
  const auto at = [&](int column, int row) {
    return static_cast<float>(
        alpha_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(column)]);
  };
  return mix(mix(at(x.first, y.first), at(x.second, y.first), x.t),
             mix(at(x.first, y.second), at(x.second, y.second), x.t), y.t) /
         255;
}

/// Looks up with a kernel of `area`, in texels. Averaged over all positions, a lookup in a level
/// has the variance of a square of three times the area of its texels (1/12 for the texel and 1/6
/// for the tent). Between two levels the variance is linear in the weight of each. See
/// docs/reference/textures.md.
glm::vec4 Texture::trilinear(double area, glm::dvec2 uv) const noexcept {
  const double ratio = std::max(area / 3, 1.0);
  const auto exponent = static_cast<int>(std::bit_cast<std::uint64_t>(ratio) >> 52) - 1023;
  const int level = exponent / 2;
  if (level >= levels() - 1) return bilinear(levels() - 1, uv);
  const double t = (ratio / static_cast<double>(std::uint64_t{1} << 2 * level) - 1) / 3;
  const glm::vec4 fine = bilinear(level, uv);
  if (t == 0) return fine;
  return fine + static_cast<float>(t) * (bilinear(level + 1, uv) - fine);
}

glm::vec3 Texture::fast_color(glm::dvec2 uv, const Footprint& footprint) const noexcept {
  constexpr double most_lookups = 16;
  const glm::dvec2 texels(size());
  const glm::dvec2 a = footprint.a_uv * texels, b = footprint.b_uv * texels;
  // 12 times the covariance of the parallelogram; its eigenvalues are the squared sides of the
  // rectangle with the same moments.
  const double xx = a.x * a.x + b.x * b.x, xy = a.x * a.y + b.x * b.y, yy = a.y * a.y + b.y * b.y;
  const double gap = std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
  const double major = (xx + yy) / 2 + gap;
  if (!(major < std::numeric_limits<double>::max())) return glm::vec3(mean_);
  const double minor = (xx + yy) / 2 - gap;
  const double area = std::max({minor, 3.0, major / (most_lookups * most_lookups)});
  const double lookups = std::clamp(std::ceil(std::sqrt(major / area)), 1.0, most_lookups);
  if (lookups == 1) return glm::vec3(trilinear(area, uv));
  glm::dvec2 axis = xx >= yy ? glm::dvec2(major - yy, xy) : glm::dvec2(xy, major - xx);
  axis *= std::sqrt((major - area) / (lookups * lookups - 1)) / glm::length(axis);
  glm::vec4 sum(0);
  for (double i = (1 - lookups) / 2; i < lookups / 2; ++i) {
    sum += trilinear(area, uv + i * axis / texels);
  }
  return glm::vec3(sum) / static_cast<float>(lookups);
}

glm::dvec3 triplanar_weights(const glm::dvec3& normal) noexcept {
  // Components of a normal up to this value have no weight: sin(23.58 degrees). It is less than
  // 1/sqrt(3), so that at least one component has a weight.
  constexpr double silent_component = 0.4;
  const glm::dvec3 excess = glm::max(glm::abs(normal) - silent_component, glm::dvec3(0));
  const glm::dvec3 square = excess * excess;
  return square / (square.x + square.y + square.z);
}

glm::vec3 triplanar_color(const Texture& texture, const glm::dvec3& p_m, const glm::dvec3& normal,
                          const SurfacePatch& patch, double period_m, Filtering filtering,
                          Tiling tiling) noexcept {
  const glm::dvec3 weights = triplanar_weights(normal);
  glm::vec3 color(0);
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    if (weights[axis] == 0) continue;
    const glm::length_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    const auto flat = [&](const glm::dvec3& d_m) { return glm::dvec2(d_m[u], d_m[v]) / period_m; };
    const Footprint footprint{flat(patch.a_m), flat(patch.b_m)};
    color += static_cast<float>(weights[axis]) *
             tiled_color(texture, flat(p_m), footprint, filtering, tiling);
  }
  return color;
}

}  // namespace groundray
