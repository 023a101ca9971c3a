#pragma once

#include <filesystem>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/image/image.h"

namespace groundray {

/// Some channels of an OpenEXR file: those of an image of floats or of integers.
struct ExrLayer {
  std::vector<std::string> names;  ///< one for each channel: "R", "G", "B", "Z", "normal.x", ...
  std::variant<const ImageF*, const Image32*> image;  ///< not null
};

/// An attribute in the header of an OpenEXR file. OpenEXR's standard attributes have fixed types:
/// "owner" is text, "expTime" (s) and "whiteLuminance" (cd/m^2) are numbers, "worldToCamera" is a
/// matrix.
struct ExrAttribute {
  std::string name;
  std::variant<std::string, float, glm::mat4> value;  ///< matrices for column vectors, as GLM's
};

/// Writes an OpenEXR file of one part with ZIP compression and float32 and uint32 channels,
/// lossless. Equal images give equal bytes, whatever the number of OpenEXR's threads.
/// @throws Error as write_whole, or listing all faults: no layer, an empty image, images of
///         different sizes, names that are not one for each channel, not unique, empty or longer
///         than 255 bytes, or attributes that already exist, such as those that OpenEXR writes
///         itself.
/// @see OpenEXR, File Layout and Standard Attributes.
void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const std::vector<ExrAttribute>& attributes = {});

/// A channel of an OpenEXR file: one value per pixel.
struct ExrChannel {
  std::string name;  ///< "R", "Z", "N.X"; in parts after the first with the part's name: "PART.R"
  std::variant<ImageF, Image32> image;
};

/// Content of an OpenEXR file.
struct ExrFile {
  int width = 0, height = 0;         ///< of the stored pixels: OpenEXR's data window, px
  glm::ivec2 corner_px{0};           ///< first stored pixel, relative to the display window
  glm::ivec2 display_size_px{0};     ///< size of the picture as displayed: OpenEXR's display window
  std::vector<ExrChannel> channels;  ///< part by part, sorted by name
  /// Attributes of the first part. Text is unchanged. Numbers have the fewest digits that restore
  /// them; those of vectors and matrices (as stored) are separated by blanks. Other types are
  /// omitted.
  std::map<std::string, std::string> attributes;

  /// Returns the channel of this name, or nullptr.
  const ExrChannel* find(std::string_view name) const;
};

/// Reads all channels of an OpenEXR file of scan lines or tiles (the finest level), of one part or
/// several. Half and float become float, integers stay integers; every bit is kept.
/// @throws Error if the file is missing, not an OpenEXR picture, truncated or damaged, has more
///         than most_image_pixels or more than four times as many values, subsampled channels, deep
///         pixels, or parts of different sizes or with two channels of the same name.
/// @see OpenEXR, File Layout.
ExrFile read_exr(const std::filesystem::path& path);

/// Decodes a file in memory as read_exr does; `name` identifies it in messages.
ExrFile parse_exr(std::string_view bytes, const std::string& name);

}  // namespace groundray
