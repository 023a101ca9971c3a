#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "core/geometry/footprint.h"
#include "core/image/image.h"
#include "core/image/luminance.h"

namespace groundray {

/// Encoding of the colours of an 8-bit image; its alpha is always linear.
/// @see IEC 61966-2-1 (sRGB).
enum class Encoding { Linear, Srgb };

/// Continuation beyond the image: repeats of it, or its edge texels.
enum class Wrap { Repeat, Clamp };

/// Continuation of a texture over the ground: repeats of the image, or pieces of it at random
/// offsets, blended, which show no period. See tiled_color.
enum class Tiling { Repeat, Stochastic };

/// Method of averaging over a footprint; see Texture::color.
enum class Filtering { Fast, Exact };

/// An image on a surface, with its mip levels. Immutable, so any number of threads may look up
/// values.
///
/// (u, v) runs from (0, 0), the lower left corner of the image's last row, to (1, 1), the upper
/// right corner of its first row, as in OBJ and core/model/model.h; in glTF v counts from the top
/// and is flipped when a model is read. Texels are squares: the centre of the one in column c and
/// row r of a W x H image is at u = (c + 1/2) / W, v = 1 - (r + 1/2) / H. Colours are linear. NaN
/// counts as 0.
///
/// 8-bit images are stored unchanged; their further levels take 16 bits per value, in linear light.
/// @see docs/reference/textures.md for errors and memory.
class Texture {
 public:
  /// @throws Error unless the image has 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB,
  ///         alpha).
  Texture(Image8 image, Encoding encoding, Wrap wrap);

  /// Constructs a texture of linear values.
  /// @throws Error as above, or if a value is not finite.
  Texture(ImageF image, Wrap wrap);

  /// Returns the columns and rows of a level: 0 is the image, each next level has half as many,
  /// rounded down.
  glm::ivec2 size(int level = 0) const noexcept;
  /// Returns the number of levels; the last is 1 x 1.
  int levels() const noexcept { return static_cast<int>(levels_.size()); }
  bool has_alpha() const noexcept { return channels_ == 2 || channels_ == 4; }
  /// Returns the bytes of all levels.
  std::size_t memory_bytes() const noexcept;

  /// Returns linear red, green, blue and alpha of a texel; `row` counts from the top. The texels of
  /// a level are means over equal areas of the level above, so that all levels have the same mean;
  /// for 8-bit images each level rounds once, by at most 2^-17.
  glm::vec4 texel(int level, int column, int row) const noexcept;

  /// Returns the mean of the image: linear red, green, blue and alpha.
  const glm::dvec4& mean() const noexcept { return mean_; }

  /// Returns the colour at a point, interpolated bilinearly between the centres of the nearest four
  /// texels.
  glm::vec3 color(glm::dvec2 uv) const noexcept;

  /// Returns the mean colour over a footprint centred at `uv`.
  ///
  /// Exact: the texels inside, weighted by their area inside; in double. Takes time in proportion
  /// to the texels along the boundary and inside, except for whole repeats of the image. A width
  /// below 1e-6 texels counts as 1e-6; a length above 1000 images is cut to that.
  ///
  /// Fast: up to 16 lookups, interpolated between texels and levels, along the longer axis. They
  /// match the footprint's centre and, if it is at least 1.73 texels wide and at most 16 times as
  /// long as wide, its second moments; otherwise the result is more blurred. See
  /// docs/reference/textures.md for its error.
  glm::vec3 color(glm::dvec2 uv, const Footprint& footprint, Filtering filtering) const noexcept;

  /// Returns alpha at a point, as color(uv) does; 1 for an image without alpha.
  float alpha(glm::dvec2 uv) const noexcept;

  /// Returns whether alpha(uv) is at least 1/2.
  bool is_opaque(glm::dvec2 uv) const noexcept { return alpha(uv) >= 0.5f; }

 private:
  struct Level {
    int width, height;
    std::size_t first;  // index of its first value in the mips
  };
  void build();
  template <typename T>
  void build_mips(std::vector<T>& mips);
  // Calls act with the texels of the level.
  template <typename Act>
  auto with_level(int level, const Act& act) const noexcept;
  glm::vec4 bilinear(int level, glm::dvec2 uv) const noexcept;
  glm::vec4 trilinear(double area, glm::dvec2 uv) const noexcept;
  glm::vec3 fast_color(glm::dvec2 uv, const Footprint& footprint) const noexcept;
  glm::dvec3 exact_color(glm::dvec2 uv, const Footprint& footprint) const noexcept;
  // Returns the sum of the image's texels in columns [first, last] of a row.
  glm::dvec4 row_sum(int row, int first, int last) const noexcept;

  int channels_ = 0;
  Wrap wrap_;
  const float* color_table_ = nullptr;  // linear value of each byte
  Image8 bytes_;                        // one of these two is empty
  ImageF floats_;
  std::vector<Level> levels_;
  std::vector<std::uint16_t> byte_mips_;  // 65535 is 1
  std::vector<float> float_mips_;
  std::vector<std::uint8_t> alpha_;  // of 8-bit images: compact, for the cut-out test of hits
  glm::dvec4 mean_{0};
};

/// Ratio of a textured surface's colour at a point to its mean. Textures provide only this ratio;
/// the mean is that of the material's spectrum.
struct Tint {
  glm::vec3 color{1};    ///< factor on each of linear red, green and blue
  float brightness = 1;  ///< factor on the luminance, used for all other wavelengths
  /// Returns the product of two tints.
  Tint operator*(const Tint& other) const noexcept {
    return {color * other.color, brightness * other.brightness};
  }
};

/// Returns the ratio of a texel to the mean of its image, both linear; 1 for a channel whose mean
/// is 0.
inline Tint tint_of(const glm::vec3& texel, const glm::vec3& mean) noexcept {
  const auto ratio = [](double value, double by) {
    return by > 0 ? static_cast<float>(value / by) : 1.0f;
  };
  return {{ratio(texel.r, mean.r), ratio(texel.g, mean.g), ratio(texel.b, mean.b)},
          ratio(luminance(texel), luminance(mean))};
}

/// Returns the weights of three textures that are projected along the x, y and z axes: not
/// negative, with sum 1, continuous in the normal. On surfaces within 23 degrees of an axis only
/// that axis has a weight, and one lookup suffices.
/// @param normal  unit.
glm::dvec3 triplanar_weights(const glm::dvec3& normal) noexcept;

/// Returns the colour of a texture that is projected onto a surface along all three axes, so that
/// it is not stretched on steep ground: (u, v) is (y, z), (x, z) and (x, y) of p_m / period_m.
/// @param p_m  position, metres, in the frame of the axes.
/// @param normal  unit.
/// @param patch  patch of the surface that the ray covers.
/// @param period_m  metres on the ground for each repeat of the texture; positive.
glm::vec3 triplanar_color(const Texture& texture, const glm::dvec3& p_m, const glm::dvec3& normal,
                          const SurfacePatch& patch, double period_m, Filtering filtering,
                          Tiling tiling = Tiling::Repeat) noexcept;

}  // namespace groundray
