#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/compare/images/image_file.h"
#include "apps/golden/compare/images/light_match.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Reading options of both images, and significance of the tests of light.
struct ImageOptions {
  ImageReading reference, other;
  Significance significance;
};

/// Compares an image with a reference, layer by layer according to their kinds: errors of depth,
/// angles between normals, bias and noise of light (with tests if there are standard errors),
/// end-point errors of flow, equality of labels. Warns if the other image seems to be shifted or
/// mirrored, or if its values seem to have another unit or meaning. Only the tests of light have
/// limits; a layer without a pixel that has a value in both images fails, unless neither image has
/// any.
/// @throws Error as read_image_file, if the sizes differ, or if the images have no layer in common.
Section compare_images(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const ImageOptions& options = {});

/// As above, for images in memory.
/// @param title  title of the section.
Section compare_images(const ImageFile& reference, const ImageFile& other,
                       const Significance& significance, const std::string& title);

}  // namespace groundray::golden
