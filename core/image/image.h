#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"

namespace groundray {

/// Pixels of `channels` values each, row by row from the top. Integer coordinates are pixel
/// centres.
template <typename T>
class Image {
 public:
  Image() = default;

  /// Constructs an image of value-initialised pixels.
  /// @throws Error unless every dimension is positive.
  Image(int width, int height, int channels) : width_(width), height_(height), channels_(channels) {
    if (width <= 0 || height <= 0 || channels <= 0) {
      throw Error("image of {} x {} px with {} channels: every dimension must be positive", width,
                  height, channels);
    }
    values_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                   static_cast<std::size_t>(channels));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }

  /// Returns the `channels()` values of one pixel.
  std::span<T> at(int x, int y) {
    return {values_.data() + index(x, y), static_cast<std::size_t>(channels_)};
  }
  std::span<const T> at(int x, int y) const {
    return {values_.data() + index(x, y), static_cast<std::size_t>(channels_)};
  }

  /// Returns all values, pixel by pixel, row by row.
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }

 private:
  std::size_t index(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
            static_cast<std::size_t>(x)) *
           static_cast<std::size_t>(channels_);
  }

  int width_ = 0;
  int height_ = 0;
  int channels_ = 0;
  std::vector<T> values_;
};

using Image8 = Image<std::uint8_t>;    ///< pictures
using Image16 = Image<std::uint16_t>;  ///< values of 9 to 16 bits
using Image32 = Image<std::uint32_t>;  ///< labels and other identifiers
using ImageF = Image<float>;           ///< light and lengths

}  // namespace groundray
