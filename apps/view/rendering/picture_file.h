#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace groundray {

/// Picture in displayable form.
struct PictureFile {
  Image8 picture;                  ///< 1 to 4 channels
  std::vector<std::string> notes;  ///< messages on what part of the file is shown, and in what way
};

/// Reads a picture. PNG and JPEG are unchanged; linear light (OpenEXR, Radiance) is exposed
/// automatically; an OpenEXR file without colours is shown by one channel in viridis; a TIFF by its
/// first three bands.
/// @throws Error as the readers of these, or if there is no channel to show.
PictureFile read_picture(const std::filesystem::path& path);

}  // namespace groundray
