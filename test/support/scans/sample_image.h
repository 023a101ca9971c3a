#pragma once

#include <gtest/gtest.h>

#include <glm/vec2.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/images/image_file.h"
#include "apps/golden/report.h"

namespace groundray::testing {

/// A layer whose values are `value(x, y, component)`.
template <typename Value>
golden::ImageLayer layer(const std::string& name, golden::LayerKind kind, glm::ivec2 size_px,
                         int channels, const Value& value) {
  golden::ImageLayer layer{name, kind,
                           std::vector<std::string>(static_cast<std::size_t>(channels), name),
                           Image<double>(size_px.x, size_px.y, channels)};
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) {
      for (int k = 0; k < channels; ++k)
        layer.values.at(x, y)[static_cast<std::size_t>(k)] = value(x, y, k);
    }
  }
  return layer;
}

inline golden::ImageFile image(std::vector<golden::ImageLayer> layers) {
  const Image<double>& first = layers.front().values;
  return {{first.width(), first.height()}, std::move(layers)};
}

/// Returns a figure by its name; fails the test if there is none.
inline double figure(const golden::Section& section, const std::string& name) {
  for (const golden::Measure& measure : section.measures) {
    if (measure.name == name) return measure.value;
  }
  std::string names;
  for (const golden::Measure& measure : section.measures) names += measure.name + "\n";
  ADD_FAILURE() << "there is no measure '" << name << "'; there are\n" << names;
  return 0;
}

}  // namespace groundray::testing
