#include "reconstruction/stereo/disparity.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "core/error.h"
#include "reconstruction/stereo/semi_global.h"

namespace groundray {
namespace {

bool is_within(double value, double least, double most) { return least <= value && value <= most; }

bool is_sound(const RectifiedImage& image) {
  return image.grey.width() > 0 && image.grey.channels() == 1 && image.seen.channels() == 1 &&
         image.grey.width() == image.seen.width() && image.grey.height() == image.seen.height();
}

void check_images(const RectifiedImage& left, const RectifiedImage& right, Violations& broken) {
  broken.unless(is_sound(left) && is_sound(right),
                "each image must have pixels of 1 channel, and a mask of the same size");
  broken.unless(
      left.grey.width() == right.grey.width() && left.grey.height() == right.grey.height(),
      "the left image has {} x {} px, the right one {} x {}: the sizes must be equal",
      left.grey.width(), left.grey.height(), right.grey.width(), right.grey.height());
}

void check_match_options(const MatchOptions& options, Violations& broken) {
  const auto is_odd = [](int side, int least, int most) {
    return least <= side && side <= most && side % 2 == 1;
  };
  broken.unless(is_odd(options.block_px, 1, 11), "block_px = {} must be odd, 1 to 11",
                options.block_px);
  broken.unless(is_odd(options.window_px, 5, 31), "window_px = {} must be odd, 5 to 31",
                options.window_px);
  broken.unless(
      0 < options.step_cost && options.step_cost < options.jump_cost && options.jump_cost <= 100,
      "step_cost = {} must be above 0 and below jump_cost = {}, which is at most 100",
      options.step_cost, options.jump_cost);
  broken.unless(is_within(options.uniqueness_percent, 0, 99),
                "uniqueness_percent = {} must be 0 to 99", options.uniqueness_percent);
  broken.unless(is_within(options.left_right_px, 0, 16), "left_right_px = {} must be 0 to 16",
                options.left_right_px);
  broken.unless(options.speckle_px >= 0, "speckle_px = {} must be 0 or more", options.speckle_px);
  broken.unless(is_within(options.sd_factor, 0, 100), "sd_factor = {} must be 0 to 100",
                options.sd_factor);
  broken.unless(is_within(options.sd_bend_factor, 0, 100), "sd_bend_factor = {} must be 0 to 100",
                options.sd_bend_factor);
  broken.unless(is_within(options.sd_floor_px, 0, 10), "sd_floor_px = {} must be 0 to 10",
                options.sd_floor_px);
  broken.unless(options.most_sd_px > 0, "most_sd_px = {} must be above 0", options.most_sd_px);
  if (!options.range) return;
  const DisparityRange& range = *options.range;
  broken.unless(-farthest_px <= range.least_px && range.least_px < range.most_px &&
                    range.most_px <= farthest_px,
                "range = {} to {} px must not be empty or exceed {} px on either side",
                range.least_px, range.most_px, farthest_px);
}

// Marks pixels that are not finite as unseen.
RectifiedImage cleaned(RectifiedImage image) {
  for (std::size_t i = 0; i < image.grey.values().size(); ++i) {
    if (std::isfinite(image.grey.values()[i])) continue;
    image.grey.values()[i] = 0;
    image.seen.values()[i] = 0;
  }
  return image;
}

SearchedImage searched(const RectifiedImage& image) {
  SearchedImage result{{image.grey.width(), image.grey.height(), 1}, image.seen};
  std::ranges::transform(image.grey.values(), result.grey.values().begin(), [](float value) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0F, 1.0F)));
  });
  return result;
}

// Removes the disparities that those of the right image do not confirm.
void keep_consistent(const Image8& left_seen, const Image8& right_seen, const MatchOptions& options,
                     SemiGlobalDisparity& found, UnmatchedCounts& counts) {
  for (int y = 0; y < left_seen.height(); ++y) {
    for (int x = 0; x < left_seen.width(); ++x) {
      float& value = found.left_px.at(x, y)[0];
      const int there = std::isnan(value) ? -1 : x - static_cast<int>(std::lround(value));
      if (left_seen.at(x, y)[0] == 0) {
        ++counts.unseen;
      } else if (there < 0 || there >= left_seen.width() ||
                 !shows_window(right_seen, there, y, options.window_px / 2)) {
        ++counts.ambiguous;
      } else if (!(std::abs(found.right_px.at(there, y)[0] - value) <= options.left_right_px)) {
        ++counts.inconsistent;
      } else {
        continue;
      }
      value = no_disparity;
    }
  }
}

// Returns the starting values of least squares: only where consistent disparities were found.
ImageF starts(const SearchedImage& left, const SearchedImage& right, const MatchOptions& options,
              DisparityMap& map) {
  SemiGlobalDisparity found = semi_global(left.grey, right.grey, map.range, options);
  ImageF smooth;
  if (options.smoothing == MatchOptions::Smoothing::Guided)
    smooth = smooth_guided(left.grey, found);
  keep_consistent(left.seen, right.seen, options, found, map.unmatched);
  map.unmatched.speckle = remove_speckles(found.left_px, options.speckle_px);
  if (smooth.width() == 0) return found.left_px;
  for (std::size_t i = 0; i < smooth.values().size(); ++i) {
    float& value = found.left_px.values()[i];
    const float smooth_px = smooth.values()[i];
    if (!std::isnan(value) && !std::isnan(smooth_px)) value = smooth_px;
  }
  return found.left_px;
}

void keep_certain(const ImageF& start_px, const RefinedDisparity& refined,
                  const MatchOptions& options, DisparityMap& map) {
  for (std::size_t i = 0; i < start_px.values().size(); ++i) {
    if (std::isnan(start_px.values()[i])) continue;
    const double sd_px = glm::length(glm::dvec3(
        options.sd_floor_px, options.sd_factor * static_cast<double>(refined.sd_px.values()[i]),
        options.sd_bend_factor * static_cast<double>(refined.bend_px.values()[i])));
    if (!(sd_px <= options.most_sd_px)) {
      ++(std::isnan(sd_px) ? map.unmatched.unrefined : map.unmatched.uncertain);
      continue;
    }
    map.disparity_px.values()[i] = refined.disparity_px.values()[i];
    map.sd_px.values()[i] = static_cast<float>(sd_px);
    map.confidence.values()[i] = refined.explained.values()[i];
  }
}

}  // namespace

DisparityRange disparity_range(const PinholePair& pair, double nearest_m, double farthest_m) {
  const double most_px = pair.focal_px * pair.baseline_m / nearest_m;
  if (!(nearest_m > 0 && nearest_m < farthest_m && most_px < farthest_px)) {
    throw Error(
        "depths from {} to {} m have disparities of {:.4g} to {:.4g} px: the nearest depth must be "
        "positive, below the farthest, and have less than {} px",
        nearest_m, farthest_m, most_px, pair.focal_px * pair.baseline_m / farthest_m, farthest_px);
  }
  return {static_cast<int>(std::floor(pair.focal_px * pair.baseline_m / farthest_m)) - 1,
          std::min(static_cast<int>(std::ceil(most_px)) + 1, farthest_px)};
}

DisparityMap match(const RectifiedImage& left, const RectifiedImage& right,
                   const MatchOptions& options) {
  Violations broken("stereo pair to match");
  check_images(left, right, broken);
  check_match_options(options, broken);
  broken.throw_if_any();
  const ImageF empty(left.grey.width(), left.grey.height(), 1);
  DisparityMap map{empty, empty, empty, {}, {}};
  std::ranges::fill(map.disparity_px.values(), no_disparity);
  std::ranges::fill(map.sd_px.values(), no_disparity);

  const RectifiedImage clean_left = cleaned(left), clean_right = cleaned(right);
  const SearchedImage left_search = searched(clean_left), right_search = searched(clean_right);
  auto range = options.range ? options.range : common_range(left_search, right_search, options);
  if (range) {
    // No pixel matches one that is farther away than the image is wide.
    const int most_px = std::min(farthest_px, left.grey.width() - 1);
    range->least_px = std::max(range->least_px, -most_px);
    range->most_px = std::min(range->most_px, most_px);
  }
  if (!range || range->least_px >= range->most_px) {
    const auto& seen = left_search.seen.values();
    map.unmatched.unseen = static_cast<std::uint64_t>(std::ranges::count(seen, std::uint8_t{0}));
    map.unmatched.ambiguous = seen.size() - map.unmatched.unseen;
    return map;
  }
  map.range = *range;
  const ImageF start_px = starts(left_search, right_search, options, map);
  const RefinedDisparity refined =
      refine(clean_left.grey, clean_right.grey, start_px, options.window_px);
  keep_certain(start_px, refined, options, map);
  return map;
}

}  // namespace groundray
