#include "reconstruction/stereo/semi_global.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace groundray {
namespace {

constexpr int search_width_px = 320;
constexpr int gradient_cap = 63;

cv::Mat mat_of(const Image8& image) {
  cv::Mat mat(image.height(), image.width(), CV_8UC1);
  std::ranges::copy(image.values(), mat.begin<std::uint8_t>());
  return mat;
}

// StereoSGBM requires a multiple of 16.
int count_of(const DisparityRange& range) {
  return (range.most_px - range.least_px + 16) / 16 * 16;
}

void check_bytes(const Image8& image, const DisparityRange& range, const MatchOptions& options) {
  if (options.paths != MatchOptions::Paths::Eight) return;
  const double columns = image.width() + std::max(0, range.most_px) + std::max(0, -range.least_px);
  const double bytes = 8 * columns * image.height() * (range.most_px - range.least_px + 16);
  if (bytes <= static_cast<double>(options.most_bytes)) return;
  throw Error(
      "matching {} x {} px over disparities of {} to {} px would take {:.3g} GB, more than the "
      "{:.3g} GB allowed (most_bytes): allow more, use a narrower range, or use paths Five",
      image.width(), image.height(), range.least_px, range.most_px, bytes / 1e9,
      static_cast<double>(options.most_bytes) / 1e9);
}

// Returns the disparities, times 16, of the first image. Both images are widened, so that all
// disparities are searched at all pixels of the first one.
cv::Mat found_from(const cv::Mat& first, const cv::Mat& second, const DisparityRange& range,
                   const MatchOptions& options) {
  const int count = count_of(range);
  const int before = std::max(0, range.least_px + count), after = std::max(0, -range.least_px);
  cv::Mat wide_first, wide_second, wide;
  cv::copyMakeBorder(first, wide_first, 0, 0, before, after, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(second, wide_second, 0, 0, before, after, cv::BORDER_REPLICATE);
  const int area = options.block_px * options.block_px;
  const auto matcher = cv::StereoSGBM::create(
      range.least_px, count, options.block_px, options.step_cost * area, options.jump_cost * area,
      -1, gradient_cap, options.uniqueness_percent, 0, 0,
      options.paths == MatchOptions::Paths::Eight ? cv::StereoSGBM::MODE_HH
                                                  : cv::StereoSGBM::MODE_SGBM);
  matcher->compute(wide_first, wide_second, wide);
  return wide.colRange(before, before + first.cols).clone();
}

ImageF pixels_of(const cv::Mat& found, const DisparityRange& range) {
  ImageF result(found.cols, found.rows, 1);
  std::transform(found.begin<short>(), found.end<short>(), result.values().begin(), [&](int value) {
    return value < 16 * range.least_px ? no_disparity : static_cast<float>(value) / 16.0F;
  });
  return result;
}

Image8 shrunk(const Image8& image, int step) {
  const cv::Mat full = mat_of(image);
  const cv::Size size(std::max(1, full.cols / step), std::max(1, full.rows / step));
  Image8 small(size.width, size.height, 1);
  cv::Mat into(size, CV_8UC1, small.values().data());
  cv::resize(full, into, size, 0, 0, cv::INTER_AREA);
  return small;
}

// Converts disparities, times `sign`, to OpenCV's format.
cv::Mat fixed(const ImageF& image, float sign, int none) {
  cv::Mat mat(image.height(), image.width(), CV_16SC1);
  std::ranges::transform(image.values(), mat.begin<short>(), [&](float value) {
    return static_cast<short>(std::isnan(value) ? none : std::lround(sign * value * 16));
  });
  return mat;
}

}  // namespace

bool shows_window(const Image8& seen, int x, int y, int reach) {
  for (int dy = -reach; dy <= reach; dy += reach) {
    for (int dx = -reach; dx <= reach; dx += reach) {
      const int column = std::clamp(x + dx, 0, seen.width() - 1);
      const int row = std::clamp(y + dy, 0, seen.height() - 1);
      if (seen.at(column, row)[0] == 0) return false;
    }
  }
  return true;
}

SemiGlobalDisparity semi_global(const Image8& left, const Image8& right,
                                const DisparityRange& range, const MatchOptions& options) {
  check_bytes(left, range, options);
  const cv::Mat left_mat = mat_of(left), right_mat = mat_of(right);
  SemiGlobalDisparity result;
  tbb::parallel_invoke(
      [&] { result.left_px = pixels_of(found_from(left_mat, right_mat, range, options), range); },
      [&] {
        // The mirrored right image is the left one of a pair with the same disparities.
        cv::Mat left_mirrored, right_mirrored, found;
        cv::flip(left_mat, left_mirrored, 1);
        cv::flip(right_mat, right_mirrored, 1);
        cv::flip(found_from(right_mirrored, left_mirrored, range, options), found, 1);
        result.right_px = pixels_of(found, range);
      });
  return result;
}

std::uint64_t remove_speckles(ImageF& disparity_px, int pixels) {
  constexpr short none = std::numeric_limits<short>::min();
  cv::Mat found = fixed(disparity_px, 1, none);
  cv::filterSpeckles(found, none, pixels - 1, 16);  // largest patch that is removed
  std::uint64_t removed = 0;
  auto kept = found.begin<short>();
  for (float& value : disparity_px.values()) {
    if (*kept++ != none || std::isnan(value)) continue;
    value = no_disparity;
    ++removed;
  }
  return removed;
}

std::optional<DisparityRange> common_range(const SearchedImage& left, const SearchedImage& right,
                                           const MatchOptions& options) {
  const int step = (left.grey.width() + search_width_px - 1) / search_width_px;
  const Image8 small_left = shrunk(left.grey, step), small_right = shrunk(right.grey, step);
  const DisparityRange all{-2, std::max(1, small_left.width() / 2)};
  const SemiGlobalDisparity found = semi_global(small_left, small_right, all, options);
  ImageF kept = found.left_px;
  constexpr int beside = 3;  // the boundaries of both seen areas look alike, wherever they are
  for (int y = 0; y < kept.height(); ++y) {
    for (int x = 0; x < kept.width(); ++x) {
      float& value = kept.at(x, y)[0];
      const int there = std::isnan(value) ? -1 : x - static_cast<int>(std::lround(value));
      if (there < 0 || there >= kept.width() ||
          !(std::abs(found.right_px.at(there, y)[0] - value) <= 1) ||
          !shows_window(left.seen, x * step, y * step, beside * step) ||
          !shows_window(right.seen, there * step, y * step, beside * step))
        value = no_disparity;
    }
  }
  constexpr int least_pixels = 32;
  remove_speckles(kept, least_pixels);
  int least = all.most_px + 1, most = all.least_px - 1;
  for (const float value : kept.values()) {
    if (std::isnan(value)) continue;
    least = std::min(least, static_cast<int>(std::floor(value)));
    most = std::max(most, static_cast<int>(std::ceil(value)));
  }
  if (least > most) return std::nullopt;
  return DisparityRange{(least - 1) * step, (most + 1) * step};
}

}  // namespace groundray
