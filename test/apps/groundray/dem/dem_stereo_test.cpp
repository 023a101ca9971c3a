#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "apps/groundray/dem/dem_input.h"
#include "core/error.h"
#include "core/image/png_io.h"
#include "test/support/temporary_folder.h"
#include "test/support/wave_texture.h"

namespace groundray::dem_stereo_test {
namespace {

using std::chrono::nanoseconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr glm::ivec2 size_px{160, 120};
constexpr double focal_px = 150, height_m = 6, baseline_m = 0.5;

RecordedFrame frame_at(int number, int stamp_us) {
  return {.number = number, .stamp = nanoseconds(1000 * stamp_us), .file = ""};
}

RecordedPair pair_of(std::vector<RecordedFrame> left, std::vector<RecordedFrame> right) {
  const auto camera = [](const char* name, double x_m, std::vector<RecordedFrame> frames) {
    // Nadir view: C's x axis is D's, its y and z axes are opposite to D's.
    const Pose X_DC{.rotation = {0, 1, 0, 0}, .translation_m = {x_m, 0, height_m}};
    return RecordedCamera{
        .name = name,
        .X_DC = Trajectory({{nanoseconds(0), X_DC}, {nanoseconds(900'000'000), X_DC}}),
        .lens = Pinhole{{.focal_px = glm::dvec2(focal_px), .centre_px = {79.5, 59.5}}},
        .size_px = size_px,
        .exposure_s = 0,
        .row_s = 0,
        .frames = std::move(frames)};
  };
  return {.name = "pair",
          .cameras = {camera("left", 0, std::move(left)),
                      camera("right", baseline_m, std::move(right))}};
}

std::vector<std::string> names_of(const std::vector<RecordedPair>& pairs, const FrameRange& frames,
                                  std::vector<std::string>& notes) {
  std::vector<std::string> names;
  for (const ImagePair& images : image_pairs(pairs, frames, notes)) {
    names.push_back(images.name);
    EXPECT_EQ(images.pair->cameras[0].frames[images.left].number,
              images.pair->cameras[1].frames[images.right].number);
  }
  return names;
}

TEST(DemStereo, PairsImagesOfEqualNumberAndTime) {
  const std::vector<RecordedPair> pairs{
      pair_of({frame_at(0, 0), frame_at(1, 100), frame_at(2, 200), frame_at(4, 400)},
              {frame_at(0, 0), frame_at(2, 201), frame_at(3, 300), frame_at(4, 402)})};
  std::vector<std::string> notes;
  EXPECT_THAT(names_of(pairs, {}, notes), ElementsAre("pair/000000", "pair/000002"));
  EXPECT_THAT(notes, ElementsAre("pair: 2 images have no counterpart at their time"));
  notes.clear();
  EXPECT_THAT(names_of(pairs, {.first = 1, .end = 4, .step = 1}, notes),
              ElementsAre("pair/000002"));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("1 image has")));  // among the requested images
  notes.clear();
  EXPECT_THAT(names_of(pairs, {.first = 0, .end = 1, .step = 1}, notes),
              ElementsAre("pair/000000"));
  EXPECT_THAT(notes, IsEmpty());
}

// Synthetic images of textured level ground at height 0, as a pair of cameras above it images it.
class Pictures {
 public:
  Pictures() : pair_(pair_of({frame_at(0, 100)}, {frame_at(0, 100)})) {
    const WaveTexture waves(4 * height_m / focal_px, Seed{7});
    for (RecordedCamera& camera : pair_.cameras) {
      const double x_m = camera.X_DC.pose_at(nanoseconds(0)).translation_m.x;
      const ImageF light = waves.image(size_px, [&](glm::dvec2 pixel) {
        const glm::dvec2 at = (pixel - glm::dvec2(79.5, 59.5)) * height_m / focal_px;
        return glm::dvec2(x_m + at.x, -at.y);
      });
      Image8 picture(size_px.x, size_px.y, 1);
      std::ranges::transform(light.values(), picture.values().begin(), [](float value) {
        return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255));
      });
      RecordedFrame& frame = camera.frames[0];
      frame.file = folder_ / (camera.name + ".png");
      write_png(frame.file, picture);
    }
  }

  RecordedPair& pair() { return pair_; }
  const std::filesystem::path& folder() const { return folder_.path(); }
  ImagePair images() const {
    return {.name = "pair/000000", .pair = &pair_, .left = 0, .right = 0};
  }

 private:
  TemporaryFolder folder_;
  RecordedPair pair_;
};

TEST(DemStereo, MeasuresLevelGround) {
  const Pictures pictures;
  MeasuredPoints points;
  points.p_m.resize(3);  // points of another source, which must stay unchanged
  points.sd_m.resize(3);
  points.bias_sd_m.resize(3);
  points.lean.resize(3);
  points.across_sd_m.resize(3);
  points.groups.resize(3);
  points.origins.resize(3);
  const PointTally tally = add_stereo_points(pictures.images(), {}, {}, 9, points);
  EXPECT_EQ(tally.name, "pair/000000");
  EXPECT_GT(tally.rows, 8000U);  // of 160 x 120 pixels, less 13 columns that only one camera sees
  ASSERT_GT(tally.points, 150U);
  // Points are taken from every sixth row and column. No pixel is missing from the sum, which is
  // the size of the rectified image.
  EXPECT_NEAR(static_cast<double>(tally.rows), 36. * static_cast<double>(tally.points),
              0.05 * static_cast<double>(tally.rows));
  const StereoTally& pixels = tally.pixels;
  const UnmatchedCounts& none = pixels.unmatched;
  const std::uint64_t unmatched = none.unseen + none.ambiguous + none.inconsistent + none.speckle +
                                  none.unrefined + none.uncertain;
  EXPECT_EQ(pixels.matched() + unmatched, 160U * 120U);
  ASSERT_EQ(points.size(), tally.points + 3);
  EXPECT_EQ(points.bias_sd_m[0], 0);
  const double pixel_m = height_m * height_m / (focal_px * baseline_m);  // height per pixel: 0.48 m
  std::vector<double> sds_m;
  for (std::size_t i = 3; i < points.size(); ++i) {
    // Four standard deviations: one in 16,000 normal errors exceeds them. The pair's bias is 0.1
    // px.
    const double sd_m = std::hypot(points.sd_m[i], points.bias_sd_m[i]);
    EXPECT_LT(std::abs(points.p_m[i].z), 4 * sd_m) << i;
    sds_m.push_back(sd_m);
    EXPECT_EQ(points.groups[i], 9U);
    EXPECT_EQ(points.origins[i], PointOrigin::Stereo);
    // The derivatives with respect to disparity are z² / (f b) for depth, and z / f for the
    // position off the axis.
    const double depth_m = height_m - points.p_m[i].z;
    const double bias_m = 0.1 * depth_m * depth_m / (focal_px * baseline_m);
    EXPECT_NEAR(points.bias_sd_m[i], bias_m, 0.02 * bias_m);
  }
  // The bias is 0.1 px, and the noise of these images adds little. Single windows contain a
  // starting disparity that is off by pixels, which they state as if the surface bent there.
  std::ranges::sort(sds_m);
  EXPECT_LT(sds_m[sds_m.size() * 99 / 100], 0.25 * pixel_m);
  EXPECT_LT(sds_m.back(), pixel_m);
}

TEST(DemStereo, PoseErrorsAddToTheBias) {
  const Pictures pictures;
  MeasuredPoints exact, off;
  add_stereo_points(pictures.images(), {}, {}, 0, exact);
  const PointNoise noise{.position_sd_m = 0.03, .attitude_sd_rad = 0.01};
  add_stereo_points(pictures.images(), {}, {.points = noise}, 0, off);
  ASSERT_EQ(off.p_m, exact.p_m);
  EXPECT_EQ(off.sd_m, exact.sd_m);
  for (std::size_t i = 0; i < off.size(); ++i) {
    const double lever_m = glm::length(glm::dvec2(off.p_m[i]));  // the left camera is above (0, 0)
    const double more_m2 = 0.03 * 0.03 + lever_m * lever_m * 1e-4;
    EXPECT_NEAR(off.bias_sd_m[i], std::sqrt(std::pow(exact.bias_sd_m[i], 2) + more_m2), 1e-6);
  }
}

std::string fault_of(const Pictures& pictures, const StereoOptions& taking = {}) {
  MeasuredPoints points;
  try {
    add_stereo_points(pictures.images(), taking, {}, 0, points);
  } catch (const Error& error) {
    EXPECT_EQ(points.size(), 0U);
    return error.what();
  }
  return "none";
}

TEST(DemStereo, ErrorsNameFileAndCause) {
  Pictures pictures;
  EXPECT_EQ(fault_of(pictures), "none");
  StereoOptions small;
  small.matching.most_bytes = 1000;
  EXPECT_THAT(fault_of(pictures, small),
              AllOf(HasSubstr("pair/000000: matching"), HasSubstr("--memory-mb")));
  RecordedCamera &left = pictures.pair().cameras[0], &right = pictures.pair().cameras[1];
  right.size_px = {64, 48};
  EXPECT_THAT(fault_of(pictures), AllOf(HasSubstr("right.png: it has 160 x 120 px"),
                                        HasSubstr("calibration/right.yaml says 64 x 48")));
  right.size_px = size_px;
  left.frames[0].stamp = nanoseconds(2'000'000'000);
  EXPECT_THAT(fault_of(pictures), AllOf(HasSubstr("poses/left.tum"), HasSubstr("truncated")));
  left.frames[0].stamp = nanoseconds(100'000);
  left.frames[0].file = pictures.folder() / "left.exr";
  EXPECT_THAT(fault_of(pictures),
              AllOf(HasSubstr("left.exr"), HasSubstr("right.png is a picture")));
}

}  // namespace
}  // namespace groundray::dem_stereo_test
