#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "core/footprint.h"
#include "core/image.h"

namespace groundray {

/// How the colours of an 8-bit image stand for light; its alpha is always linear.
/// @see IEC 61966-2-1 (sRGB).
enum class Encoding { Linear, Srgb };

/// What lies beyond the image: itself again, or its border.
enum class Wrap { Repeat, Clamp };

/// How a footprint is averaged; see Texture::color.
enum class Filtering { Fast, Exact };

/// An image laid on a surface, with smaller and smaller versions of itself. Immutable, so any
/// number of threads may look things up.
///
/// (u, v) runs from (0, 0), the lower left corner of the image's last row, to (1, 1), the upper
/// right corner of its first row, as in OBJ and core/model.h; glTF counts v from the top and is
/// turned over when it is read. Texels are squares: the centre of the one in column c and row r of
/// a W x H image is at u = (c + 1/2) / W, v = 1 - (r + 1/2) / H. Colours are linear. NaN counts as
/// 0.
///
/// 8-bit images stay as they are; their smaller versions take 16 bits a value, in linear light: for
/// RGBA of 16384 x 16384, 1 GiB and 0.67 GiB, and 0.25 GiB for a copy of alpha.
class Texture {
 public:
  /// @throws Error unless the image has 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB,
  ///         alpha).
  Texture(Image8 image, Encoding encoding, Wrap wrap);

  /// Of linear values. @throws Error as above, or if one is not finite.
  Texture(ImageF image, Wrap wrap);

  /// Columns and rows of a level: 0 is the image, each next one has half as many, rounded down.
  glm::ivec2 size(int level = 0) const noexcept;
  /// Down to 1 x 1.
  int levels() const noexcept { return static_cast<int>(levels_.size()); }
  bool has_alpha() const noexcept { return channels_ == 2 || channels_ == 4; }
  /// Of all levels.
  std::size_t memory_bytes() const noexcept;

  /// Returns linear red, green, blue and alpha of a texel; `row` counts from the top. A level's
  /// texels are means of areas of the level above that share it out evenly, so that all levels have
  /// the same mean; of 8-bit images each level rounds once, by at most 2^-17.
  glm::vec4 texel(int level, int column, int row) const noexcept;

  /// The mean of the image: linear red, green, blue and alpha.
  const glm::dvec4& mean() const noexcept { return mean_; }

  /// Returns the colour at a point: linear between the centres of the nearest four texels.
  glm::vec3 color(glm::dvec2 uv) const noexcept;

  /// Returns the mean colour of a footprint centred at `uv`.
  ///
  /// Exact: the texels inside, by the area of each that is inside; in double. Takes time in
  /// proportion to the texels along the rim and inside, but for whole repeats of the image. What is
  /// thinner than 1e-6 texels counts as that; what is longer than 1000 images is cut to that.
  ///
  /// Fast: up to 16 lookups, linear between texels and levels, along the longer axis, with the
  /// footprint's centre and, if it is at least 1.73 texels wide and at most 16 times as long as
  /// wide, its second moments; more blurred otherwise. See docs/textures.md for its error.
  glm::vec3 color(glm::dvec2 uv, const Footprint& footprint, Filtering filtering) const noexcept;

  /// Returns alpha at a point, as color(uv) does; 1 for an image without.
  float alpha(glm::dvec2 uv) const noexcept;

  /// Whether alpha(uv) is at least 1/2.
  bool is_opaque(glm::dvec2 uv) const noexcept { return alpha(uv) >= 0.5f; }

 private:
  struct Level {
    int width, height;
    std::size_t first;  // value among the mips
  };
  void build();
  template <typename T>
  void build_mips(std::vector<T>& mips);
  // Calls act(texels of the level).
  template <typename Act>
  auto with_level(int level, const Act& act) const noexcept;
  glm::vec4 bilinear(int level, glm::dvec2 uv) const noexcept;
  glm::vec4 trilinear(double area, glm::dvec2 uv) const noexcept;
  glm::vec3 fast_color(glm::dvec2 uv, const Footprint& footprint) const noexcept;
  glm::dvec3 exact_color(glm::dvec2 uv, const Footprint& footprint) const noexcept;
  // The sum of image texels in columns [first, last] of a row.
  glm::dvec4 row_sum(int row, int first, int last) const noexcept;

  int channels_ = 0;
  Wrap wrap_;
  const float* color_table_ = nullptr;  // linear value of each byte
  Image8 bytes_;                        // one of these two is empty
  ImageF floats_;
  std::vector<Level> levels_;
  std::vector<std::uint16_t> byte_mips_;  // 65535 is 1
  std::vector<float> float_mips_;
  std::vector<std::uint8_t> alpha_;  // of 8-bit images: near each other for the filter of hits
  glm::dvec4 mean_{0};
};

}  // namespace groundray
