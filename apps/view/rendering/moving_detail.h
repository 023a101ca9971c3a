#pragma once

#include <algorithm>
#include <cstddef>

namespace groundray {

/// Level of detail while a view moves: initially what llvmpipe draws about 20 times per second on
/// two cores, then adapted to the measured frame times.
class MovingDetail {
 public:
  std::size_t points() const noexcept { return scaled(60'000); }
  std::size_t triangles() const noexcept { return scaled(50'000); }

  /// Records the time to draw one frame of the current move.
  void drawn(double seconds) noexcept {
    sum_s_ += seconds;
    ++pictures_;
  }
  /// Begins a move: adapts the detail to the mean frame time of the previous one. Its first frames
  /// include the creation of reduced data, so moves of fewer than 10 frames are ignored.
  void begin() noexcept {
    constexpr double wanted_s = 1.0 / 20;
    if (pictures_ >= 10) {
      const double mean_s = sum_s_ / pictures_;
      if (mean_s < wanted_s / 2) scale_ = std::min(scale_ * 2, 64.0);
      if (mean_s > wanted_s * 1.5) scale_ = std::max(scale_ / 2, 0.25);
    }
    sum_s_ = 0;
    pictures_ = 0;
  }

 private:
  std::size_t scaled(double number) const noexcept {
    return static_cast<std::size_t>(number * scale_);
  }

  double scale_ = 1, sum_s_ = 0;
  int pictures_ = 0;
};

}  // namespace groundray
