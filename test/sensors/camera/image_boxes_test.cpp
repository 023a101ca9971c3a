// Instances in images: their visibility against images without what hides them, and closed forms.
#include "sensors/camera/image_boxes.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <random>
#include <vector>

#include "test/support/lens_samples.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/solid.h"

namespace groundray::image_boxes_test {
namespace {

using namespace std::chrono_literals;
using groundray::testing::board;
using groundray::testing::box_model;
using groundray::testing::centred;
using groundray::testing::gliding;
using groundray::testing::icosphere;
using groundray::testing::looking;
using groundray::testing::plane_ground;
using groundray::testing::scene_of;

const Materials::InColour grey{{{LambertianBsdf{glm::dvec3(0.5)}}}, {glm::vec3(0.5f)}};

std::vector<ImagedInstance> measure(const Camera& camera, const Scene& scene,
                                    const Trajectory& X_DC) {
  const ImageTruth truth = image_truth(camera, scene, grey, X_DC, {});
  return imaged_instances(camera, scene, InstanceBoxes(scene.objects), X_DC, 0ns, truth);
}

// Pixels that show an instance, counted in the truth of an image.
struct Counted {
  std::uint32_t pixels = 0;
  glm::ivec2 low{1 << 20}, high{-1};
};
Counted count(const Camera& camera, const Scene& scene, const Trajectory& X_DC,
              std::uint32_t instance) {
  const ImageTruth truth = image_truth(camera, scene, grey, X_DC, {});
  Counted counted;
  for (int y = 0; y < truth.instance.height(); ++y) {
    for (int x = 0; x < truth.instance.width(); ++x) {
      if (truth.instance.at(x, y)[0] != instance) continue;
      ++counted.pixels;
      counted.low = glm::min(counted.low, {x, y});
      counted.high = glm::max(counted.high, {x, y});
    }
  }
  return counted;
}

// Objects at random before the camera, some of them large, near or beside the image; each is
// compared with images of the same scene, and of a scene with this object alone and no ground.
void expect_counts(const CameraSpec& spec, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> near_far(4, 40), across(-0.7, 0.7), scale(0.2, 1.5);
  std::vector<PlacedObject> placed;
  for (std::uint32_t i = 0; i < 80; ++i) {
    const double x = near_far(random);
    placed.push_back({{x, across(random) * x, across(random) * x},
                      glm::angleAxis(0.3 * i, glm::normalize(glm::dvec3(1, 2, 3))),
                      scale(random),
                      i % 2});
  }
  const std::vector<Model> models{icosphere(1, 2), box_model({2, 1, 0.7})};
  const Scene scene = scene_of(plane_ground(0, 0, -2), models, placed);
  const Camera camera(spec);
  const Trajectory X_DC = gliding(looking({0, 0, 0}, {1, 0, 0}), {3, 2, 0});
  const auto instances = measure(camera, scene, X_DC);
  EXPECT_GT(instances.size(), 10u);
  std::uint32_t hidden = 0;
  for (const ImagedInstance& seen : instances) {
    const std::uint32_t number = seen.box.instance;
    const Counted visible = count(camera, scene, X_DC, number);
    EXPECT_EQ(seen.pixels, visible.pixels);
    EXPECT_EQ(seen.visible.low, visible.low);
    EXPECT_EQ(seen.visible.high, visible.high);
    const Scene bare = scene_of(plane_ground(0, 0, -1000), models, {placed[number - 1]});
    const Counted alone = count(camera, bare, X_DC, 1);
    EXPECT_EQ(seen.alone, alone.pixels);
    EXPECT_EQ(seen.whole.low, alone.low);
    EXPECT_EQ(seen.whole.high, alone.high);
    EXPECT_EQ(seen.visible_share, static_cast<double>(visible.pixels) / alone.pixels);
    hidden += seen.pixels < seen.alone ? 1 : 0;
  }
  EXPECT_GT(hidden, 3u);
}

TEST(ImageBoxes, VisibilityEqualsCountsInAnImageWithoutWhatHides) {
  const glm::ivec2 size_px(96, 72);
  expect_counts({.lens = Pinhole{centred(60, size_px)}, .size_px = size_px}, 1);
  expect_counts(
      {.lens = KannalaBrandt{centred(40, size_px), {0.05, -0.01, 0, 0}}, .size_px = size_px}, 2);
}

TEST(ImageBoxes, VisibilityHoldsWithARollingShutter) {
  const glm::ivec2 size_px(96, 72);
  CameraSpec spec{.lens = Pinhole{centred(60, size_px)}, .size_px = size_px};
  spec.shutter = {.exposure_s = 1e-3, .row_s = 2e-3};
  expect_counts(spec, 3);
}

// A board that faces the camera, a part of it beside the image: its shares are ratios of lengths.
TEST(ImageBoxes, TruncationOfABoardIsARatioOfLengths) {
  const glm::ivec2 size_px(200, 100);
  const Camera camera({.lens = Pinhole{centred(100, size_px)}, .size_px = size_px});
  const Trajectory X_DC = gliding(looking({0, 0, 0}, {1, 0, 0}), {});
  // At 10 m the image reaches 10 m to each side; a board of 6 m about y = 9 reaches from 6 to 12.
  for (const auto& [y_m, beside] : {std::pair(0.0, 0.0), {9.0, 1.0 / 3}, {11.0, 2.0 / 3}}) {
    const Scene scene = scene_of(plane_ground(0, 0, -1000), {board(3)}, {{{10, y_m, 0}}});
    const auto instances = measure(camera, scene, X_DC);
    ASSERT_EQ(instances.size(), 1u);
    // Half a pixel, 0.05 m, at two edges of each of two parts of 6 m.
    EXPECT_NEAR(instances[0].truncated_share, beside, 0.02);
    EXPECT_EQ(instances[0].visible_share, 1);
    EXPECT_EQ(instances[0].box.size_m, glm::dvec3(0, 6, 6));
  }
}

TEST(ImageBoxes, AnObjectAroundTheCameraFillsTheImage) {
  const glm::ivec2 size_px(64, 48);
  const Camera camera({.lens = Pinhole{centred(40, size_px)}, .size_px = size_px});
  const Scene scene = scene_of(plane_ground(0, 0, -1000), {box_model({4, 4, 4})}, {{{0, 0, 0}}});
  const auto instances = measure(camera, scene, gliding(looking({0, 0, 0}, {1, 0, 0}), {}));
  ASSERT_EQ(instances.size(), 1u);
  EXPECT_EQ(instances[0].pixels, 64u * 48);
  EXPECT_EQ(instances[0].alone, 64u * 48);
  EXPECT_NEAR(instances[0].truncated_share, 0.75, 0.01);  // half an image more on each side
}

}  // namespace
}  // namespace groundray::image_boxes_test
