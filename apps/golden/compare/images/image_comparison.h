#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <string>

#include "apps/golden/compare/images/image_file.h"
#include "apps/golden/report.h"
#include "core/image/image.h"

namespace groundray::golden {

/// Significance of the differences between two estimates of light.
struct Significance {
  double level = 0.01;      ///< probability that any test of a kind fails for equal light
  double beyond_share = 0;  ///< fraction of single values that may fail nevertheless
};

/// Rectangle of pixels.
struct PixelBox {
  glm::ivec2 first_px{0};  ///< column and row of its first pixel
  glm::ivec2 size_px{0};   ///< width and height
};

/// Reading options of both images, significance of the tests of light, and the compared pixels, by
/// default all.
struct ImageOptions {
  ImageReading reference, other;
  Significance significance;
  std::optional<PixelBox> pixels{};
};

/// Returns the pixels of an image within a rectangle.
/// @throws Error if the rectangle is empty or reaches beyond the image.
ImageFile cropped(const ImageFile& image, const PixelBox& box);

/// Compares an image with a reference, layer by layer according to their kinds: errors of depth,
/// angles between normals, bias and noise of light (with tests if there are standard errors),
/// end-point errors of flow, equality of labels. Warns if the other image seems to be shifted or
/// mirrored, or if its values seem to have another unit or meaning. Only the tests of light have
/// limits; a layer without a pixel that has a value in both images fails, unless neither image has
/// any.
/// @throws Error as read_image_file and cropped, if the sizes differ, or if the images have no
/// layer
///         in common.
Section compare_images(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const ImageOptions& options = {});

/// As above, for images in memory.
/// @param title  title of the section.
Section compare_images(const ImageFile& reference, const ImageFile& other,
                       const Significance& significance, const std::string& title);

/// Shift or reflection that brings an image much nearer to the reference.
struct Misalignment {
  std::string what;       ///< "moved by (0.5, 0) px", "mirrored left to right"
  double difference = 0;  ///< mean of |a - b| / (|a| + |b|) over sampled pixels after the change
  double as_it_is = 0;    ///< same without the change
};

/// Compares `other` with the reference after shifts of up to one pixel in steps of half a pixel
/// (bilinear), reflections and a rotation by 180 degrees. Returns the best of these if it at least
/// halves the difference; interpolation reduces pure noise by at most a fifth. Returns nothing if
/// the images differ by less than 1e-4.
/// @param reference, other  equal in size and number of channels.
std::optional<Misalignment> misalignment(const Image<double>& reference,
                                         const Image<double>& other);

/// Reports the differences between a layer and a reference of the same name, size and channels,
/// according to its kind, and adds pictures. Suspected misreadings are stated in the text. If no
/// pixel has a value in both, there are no errors: the section states so and, unless neither layer
/// has any value, fails.
void compare_layers(const ImageLayer& reference, const ImageLayer& other, Section& into);

/// Returns the mean structural similarity (SSIM) of two single-channel images; 1 if they are equal.
/// Averages over all windows of 11 x 11 pixels, with Gaussian weights of sigma 1.5 px, that lie
/// inside the images and have only finite values; NaN if there are none.
/// @param range  difference between the values of white and black.
/// @see Wang et al., Image quality assessment: from error visibility to structural similarity, IEEE
///      TIP 13 (2004): k1 = 0.01, k2 = 0.03.
double structural_similarity(const Image<double>& a, const Image<double>& b, double range);

/// Tests whether two path-traced images estimate the same light, from their layers RGB, StdError
/// and Samples: each value, by Student's t with Welch's degrees of freedom; the mean of each block
/// of 8 x 8 pixels; and the mean of each channel. All tests of a kind together have the
/// significance `level` (Šidák's correction). Tests of single values are insensitive to a small
/// error of the whole image. An image without standard errors counts as exact; if neither has any,
/// nothing is tested.
/// Values that are not finite, or whose standard errors are not, cannot be tested. They fail if
/// only the other's cannot be tested, or if no value can be tested and the images are not equal.
/// Values with a standard error of zero must be equal up to rounding.
/// @param reference, other  equal in size, both with RGB.
/// @see Welch, The generalization of Student's problem, Biometrika 34 (1947); Šidák, Rectangular
///      confidence regions for the means of multivariate normal distributions (1967).
void match_light(const ImageFile& reference, const ImageFile& other,
                 const Significance& significance, Section& into);

}  // namespace groundray::golden
