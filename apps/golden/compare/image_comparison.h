#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/compare/image_file.h"
#include "apps/golden/compare/light_match.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// How two images are read and held against each other.
struct ImageOptions {
  ImageReading reference, other;
  Significance significance;
};

/// Holds an image against a reference, layer by layer as their kinds are: errors of depths, angles
/// between normals, bias and noise of light (with standard errors: tests), end points of flow,
/// labels that are equal. Says so if the other image seems to be shifted, mirrored, of another
/// unit, or to mean something else. Only the tests of light are held against limits; a layer of
/// which no pixel is in both fails.
/// @throws Error as read_image_file; if the sizes differ or there is no layer that both have.
Section compare_images(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const ImageOptions& options = {});

/// As above, of images in memory. @param title  of the section.
Section compare_images(const ImageFile& reference, const ImageFile& other,
                       const Significance& significance, const std::string& title);

}  // namespace groundray::golden
