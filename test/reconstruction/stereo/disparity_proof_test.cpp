#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <string>
#include <variant>
#include <vector>

#include "core/image/image_io.h"
#include "core/io/npy_io.h"
#include "reconstruction/stereo/disparity.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"

namespace groundray::disparity_proof_test {
namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
constexpr DisparityRange range{0, 79};

RectifiedImage seen_whole(ImageF grey) {
  Image8 seen(grey.width(), grey.height(), 1);
  std::ranges::fill(seen.values(), std::uint8_t{1});
  return {std::move(grey), std::move(seen)};
}

// Rows of disparities; not finite where the truth is unknown.
ImageF truth_of(const std::filesystem::path& path, int width, int height) {
  const NpzFile file = read_npz(path);
  const auto& columns = file.arrays.at(0).cloud.columns();
  ImageF truth(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      truth.at(x, y)[0] = std::visit(
          [&](const auto& values) {
            return static_cast<float>(values[static_cast<std::size_t>(y)]);
          },
          columns.at(static_cast<std::size_t>(x)).values);
    }
  }
  return truth;
}

// Reference: OpenCV's matcher with its own left-right check and its own speckle removal.
ImageF plain_sgbm(const RectifiedImage& left, const RectifiedImage& right, int mode) {
  const int width = left.grey.width(), height = left.grey.height();
  const auto mat_of = [&](const ImageF& grey) {
    cv::Mat mat(height, width, CV_8UC1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        mat.at<uchar>(y, x) = static_cast<uchar>(std::lround(255 * grey.at(x, y)[0]));
    }
    return mat;
  };
  constexpr int block_px = 5, area = block_px * block_px;
  const auto matcher = cv::StereoSGBM::create(range.least_px, range.most_px + 1, block_px, 8 * area,
                                              32 * area, 1, 63, 10, 100, 2, mode);
  cv::Mat found;
  matcher->compute(mat_of(left.grey), mat_of(right.grey), found);
  ImageF disparity_px(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const short value = found.at<short>(y, x);
      disparity_px.at(x, y)[0] = value < 0 ? nothing : static_cast<float>(value) / 16.0F;
    }
  }
  return disparity_px;
}

struct Score {
  double known = 0, given = 0, bad = 0;
  double bad_percent() const { return 100 * bad / given; }
  double bad_or_missing_percent() const { return 100 * (known - given + bad) / known; }
};

// Middlebury's bad-2.0, over the pixels with known truth.
Score score_of(const ImageF& disparity_px, const ImageF& truth_px) {
  Score score;
  for (std::size_t i = 0; i < truth_px.values().size(); ++i) {
    const float true_px = truth_px.values()[i], found_px = disparity_px.values()[i];
    if (!std::isfinite(true_px)) continue;
    ++score.known;
    if (std::isnan(found_px)) continue;
    ++score.given;
    score.bad += std::abs(found_px - true_px) > 2 ? 1 : 0;
  }
  return score;
}

class MotorcycleProof : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = testing::shared_data_folder() / "stereo" / "motorcycle";
    if (!exists(folder))
      GTEST_SKIP() << "there is no stereo pair in " << folder << "; set GROUNDRAY_SHARED_DATA";
    left_ = seen_whole(grey_of(read_image8(folder / "motorcycle_left.png")));
    right_ = seen_whole(grey_of(read_image8(folder / "motorcycle_right.png")));
    truth_px_ = truth_of(folder / "motorcycle_disp.npz", left_.grey.width(), left_.grey.height());
  }

  RectifiedImage left_, right_;
  ImageF truth_px_;
};

TEST_F(MotorcycleProof, HasFewerBadPixelsThanOpenCv) {
  const Score sure = score_of(match(left_, right_, {.range = range}).disparity_px, truth_px_);
  // All disparities that pass the left-right check, however uncertain.
  const Score all =
      score_of(match(left_, right_,
                     {.range = range, .smoothing = MatchOptions::Smoothing::None, .most_sd_px = 9})
                   .disparity_px,
               truth_px_);
  RecordProperty("bad-2.0 of given, percent", std::to_string(sure.bad_percent()));
  RecordProperty("given, percent", std::to_string(100 * sure.given / sure.known));
  RecordProperty("all: bad-2.0 or missing, percent", std::to_string(all.bad_or_missing_percent()));
  for (const int mode :
       {cv::StereoSGBM::MODE_SGBM, cv::StereoSGBM::MODE_HH, cv::StereoSGBM::MODE_SGBM_3WAY}) {
    const Score theirs = score_of(plain_sgbm(left_, right_, mode), truth_px_);
    EXPECT_LT(sure.bad_percent(), theirs.bad_percent() / 2) << mode;
    EXPECT_LT(all.bad_percent(), theirs.bad_percent()) << mode;
    EXPECT_LT(all.bad_or_missing_percent(), theirs.bad_or_missing_percent()) << mode;
    testing::record_margin("bad-2.0", sure.bad_percent(), theirs.bad_percent(), "%");
    testing::record_margin("bad-2.0 or missing", all.bad_or_missing_percent(),
                           theirs.bad_or_missing_percent(), "%");
  }
  EXPECT_GT(sure.given, 0.75 * sure.known);
}

// The truth is accurate to about 0.1 px, and the standard deviation does not cover mismatches at
// edges: therefore the median of errors is compared, over pixels with similar stated values. The
// limits are those of a DEM's errors, 0.85 to 1.15.
TEST_F(MotorcycleProof, StatedErrorsAreCorrect) {
  const DisparityMap map = match(left_, right_, {.range = range});
  constexpr std::array<double, 5> steps_px{0.1, 0.12, 0.17, 0.24, 0.4};
  for (std::size_t step = 1; step < steps_px.size(); ++step) {
    std::vector<double> normalised;
    for (std::size_t i = 0; i < truth_px_.values().size(); ++i) {
      const double sd_px = map.sd_px.values()[i], true_px = truth_px_.values()[i];
      if (!std::isfinite(true_px) || !(sd_px >= steps_px[step - 1] && sd_px < steps_px[step]))
        continue;
      normalised.push_back(std::abs(static_cast<double>(map.disparity_px.values()[i]) - true_px) /
                           sd_px);
    }
    ASSERT_GT(normalised.size(), 1000U);
    const auto middle = normalised.begin() + static_cast<std::ptrdiff_t>(normalised.size() / 2);
    std::ranges::nth_element(normalised, middle);
    const double robust_rms = 1.4826 * *middle;
    EXPECT_NEAR(robust_rms, 1, 0.15) << steps_px[step];
    testing::record_margin("normalised error", robust_rms - 1, 0.15);
  }
}

// Higher confidence, fewer mismatches.
TEST_F(MotorcycleProof, HigherConfidenceMeansFewerMismatches) {
  const DisparityMap map = match(left_, right_, {.range = range});
  double before = 1;
  for (const double least : {0.5, 0.7, 0.8, 0.9}) {
    const double most = least < 0.7 ? 0.7 : least + 0.1;
    double count = 0, bad = 0;
    for (std::size_t i = 0; i < truth_px_.values().size(); ++i) {
      const double confidence = map.confidence.values()[i];
      const float off_px = map.disparity_px.values()[i] - truth_px_.values()[i];
      if (!std::isfinite(off_px) || confidence < least || confidence >= most) continue;
      ++count;
      bad += std::abs(off_px) > 2 ? 1 : 0;
    }
    EXPECT_LT(bad / count, before) << least;
    before = bad / count;
  }
  EXPECT_LT(before, 0.035);  // 0.015 with guided smoothing
}

}  // namespace
}  // namespace groundray::disparity_proof_test
