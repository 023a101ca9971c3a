#pragma once

#include <filesystem>
#include <glm/mat4x4.hpp>
#include <string>
#include <variant>
#include <vector>

#include "core/image.h"

namespace groundray {

/// Some channels of an OpenEXR file: those of an image, of floats or of whole numbers.
struct ExrLayer {
  std::vector<std::string> names;  ///< one for each channel: "R", "G", "B", "Z", "normal.x", ...
  std::variant<const ImageF*, const Image32*> image;  ///< not null
};

/// What an OpenEXR file says of itself besides. Names that OpenEXR knows have types of their own:
/// "owner" is text, "expTime" (s) and "whiteLuminance" (cd/m^2) are numbers, "worldToCamera" is a
/// matrix.
struct ExrAttribute {
  std::string name;
  std::variant<std::string, float, glm::mat4> value;  ///< matrices are for columns, as GLM's
};

/// Writes an OpenEXR file of one part and ZIP compression: float32 and uint32 channels, every bit
/// kept. Equal images give equal bytes, whatever the number of OpenEXR's threads.
/// @throws Error as write_whole, or listing all that is wrong: no layer, images of different sizes,
///         names that are not one for each channel, not unique, empty or longer than 255 bytes, or
///         attributes that OpenEXR writes itself.
/// @see OpenEXR, File Layout and Standard Attributes.
void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const std::vector<ExrAttribute>& attributes = {});

}  // namespace groundray
