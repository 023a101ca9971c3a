#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace groundray {

/// One echo in the samples of a waveform's segment: a maximum, and the minima beside it. Positions
/// are in bins from the segment's begin; between samples the logarithm of the power is a cubic, or
/// at the top a parabola, which is exact for a Gaussian.
class EchoTrace {
 public:
  /// A maximum between two minima; `end` is the begin of the next.
  struct Lobe {
    std::size_t begin = 0, peak = 0, end = 0;
  };
  /// Where the power passes a level, and how steeply: W per bin, not negative; 0 if it never does.
  struct Crossing {
    double bin = 0, slope_w = 0;
  };

  /// What is above a level about the peak; at the minima beside it, where it does not pass it.
  struct Extent {
    double begin_bin = 0, end_bin = 0;
    bool rises = false, falls = false;
  };

  /// Maxima with a dip between them that is shallower than this part of the lower are one.
  static constexpr double ripple = 1e-3;

  /// @param ceiling_w  power above it is clipped.
  EchoTrace(std::span<const float> power_w, double ceiling_w, const Lobe& lobe);

  const Lobe& lobe() const { return lobe_; }
  bool clipped() const { return clipped_; }
  double peak_w() const { return peak_w_; }      ///< between samples, clipped
  double peak_bin() const { return peak_bin_; }  ///< of a clipped one, the middle of its plateau
  double curvature_w() const { return curvature_w_; }  ///< there, W per bin^2; 0 if it is clipped
  /// Where the power first rises to a level: the begin, if it is there already.
  Crossing first_rise(double level_w) const;
  /// Where it last rises to a level before the peak: the begin, if it is not below before.
  Crossing last_rise(double level_w) const;
  /// Where the parabola at the peak rises to a level: how steep an echo is whose neighbour hides
  /// its rise.
  Crossing rise_before_peak(double level_w) const { return beside_peak(level_w, -1); }
  /// Where it first falls to a level after the peak: the end, if it never does.
  Crossing fall(double level_w) const;
  /// Ends of what is above a level about the peak, for widths: the logarithm of the power between
  /// samples is taken as curved as at the peak.
  Extent above(double level_w) const;
  /// Full width at half of the peak, bins: twice one side, where the echo's neighbour hides the
  /// other, and the echo's extent, where both are hidden.
  double width_bins() const;
  double sum_w() const { return sum_w_; }  ///< of the clipped power over its bins
  /// Centroid of the clipped power; the peak, if there is power in the segment's last bin alone.
  double mean_bin() const;
  /// Mean of value(power) over the bins of an extent, weighed by (bin - centre)^2.
  template <typename Value>
  double mean(const Extent& extent, double centre_bin, const Value& value) const;

 private:
  Crossing crossing(std::size_t i, double level_w) const;
  Crossing rise_after(std::size_t i, double level_w) const;
  double edge(std::size_t below, std::size_t above, double level_w) const;
  Crossing beside_peak(double level_w, double side) const;
  void find_top();
  void find_plateau();
  void add_up();

  std::span<const float> power_w_;
  double ceiling_w_;
  Lobe lobe_;
  bool clipped_;
  double peak_w_ = 0, peak_bin_ = 0, curvature_w_ = 0, sum_w_ = 0;
};

/// Calls `act(lobe)` for every maximum of clipped power, in order. Neighbours with a minimum of
/// `joining_w` or more between them are one; its peak is the higher, or the first.
template <typename Act>
void for_each_lobe(std::span<const float> power_w, double ceiling_w, double joining_w,
                   const Act& act) {
  constexpr float keep = 1 - static_cast<float>(EchoTrace::ripple);
  const float top_w = static_cast<float>(ceiling_w);
  EchoTrace::Lobe lobe;
  std::size_t valley = 0;
  float highest_w = 0, lowest_w = 0;
  bool falling = false;
  for (std::size_t i = 0; i < power_w.size(); ++i) {
    const float now_w = std::min(power_w[i], top_w);
    if (!falling) {
      if (now_w > highest_w) {
        highest_w = now_w;
        lobe.peak = i;
      } else if (now_w < keep * highest_w) {
        falling = true;
        lowest_w = now_w;
        valley = i;
      }
    } else if (now_w <= lowest_w) {
      lowest_w = now_w;
      valley = i;
    } else if (lowest_w < keep * now_w) {
      falling = false;
      if (lowest_w < joining_w) {
        lobe.end = valley;
        act(lobe);
        lobe = {valley, i, 0};
        highest_w = now_w;
      } else if (now_w > highest_w) {
        highest_w = now_w;
        lobe.peak = i;
      }
    }
  }
  lobe.end = power_w.size() - 1;
  if (highest_w > 0) act(lobe);
}

template <typename Value>
double EchoTrace::mean(const Extent& extent, double centre_bin, const Value& value) const {
  double weights = 0, sum = 0;
  const auto end = static_cast<std::size_t>(extent.end_bin);
  for (auto i = static_cast<std::size_t>(extent.begin_bin) + 1; i <= end; ++i) {
    const double offset = static_cast<double>(i) - centre_bin;
    weights += offset * offset;
    sum += offset * offset * value(std::min<double>(power_w_[i], ceiling_w_));
  }
  return weights > 0 ? sum / weights : value(peak_w_);
}

}  // namespace groundray
