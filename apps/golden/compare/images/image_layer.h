#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace groundray::golden {

/// Kind of a layer's values; selects the comparison.
enum class LayerKind {
  Depth,   ///< m; no value where not finite, 0, or 1e9 or more in magnitude
  Normal,  ///< directions
  Colour,  ///< light
  Flow,    ///< px
  Label,   ///< unordered whole numbers
  Number
};

/// Returns true if a depth is valid: finite, not 0, and less than 1e9 in magnitude.
inline bool is_depth(double depth_m) { return std::abs(depth_m) < 1e9 && depth_m != 0; }

/// Returns the length of the vector formed by a pixel's channels.
inline double length_of(std::span<const double> pixel) {
  double squares = 0;
  for (const double value : pixel) squares += value * value;
  return std::sqrt(squares);
}

struct NamedChannel {
  std::string name;
  Image<double> values;  ///< one channel
};

/// Channels of an image that form one quantity.
struct ImageLayer {
  std::string name;  ///< as in groundray's files: "Z", "Distance", "N", "RGB", "FlowForward"
  LayerKind kind = LayerKind::Number;
  std::vector<std::string> channels;  ///< names in the file
  Image<double> values;
};

/// Groups channels into layers by their names, ignoring case. Knows groundray's names and those of
/// other programs: "Z", "depth", "ViewLayer.Depth.Z"; "N.X", "Normal.X"; "dd.T", a distance. A
/// channel with an unknown name, or of an incomplete group, becomes a layer of its own, of kind
/// Number (Label if its name ends in "seen").
/// @param channels  equal in size.
std::vector<ImageLayer> layers_of(std::vector<NamedChannel> channels);

}  // namespace groundray::golden
