#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"

namespace groundray {

/// A picture as it can be shown.
struct PictureFile {
  Image8 picture;                  ///< 1 to 4 channels
  std::vector<std::string> notes;  ///< what of the file is shown, and how
};

/// Reads a picture: PNG and JPEG as they are; light (OpenEXR, Radiance) exposed by itself; of an
/// OpenEXR file without colours its first channel, by viridis; of a TIFF its first three bands.
/// @throws Error as the readers of these, or if there is no channel to show.
PictureFile read_picture(const std::filesystem::path& path);

}  // namespace groundray
