#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/image.h"

namespace groundray {

/// A channel of an OpenEXR file: one value a pixel.
struct ExrChannel {
  std::string name;  ///< "R", "Z", "N.X"; of any part but the first "PART.R", unless it says so
  std::variant<ImageF, Image32> image;
};

/// What an OpenEXR file holds.
struct ExrFile {
  int width = 0, height = 0;         ///< of the pixels that there are: OpenEXR's data window, px
  glm::ivec2 corner_px{0};           ///< where the first of them lies in the picture as displayed
  glm::ivec2 display_size_px{0};     ///< of the picture as displayed: OpenEXR's display window
  std::vector<ExrChannel> channels;  ///< part by part, sorted by name
  /// What it says of itself besides, of the first part: text as it is, numbers in the fewest digits
  /// that give the same ones, those of vectors and matrices (as stored) with blanks between. Other
  /// types are left out.
  std::map<std::string, std::string> attributes;

  /// Returns the channel of this name, or nullptr.
  const ExrChannel* find(std::string_view name) const;
};

/// Reads all channels of an OpenEXR file, of scan lines or tiles (the finest level) and of one part
/// or several: half and float as float, whole numbers as they are, every bit kept.
/// @throws Error if the file is missing, no such picture, cut short or damaged, has more than
///         most_image_pixels or more than four times as many values, channels that are not for each
///         pixel, deep pixels, or parts of different sizes or with two channels of the same name.
/// @see OpenEXR, File Layout.
ExrFile read_exr(const std::filesystem::path& path);

/// As read_exr, of a file already in memory; `name` stands for it in messages.
ExrFile parse_exr(std::string_view bytes, const std::string& name);

}  // namespace groundray
