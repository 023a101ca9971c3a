#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace groundray {

/// Echo in the samples of a waveform's segment: a maximum and the minima beside it. Positions are
/// in bins from the segment's beginning. Between samples the logarithm of the power is interpolated
/// by a cubic, or at the top by a parabola, which is exact for a Gaussian.
class EchoTrace {
 public:
  /// Maximum between two minima; `end` is the `begin` of the next lobe.
  struct Lobe {
    std::size_t begin = 0, peak = 0, end = 0;
  };
  /// Position at which the power crosses a level, and its slope there, W per bin, not negative; 0
  /// if there is no crossing.
  struct Crossing {
    double bin = 0, slope_w = 0;
  };

  /// Interval about the peak in which the power is above a level. It ends at a minimum beside the
  /// peak if the power does not cross the level on that side (`rises` or `falls` is then false).
  struct Extent {
    double begin_bin = 0, end_bin = 0;
    bool rises = false, falls = false;
  };

  /// Maxima are merged if the dip between them is shallower than this fraction of the lower one.
  static constexpr double ripple = 1e-3;

  /// @param ceiling_w  saturation, W: power above it is clipped.
  EchoTrace(std::span<const float> power_w, double ceiling_w, const Lobe& lobe);

  const Lobe& lobe() const { return lobe_; }
  bool clipped() const { return clipped_; }
  double peak_w() const { return peak_w_; }            ///< interpolated between samples, clipped
  double peak_bin() const { return peak_bin_; }        ///< if clipped, the middle of the plateau
  double curvature_w() const { return curvature_w_; }  ///< at the peak, W per bin^2; 0 if clipped
  /// Returns the first rise to a level; the begin if the power is already there.
  Crossing first_rise(double level_w) const;
  /// Returns the last rise to a level before the peak; the begin if the power is not below it
  /// before.
  Crossing last_rise(double level_w) const;
  /// Returns the rise of the peak's parabola to a level: the slope of an echo whose neighbour hides
  /// its own rise.
  Crossing rise_before_peak(double level_w) const { return beside_peak(level_w, -1); }
  /// Returns the first fall to a level after the peak; the end if there is none.
  Crossing fall(double level_w) const;
  /// Returns the interval above a level about the peak, for widths. Between samples the logarithm
  /// of the power is assumed to have the same curvature as at the peak.
  Extent above(double level_w) const;
  /// Returns the full width at half of the peak, bins. It is twice one side if a neighbouring echo
  /// hides the other, and the echo's extent if both sides are hidden.
  double width_bins() const;
  double sum_w() const { return sum_w_; }  ///< clipped power summed over its bins
  /// Returns the centroid of the clipped power; the peak if only the segment's last bin has power.
  double mean_bin() const;
  /// Returns the mean of value(power) over the bins of an extent, weighted by (bin - centre)^2.
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

/// Calls `act(lobe)` for each maximum of the clipped power, in order. Neighbouring maxima are
/// merged if the minimum between them is `joining_w` or more; the merged peak is the higher one, or
/// the first of equals.
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
