#include "terrain/relief/periodic_image.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace groundray {
namespace {

// Pixels of a line that contribute to a sample, and their weights; the first pixel follows the
// last.
struct Taps {
  int first = 0;
  std::vector<double> weights;
};

std::vector<Taps> taps_of(int pixels, int samples, int copies) {
  const double per_sample = static_cast<double>(pixels) * copies / samples;
  const double reach = std::max(1.0, per_sample);
  std::vector<Taps> all(static_cast<std::size_t>(samples));
  for (int sample = 0; sample < samples; ++sample) {
    Taps& taps = all[static_cast<std::size_t>(sample)];
    const double at = std::fmod(sample * per_sample, pixels);
    const int first = static_cast<int>(std::floor(at - reach)) + 1;
    double sum = 0;
    for (int pixel = first; pixel < at + reach; ++pixel) {
      taps.weights.push_back(1 - std::abs(pixel - at) / reach);
      sum += taps.weights.back();
    }
    for (double& weight : taps.weights) weight /= sum;
    taps.first = (first % pixels + pixels) % pixels;
  }
  return all;
}

double blend(const Taps& taps, int pixels, const auto& value_at) {
  double sum = 0;
  int pixel = taps.first;
  for (const double weight : taps.weights) {
    sum += weight * value_at(pixel);
    if (++pixel == pixels) pixel = 0;
  }
  return sum;
}

}  // namespace

std::vector<double> sample_periodic(const ImageF& image, glm::ivec2 size, glm::ivec2 copies,
                                    const PassRunner& runner) {
  const auto across = taps_of(image.width(), size.x, copies.x);
  const auto down = taps_of(image.height(), size.y, copies.y);
  const auto columns = static_cast<std::size_t>(size.x);
  std::vector<double> narrowed(columns * static_cast<std::size_t>(image.height()));
  run_pass(runner, static_cast<std::size_t>(image.height()), [&](std::size_t y) {
    for (std::size_t x = 0; x < columns; ++x) {
      narrowed[y * columns + x] = blend(across[x], image.width(), [&](int pixel) -> double {
        return image.at(pixel, static_cast<int>(y))[0];
      });
    }
  });
  std::vector<double> out(columns * static_cast<std::size_t>(size.y));
  run_pass(runner, static_cast<std::size_t>(size.y), [&](std::size_t y) {
    for (std::size_t x = 0; x < columns; ++x) {
      out[y * columns + x] = blend(down[y], image.height(), [&](int pixel) {
        return narrowed[static_cast<std::size_t>(pixel) * columns + x];
      });
    }
  });
  return out;
}

}  // namespace groundray
