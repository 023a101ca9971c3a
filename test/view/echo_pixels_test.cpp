#include "apps/view/recorded/echo_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "apps/view/recorded/pixel_ray.h"
#include "apps/view/recorded/timeline.h"
#include "core/io/ply_io.h"
#include "test/view/sample_dataset.h"

namespace groundray::echo_pixels_test {
namespace {

using testing::SampleDataset;

struct Shot {
  Timeline timeline{SampleDataset::get().path()};
  const RecordedSensor& camera = timeline.sensors()[timeline.sensor_named("eye")];
  const RecordedFrame& frame = camera.frames.at(1);
  RecordedImage image{frame.file, timeline.names()};
};

// The oracle is the inverse function: lines of sight that the lens defines, up to the distances
// that the image records.
TEST(EchoPixels, AreWhereThePointsAreSeenUnlessSomethingIsInFront) {
  const Shot shot;
  std::vector<glm::dvec3> p_D_m;
  std::vector<glm::dvec2> pixels;
  for (const glm::ivec2 pixel : {glm::ivec2(10, 40), {31, 30}, {50, 45}}) {
    const auto seen = seen_pixel(shot.camera, shot.frame, pixel, &shot.image);
    ASSERT_TRUE(seen && seen->p_D_m);
    p_D_m.push_back(*seen->p_D_m);
    p_D_m.push_back(*seen->p_D_m + 5.0 * seen->direction);  // below the ground
    pixels.emplace_back(pixel);
  }
  p_D_m.emplace_back(std::numeric_limits<double>::quiet_NaN());
  const auto echoes = echo_pixels(shot.camera, shot.frame, shot.image, p_D_m);
  ASSERT_EQ(echoes.size(), pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    EXPECT_LT(glm::distance(echoes[i].pixel, pixels[i]), 1e-3);
    const auto depth_m = shot.image.depth_m(glm::ivec2(pixels[i]));
    ASSERT_TRUE(depth_m);
    EXPECT_NEAR(echoes[i].depth_m, *depth_m, 1e-4 * *depth_m);  // recorded as floats
  }
}

// The camera and the lidar see the same surfaces: both state the label of what they hit. Pixels are
// half a metre wide where the ground is far, so those at the edge of an object may differ.
TEST(EchoPixels, ShowTheLabelsOfTheScan) {
  const Shot shot;
  const auto& lidar = shot.timeline.sensors()[shot.timeline.sensor_named("top")];
  const PointCloud scan = read_ply(lidar.frames.at(1).file).cloud;
  const auto x = scan.column<double>("world_x"), y = scan.column<double>("world_y"),
             z = scan.column<double>("world_z");
  const auto label = scan.column<std::uint16_t>("label");
  const std::size_t channel = *shot.image.find("label");
  std::size_t seen = 0, agree = 0;
  for (std::size_t i = 0; i < scan.rows(); ++i) {
    const std::vector<glm::dvec3> p{{x[i], y[i], z[i]}};
    for (const EchoPixel& echo : echo_pixels(shot.camera, shot.frame, shot.image, p)) {
      const glm::ivec2 pixel(std::lround(echo.pixel.x), std::lround(echo.pixel.y));
      ++seen;
      agree += shot.image.numbers_at(channel, pixel)[0] == label[i] ? 1U : 0U;
    }
  }
  EXPECT_GT(seen, 300U);
  EXPECT_GT(static_cast<double>(agree), 0.97 * static_cast<double>(seen));
}

}  // namespace
}  // namespace groundray::echo_pixels_test
