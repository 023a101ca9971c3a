#pragma once

#include <filesystem>
#include <glm/mat4x4.hpp>
#include <string>
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

}  // namespace groundray
