#include "terrain/textures/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/math.h"
#include "core/mixed_bits.h"
#include "terrain/textures/dice.h"

namespace groundray::ground {
namespace {

// Adds independent numbers, uniform in [-amplitude, amplitude].
void add_white(Field& field, double amplitude, std::uint64_t seed, const PassRunner& runner) {
  const auto side = static_cast<std::size_t>(field.side);
  const auto scale = static_cast<float>(amplitude * 0x1p-31);
  run_pass(runner, side, [&](std::size_t row) {
    float* const values = field.values.data() + row * side;
    for (std::size_t i = 0; i < side; i += 2) {
      const std::uint64_t bits = mixed_bits(seed + (row * side + i) * golden_step);
      values[i] += scale * static_cast<float>(static_cast<std::int32_t>(bits >> 32));
      values[i + 1] += scale * static_cast<float>(static_cast<std::int32_t>(bits));
    }
  });
}

}  // namespace

Field refined(const Field& coarse, const PassRunner& runner) {
  Field fine{2 * coarse.side, {}};
  const auto half = static_cast<std::size_t>(coarse.side), side = 2 * half;
  fine.values.resize(side * side);
  run_pass(runner, side, [&](std::size_t row) {
    const auto at = [&](std::size_t r) { return coarse.values.data() + (r % half) * half; };
    const std::size_t below = row / 2;
    const float *const a = at(below + half - 1), *const b = at(below), *const c = at(below + 1);
    std::vector<float> line(half + 2);
    float* const middle = line.data() + 1;
    if (row % 2 == 0)
      for (std::size_t i = 0; i < half; ++i) middle[i] = 0.125f * (a[i] + c[i]) + 0.75f * b[i];
    else
      for (std::size_t i = 0; i < half; ++i) middle[i] = 0.5f * (b[i] + c[i]);
    line.front() = line[half];
    line.back() = line[1];
    float* const out = fine.values.data() + row * side;
    for (std::size_t i = 0; i < half; ++i) {
      out[2 * i] = 0.125f * (line[i] + line[i + 2]) + 0.75f * line[i + 1];
      out[2 * i + 1] = 0.5f * (line[i + 1] + line[i + 2]);
    }
  });
  return fine;
}

void standardise(Field& field) {
  const auto side = static_cast<std::size_t>(field.side);
  double sum = 0, squares = 0;
  for (std::size_t row = 0; row < side; ++row) {
    float line = 0, line_squares = 0;
    for (std::size_t i = row * side; i < (row + 1) * side; ++i) {
      line += field.values[i];
      line_squares += field.values[i] * field.values[i];
    }
    sum += static_cast<double>(line);
    squares += static_cast<double>(line_squares);
  }
  const double count = static_cast<double>(field.values.size()), mean = sum / count;
  const double rms = std::sqrt(std::max(squares / count - mean * mean, 0.0));
  const auto shift = static_cast<float>(mean), scale = static_cast<float>(rms > 0 ? 1 / rms : 1);
  for (float& value : field.values) value = (value - shift) * scale;
}

Field noise(const NoiseSpec& spec, int side, double size_m, std::uint64_t seed,
            const PassRunner& runner) {
  // A lattice of n corners carries wavelengths from two of its steps on.
  int corners = 2;
  while (corners < side && 2 * size_m / corners > spec.longest_m) corners *= 2;
  Field field{corners, std::vector<float>(static_cast<std::size_t>(corners) *
                                          static_cast<std::size_t>(corners))};
  double amplitude = 1;
  for (;; field = refined(field, runner), amplitude *= math::exp2(-spec.hurst)) {
    if (field.side == corners || 2 * size_m / field.side >= spec.shortest_m)
      add_white(field, amplitude, mixed_bits(seed + static_cast<std::uint64_t>(field.side)),
                runner);
    if (field.side >= side) break;
  }
  standardise(field);
  return field;
}

Field box_mean(const Field& field, int radius, const PassRunner& runner) {
  const auto side = static_cast<std::size_t>(field.side);
  const int mask = field.side - 1;
  Field rows{field.side, std::vector<float>(side * side)};
  Field out = rows;
  const float scale = 1 / static_cast<float>(2 * radius + 1);
  run_pass(runner, side, [&](std::size_t row) {
    const float* const from = field.values.data() + row * side;
    float* const to = rows.values.data() + row * side;
    float sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += from[i & mask];
    for (int i = 0; i < field.side; ++i) {
      to[i] = sum * scale;
      sum += from[(i + radius + 1) & mask] - from[(i - radius) & mask];
    }
  });
  constexpr std::size_t strip = 64;  // columns at a time
  run_pass(runner, (side + strip - 1) / strip, [&](std::size_t number) {
    const std::size_t first = number * strip, width = std::min(strip, side - first);
    std::array<float, strip> sums{};
    const auto line = [&](int y) {
      return rows.values.data() + static_cast<std::size_t>(y & mask) * side + first;
    };
    for (int y = -radius; y <= radius; ++y)
      for (std::size_t i = 0; i < width; ++i) sums[i] += line(y)[i];
    for (int y = 0; y < field.side; ++y) {
      float* const to = out.values.data() + static_cast<std::size_t>(y) * side + first;
      const float *const in = line(y + radius + 1), *const gone = line(y - radius);
      for (std::size_t i = 0; i < width; ++i) {
        to[i] = sums[i] * scale;
        sums[i] += in[i] - gone[i];
      }
    }
  });
  return out;
}

}  // namespace groundray::ground
