#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <string>
#include <vector>

#include "apps/golden/compare/image_layer.h"

namespace groundray::golden {

/// What the numbers of a PNG are, which it does not say.
enum class PngMeaning {
  Picture,          ///< colours as shown
  KittiDepth,       ///< 16 bits: Z in steps of 1/256 m, 0 where unknown
  MillimetreDepth,  ///< 16 bits: Z in steps of 1 mm, 0 where unknown
  KittiFlow,        ///< 3 x 16 bits: 64 u + 2^15, 64 v + 2^15, and whether it is known
  Label             ///< numbers of classes; of a coloured image, its colours as one number
};

/// How an image is to be read.
struct ImageReading {
  PngMeaning png = PngMeaning::Picture;
  double depth_unit_m = 1;  ///< of the layers Z and Distance, but for PNG
  /// What channels are, in the names of groundray's files: {"nn.X", "N.X"}.
  std::map<std::string, std::string> names;
};

/// An image with all that is known of each pixel.
struct ImageFile {
  glm::ivec2 size_px{0};
  std::vector<ImageLayer> layers;

  /// Returns the layer of this name, or nullptr.
  const ImageLayer* find(std::string_view name) const;
};

/// Reads an image by its bytes and, else, the end of its name: OpenEXR (of a cropped one the rest
/// is NaN), Radiance, PNG and JPEG, Middlebury's .flo, and .pfm (of one channel: Z).
/// @throws Error if it cannot be read, is of another kind, or `reading` names a channel that it
///         does not have.
ImageFile read_image_file(const std::filesystem::path& path, const ImageReading& reading = {});

}  // namespace groundray::golden
