#pragma once

#include <algorithm>
#include <cstddef>

namespace groundray {

/// How much is drawn while a view moves: at first what llvmpipe draws some twenty times a second on
/// two cores, then more or less as pictures turn out to take.
class MovingDetail {
 public:
  std::size_t points() const noexcept { return scaled(60'000); }
  std::size_t triangles() const noexcept { return scaled(50'000); }

  /// A picture was drawn while moving.
  void drawn(double seconds) noexcept {
    sum_s_ += seconds;
    ++pictures_;
  }
  /// A move begins: what the pictures of the last one took counts from here on. The first of them,
  /// for which data had to be made, are in it; so a move of few pictures says nothing.
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
