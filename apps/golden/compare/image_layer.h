#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"

namespace groundray::golden {

/// What a layer's values are, and so how they are compared.
enum class LayerKind {
  Depth,   ///< m; not finite, 0, or beyond 1e9: nothing there
  Normal,  ///< directions
  Colour,  ///< light
  Flow,    ///< px
  Label,   ///< whole numbers without an order
  Number
};

/// Whether a depth is one: neither 0 nor one of the large numbers that stand for nothing.
inline bool is_depth(double depth_m) { return std::abs(depth_m) < 1e9 && depth_m != 0; }

/// Returns the length of the vector that a pixel's channels make up.
inline double length_of(std::span<const double> pixel) {
  double squares = 0;
  for (const double value : pixel) squares += value * value;
  return std::sqrt(squares);
}

struct NamedChannel {
  std::string name;
  Image<double> values;  ///< of one channel
};

/// Channels of an image that belong together.
struct ImageLayer {
  std::string name;  ///< as files of groundray have it: "Z", "Distance", "N", "RGB", "FlowForward"
  LayerKind kind = LayerKind::Number;
  std::vector<std::string> channels;  ///< as the file names them
  Image<double> values;
};

/// Puts together the channels that belong to each other, by their names: groundray's own and those
/// of others, whatever their case: "Z", "depth", "ViewLayer.Depth.Z"; "N.X", "Normal.X"; "dd.T" is
/// a distance. What has no name of this sort, or lacks a companion, is a number by its own name.
/// @param channels  of equal sizes.
std::vector<ImageLayer> layers_of(std::vector<NamedChannel> channels);

}  // namespace groundray::golden
