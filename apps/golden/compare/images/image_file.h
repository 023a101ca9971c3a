#pragma once

#include <cmath>
#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
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
  glm::ivec2 first_px{0};  ///< column and row in the file of the first pixel
};

/// Groups channels into layers by their names, ignoring case. Knows groundray's names and those of
/// other programs: "Z", "depth", "ViewLayer.Depth.Z"; "N.X", "Normal.X"; "dd.T", a distance. A
/// channel with an unknown name, or of an incomplete group, becomes a layer of its own, of kind
/// Number (Label if its name ends in "seen").
/// @param channels  equal in size.
std::vector<ImageLayer> layers_of(std::vector<NamedChannel> channels);

/// Meaning of a PNG's values, which the file does not state.
enum class PngMeaning {
  Picture,          ///< display colours
  KittiDepth,       ///< 16 bits: Z in steps of 1/256 m, 0 where unknown
  MillimetreDepth,  ///< 16 bits: Z in steps of 1 mm, 0 where unknown
  KittiFlow,        ///< 3 x 16 bits: 64 u + 2^15, 64 v + 2^15, and 0 where unknown
  Label             ///< class numbers; in a colour image, each colour is one number
};

/// Values of a PNG or JPEG as stored, with 8 or 16 bits.
struct PngNumbers {
  Image<double> values;
  bool is_deep = false;
};

/// Decodes a PNG or JPEG. @throws Error as parse_image8; `name` identifies the file in messages.
PngNumbers png_numbers(std::string_view bytes, const std::string& name);

/// Options for reading an image.
struct ImageReading {
  PngMeaning png = PngMeaning::Picture;
  double depth_unit_m = 1;  ///< unit of the layers Z and Distance; ignored for PNG
  /// Maps the file's channel names to those of groundray's files: {"nn.X", "N.X"}.
  std::map<std::string, std::string> names;
};

/// Image with all its layers.
struct ImageFile {
  glm::ivec2 size_px{0};
  std::vector<ImageLayer> layers;

  /// Returns the layer with this name, or nullptr.
  const ImageLayer* find(std::string_view name) const;
};

/// Reads an image, whose format is recognised by its first bytes: OpenEXR (NaN outside a cropped
/// data window), Radiance, PNG, JPEG, Middlebury's .flo, or .pfm (a single channel is Z).
/// @throws Error if the file cannot be read, has another format, or lacks a channel that `reading`
///         names.
ImageFile read_image_file(const std::filesystem::path& path, const ImageReading& reading = {});

}  // namespace groundray::golden
