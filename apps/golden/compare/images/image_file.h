#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <string>
#include <vector>

#include "apps/golden/compare/images/image_layer.h"

namespace groundray::golden {

/// Meaning of a PNG's values, which the file does not state.
enum class PngMeaning {
  Picture,          ///< display colours
  KittiDepth,       ///< 16 bits: Z in steps of 1/256 m, 0 where unknown
  MillimetreDepth,  ///< 16 bits: Z in steps of 1 mm, 0 where unknown
  KittiFlow,        ///< 3 x 16 bits: 64 u + 2^15, 64 v + 2^15, and 0 where unknown
  Label             ///< class numbers; in a colour image, each colour is one number
};

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
