#include "apps/view/recorded/recorded_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <string>

#include "apps/colour_map.h"
#include "apps/view/recorded/pixel_ray.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/flow_io.h"
#include "core/image/png_io.h"
#include "core/io/npy_io.h"
#include "sensors/camera/lidar_image.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::recorded_image_test {
namespace {

using groundray::testing::SampleDataset;
using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

const RecordedRun& sample_run() {
  static const RecordedRun run = read_recorded_run(SampleDataset::get().path());
  return run;
}

const RecordedSensor& eye() { return sample_run().sensors[1]; }

RecordedImage image_of(std::size_t frame) {
  return RecordedImage(eye().frames.at(frame).file, sample_run().names);
}

std::string refusal(const std::filesystem::path& stem) {
  try {
    const RecordedImage image(stem, RecordedNames());
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

Colour colour_at(const Image8& picture, int x, int y) {
  const auto rgb = picture.at(x, y);
  return Colour(rgb[0], rgb[1], rgb[2]) / 255.0;
}

std::string value_at(const RecordedImage& image, const std::string& channel, glm::ivec2 pixel) {
  for (const PixelValue& value : image.values_at(pixel)) {
    if (value.channel == channel) return value.text;
  }
  return "no such channel";
}

TEST(RecordedImage, HasAllChannelsOfAFrame) {
  const RecordedImage image = image_of(1);
  EXPECT_EQ(image.size_px(), glm::ivec2(64, 48));
  for (const char* name : {"depth", "distance", "label", "instance", "material", "normal",
                           "shading normal", "albedo", "incidence", "velocity", "position", "valid",
                           "flow to the next image", "flow to the image before"})
    EXPECT_TRUE(image.find(name)) << name;
  EXPECT_FALSE(image.find("light"));
  EXPECT_EQ(image.channels().front().name, "depth");
  EXPECT_EQ(image.channels().front().file, "000001.exr");
  for (std::size_t i = 0; i < image.channels().size(); ++i) {
    const DrawnChannel drawn = image.draw(i);
    EXPECT_EQ(drawn.picture.width(), 64);
    EXPECT_EQ(drawn.picture.channels(), 3);
    EXPECT_LE(drawn.legend.low, drawn.legend.high);
  }
}

TEST(RecordedImage, ListsLabelsWithTheirNames) {
  const RecordedImage image = image_of(0);
  const DrawnChannel labels = image.draw(*image.find("label"));
  std::size_t pixels = 0;
  std::string names;
  for (const ImageLegend::Category& category : labels.legend.categories) {
    pixels += category.pixels;
    names += category.name + "; ";
  }
  EXPECT_EQ(pixels, 64U * 48U);
  EXPECT_THAT(names,
              AllOf(HasSubstr("3 ground; "), HasSubstr("10 cart; "), HasSubstr("0 nothing")));
  EXPECT_EQ(value_at(image, "label", {30, 47}), "3 (ground)");
  EXPECT_EQ(value_at(image, "material", {30, 47}), "1 (dry_soil)");
  EXPECT_EQ(value_at(image, "depth", {30, 0}), "sky");
  EXPECT_EQ(value_at(image, "normal", {30, 0}), "none");
  EXPECT_EQ(value_at(image, "flow to the image before", {30, 47}), "no such channel");
  EXPECT_THAT(value_at(image, "depth", {30, 47}), HasSubstr(" m"));
  EXPECT_TRUE(image.values_at({64, 0}).empty());
  EXPECT_TRUE(image.values_at({0, -1}).empty());
}

// The oracle is the channel of positions, which the ray tracer wrote from its own poses and lens.
TEST(RecordedImage, PixelRaysHitTheRecordedSurface) {
  const RecordedImage image = image_of(2);
  const RecordedFrame& frame = eye().frames[2];
  const std::size_t position = *image.find("position");
  int seen = 0;
  double worst_m = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto ray = seen_pixel(eye(), frame, {x, y}, &image);
      ASSERT_TRUE(ray);
      EXPECT_NEAR(glm::length(ray->direction), 1, 1e-12);
      const auto p = image.numbers_at(position, {x, y});
      if (!ray->p_D_m) {
        EXPECT_TRUE(std::isnan(p[0]));
        continue;
      }
      const glm::dvec3 truth(p[0], p[1], p[2]);
      EXPECT_LT(glm::distance(*ray->p_D_m, truth), 3e-5) << x << ", " << y;  // floats at 100 m
      worst_m = std::max(worst_m, glm::distance(*ray->p_D_m, truth));
      const auto pixel = pixel_of(eye(), frame, truth);
      ASSERT_TRUE(pixel);
      EXPECT_LT(glm::distance(*pixel, glm::dvec2(x, y)), 1e-3);
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000);
  groundray::testing::record_margin("surface under a pixel", worst_m, 3e-5, "m");
}

TEST(RecordedImage, LocatesTheSurfaceByDepthAlone) {
  const RecordedImage whole = image_of(0);
  const TemporaryFolder folder;
  const auto& depth = std::get<ImageF>(whole.channels()[*whole.find("depth")].values);
  write_exr(folder / "000000.exr", {{{"Z"}, &depth}});
  const RecordedImage image(folder / "000000", RecordedNames());
  EXPECT_EQ(image.channels().size(), 1U);
  EXPECT_FALSE(image.distance_m({3, 40}));
  const auto by_depth = seen_pixel(eye(), eye().frames[0], {3, 40}, &image);
  const auto by_distance = seen_pixel(eye(), eye().frames[0], {3, 40}, &whole);
  EXPECT_LT(glm::distance(*by_depth->p_D_m, *by_distance->p_D_m), 1e-4);
  EXPECT_FALSE(seen_pixel(eye(), eye().frames[0], {30, 0}, &image)->p_D_m);  // sky
  EXPECT_FALSE(seen_pixel(eye(), eye().frames[0], {3, 40}, nullptr)->p_D_m);
  EXPECT_THROW(seen_pixel(sample_run().sensors[0], eye().frames[0], {3, 4}, nullptr), Error);
}

TEST(RecordedImage, MapsNumbersToColours) {
  const TemporaryFolder folder;
  ImageF values(5, 1, 1);
  for (std::size_t i = 0; i < 5; ++i)
    values.values()[i] = std::array{1.0F, 10.0F, 100.0F, infinity, nan}[i];
  write_exr(folder / "a.exr", {{{"Z"}, &values}});
  write_exr(folder / "b.exr", {{{"Incidence"}, &values}});
  const RecordedImage depth(folder / "a.exr"), incidence(folder / "b.exr");
  // Logarithmic scale; near is bright.
  const DrawnChannel near = depth.draw(0, std::pair(1.0, 100.0));
  EXPECT_TRUE(near.legend.is_logarithmic);
  const auto same = [](const Colour& a, const Colour& b) { return glm::distance(a, b) < 0.004; };
  EXPECT_TRUE(same(colour_at(near.picture, 0, 0), range_colour(0)));
  EXPECT_TRUE(same(colour_at(near.picture, 1, 0), range_colour(0.5)));
  EXPECT_TRUE(same(colour_at(near.picture, 2, 0), range_colour(1)));
  EXPECT_EQ(colour_at(near.picture, 3, 0), Colour(0));
  EXPECT_EQ(colour_at(near.picture, 4, 0), Colour(0));
  EXPECT_TRUE(same(near.legend.colours.front(), range_colour(0)));
  // Linear scale; high is bright.
  const DrawnChannel even = incidence.draw(0, std::pair(1.0, 19.0));
  EXPECT_FALSE(even.legend.is_logarithmic);
  EXPECT_TRUE(same(colour_at(even.picture, 0, 0), range_colour(1)));
  EXPECT_TRUE(same(colour_at(even.picture, 1, 0), range_colour(0.5)));
  EXPECT_TRUE(same(colour_at(even.picture, 2, 0), range_colour(0)));
  EXPECT_THROW(depth.draw(0, std::pair(2.0, 1.0)), Error);
}

TEST(RecordedImage, AcceptsImagesWithoutFiniteValues) {
  const TemporaryFolder folder;
  ImageF values(3, 2, 6);
  std::ranges::fill(values.values(), nan);
  write_exr(folder / "a.exr",
            {{{"Z", "N.X", "N.Y", "N.Z", "FlowForward.u", "FlowForward.v"}, &values}});
  const RecordedImage image(folder / "a.exr");
  for (std::size_t i = 0; i < image.channels().size(); ++i)
    EXPECT_EQ(colour_at(image.draw(i).picture, 1, 1), Colour(0));
  EXPECT_EQ(value_at(image, "normal", {0, 0}), "none");
}

// Files of other programs may hold values that are no valid label.
TEST(RecordedImage, ShowsInvalidLabelsAsNumbers) {
  const TemporaryFolder folder;
  const double infinite = std::numeric_limits<double>::infinity();
  ImageF values(5, 1, 1);
  const std::array<double, 5> numbers = {std::numeric_limits<double>::quiet_NaN(), -3, 1e20,
                                         infinite, 2.5};
  for (std::size_t i = 0; i < 5; ++i) values.values()[i] = static_cast<float>(numbers[i]);
  write_exr(folder / "a.exr", {{{"Label"}, &values}});
  const RecordedImage image(folder / "a.exr");
  const std::array<const char*, 5> texts = {"none", "-3", "1e+20", "infinite", "2.5"};
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(value_at(image, "label", {i, 0}), texts[static_cast<std::size_t>(i)]);
  EXPECT_EQ(image.draw(0).picture.width(), 5);
}

// The brightest 1 % of radiances is clipped; sRGB encoding brightens the middle of the remaining
// range.
TEST(RecordedImage, ExposesRadiance) {
  const TemporaryFolder folder;
  ImageF rgb(100, 1, 3);
  for (std::size_t i = 0; i < 300; ++i) rgb.values()[i] = std::floor(static_cast<float>(i) / 3) + 1;
  write_exr(folder / "a.exr", {{{"R", "G", "B"}, &rgb}});
  const RecordedImage image(folder / "a.exr");
  EXPECT_EQ(image.channels()[0].name, "light");
  const DrawnChannel drawn = image.draw(0);
  EXPECT_NEAR(drawn.legend.high, 99, 1.01);
  EXPECT_EQ(colour_at(drawn.picture, 99, 0), Colour(1));
  EXPECT_NEAR(colour_at(drawn.picture, 49, 0).x, 0.7354, 0.01);  // sRGB of 0.5
  EXPECT_EQ(value_at(image, "light", {4, 0}), "(5, 5, 5) W/(m² sr)");
}

// Right, up, left and down have different hues; zero flow is white.
TEST(RecordedImage, ReadsFlowInEachFormat) {
  const TemporaryFolder folder;
  ImageF flow_px(3, 2, 2);
  const std::array<float, 12> values{8, 0, -8, 0, 0, 8, 0, -8, 0, 0, nan, nan};
  std::ranges::copy(values, flow_px.values().begin());
  write_flo(folder / "000000.flo", flow_px);
  write_kitti_flow(folder / "000000_flow.png", flow_px);
  const RecordedImage image(folder / "000000", RecordedNames());
  ASSERT_EQ(image.channels().size(), 2U);
  for (std::size_t channel = 0; channel < 2; ++channel) {
    for (int i = 0; i < 5; ++i) {
      const auto numbers = image.numbers_at(channel, {i % 3, i / 3});
      EXPECT_EQ(numbers[0], values[2 * static_cast<std::size_t>(i)]);
      EXPECT_EQ(numbers[1], values[2 * static_cast<std::size_t>(i) + 1]);
    }
    EXPECT_TRUE(std::isnan(image.numbers_at(channel, {2, 1})[0]));
    const Image8 picture = image.draw(channel).picture;
    EXPECT_GT(glm::distance(colour_at(picture, 0, 0), colour_at(picture, 1, 0)), 0.5);
    EXPECT_GT(glm::distance(colour_at(picture, 2, 0), colour_at(picture, 0, 1)), 0.5);
    EXPECT_EQ(colour_at(picture, 1, 1), Colour(1));
    EXPECT_EQ(colour_at(picture, 2, 1), Colour(0));
  }
  EXPECT_EQ(value_at(image, "flow (.flo)", {1, 0}), "(-8, 0) px");
  EXPECT_EQ(value_at(image, "flow (KITTI)", {2, 1}), "none");
}

TEST(RecordedImage, ReadsPicturesOf8And16Bits) {
  const TemporaryFolder folder;
  Image16 raw(2, 1, 1);
  raw.values()[0] = 4095;
  raw.values()[1] = 17;
  write_png(folder / "000000_raw.png", raw);
  Image8 picture(2, 1, 3);
  picture.values()[0] = 200;
  write_png(folder / "000000.png", picture);
  const RecordedImage image(folder / "000000", RecordedNames());
  EXPECT_EQ(value_at(image, "raw", {0, 0}), "4095");
  EXPECT_EQ(value_at(image, "raw", {1, 0}), "17");
  EXPECT_EQ(value_at(image, "picture", {0, 0}), "(200, 0, 0)");
  EXPECT_EQ(image.draw(*image.find("picture")).picture.at(0, 0)[0], 200);
}

// Exposure scales linear light: sRGB (IEC 61966-2-1) encodes 1/4 as 137 and 1/2 as 188.
TEST(RecordedImage, ExposesLightAndPictures) {
  const TemporaryFolder folder;
  ImageF light(2, 1, 3);
  std::ranges::copy(std::array{1.0F, 1.0F, 1.0F, 4.0F, 4.0F, 4.0F}, light.values().begin());
  write_exr(folder / "light.exr", {{{"R", "G", "B"}, &light}});
  const RecordedImage exr(folder / "light.exr");
  EXPECT_EQ(automatic_exposure_ev(exr.channels()[0]), 0);
  const DrawnChannel plain = exr.draw(0), bright = exr.draw(0, std::nullopt, 1);
  EXPECT_NEAR(plain.legend.high, 4, 0.1);
  EXPECT_NEAR(bright.legend.high, plain.legend.high / 2, 1e-12);
  EXPECT_NEAR(plain.picture.at(0, 0)[0], 137, 2);
  EXPECT_NEAR(bright.picture.at(0, 0)[0], 188, 2);
  EXPECT_EQ(bright.picture.at(1, 0)[0], 255);
  Image8 grey(2, 1, 3);
  for (auto& byte : grey.values()) byte = 137;
  write_png(folder / "grey.png", grey);
  const RecordedImage png(folder / "grey.png");
  EXPECT_EQ(png.draw(0).picture.at(0, 0)[0], 137);
  EXPECT_NEAR(png.draw(0, std::nullopt, 1).picture.at(0, 0)[0], 188, 1);
  EXPECT_NEAR(png.draw(0, std::nullopt, -20).picture.at(0, 0)[0], 0, 1);
  EXPECT_NEAR(automatic_exposure_ev(png.channels()[0]), 2, 0.02);
}

// A lidar's echoes are dots of 3 x 3 px: hidden ones are omitted, and the nearest is on top.
TEST(RecordedImage, ShowsPositionsOfEchoes) {
  const TemporaryFolder folder;
  write_png(folder / "000000.png", Image8(12, 8, 3));
  const std::vector<ImagedEcho> echoes{{0, 2.2, 3.4, 7, true, true},
                                       {1, 3, 3, 5, true, true},
                                       {2, 9, 3, 6, true, false},
                                       {3, 11.4, 7.4, 8, true, true}};
  write_imaged_echoes(folder / "000000_top.npy", echoes);
  const RecordedImage image(folder / "000000", RecordedNames());
  EXPECT_EQ(value_at(image, "echoes of top", {1, 3}), "7 m");
  EXPECT_EQ(value_at(image, "echoes of top", {2, 3}), "5 m");
  EXPECT_EQ(value_at(image, "echoes of top", {4, 4}), "5 m");
  EXPECT_EQ(value_at(image, "echoes of top", {5, 3}), "none");
  EXPECT_EQ(value_at(image, "echoes of top", {9, 3}), "none");
  EXPECT_EQ(value_at(image, "echoes of top", {10, 6}), "8 m");
}

TEST(RecordedImage, NamesOfLayersAreUnique) {
  const TemporaryFolder folder;
  const ImageF values(1, 1, 6);
  write_exr(folder / "a.exr", {{{"a.R", "a.G", "a.B", "a.X", "a.Y", "a.Z"}, &values}});
  const RecordedImage image(folder / "a.exr");
  ASSERT_EQ(image.channels().size(), 2U);
  EXPECT_EQ(image.channels()[0].name, "a");
  EXPECT_EQ(image.channels()[1].name, "a (2)");
}

TEST(RecordedImage, ShowsCoverageFromZeroToOne) {
  const TemporaryFolder folder;
  ImageF shares(2, 1, 2);
  std::ranges::copy(std::array{0.25F, 0.75F, 0.5F, 0.5F}, shares.values().begin());
  write_exr(folder / "000000.exr", {{{"Coverage.3", "Coverage.9"}, &shares}});
  RecordedNames names;
  names.labels[3] = "ground";
  const RecordedImage image(folder / "000000", names);
  ASSERT_TRUE(image.find("coverage 3 (ground)"));
  EXPECT_TRUE(image.find("coverage 9"));
  EXPECT_EQ(value_at(image, "coverage 3 (ground)", {0, 0}), "0.25");
  const DrawnChannel drawn = image.draw(*image.find("coverage 9"));
  EXPECT_EQ(drawn.legend.low, 0);
  EXPECT_EQ(drawn.legend.high, 1);
}

TEST(RecordedImage, ReportsTheFileAtFault) {
  const TemporaryFolder folder;
  constexpr double zero = 0;
  EXPECT_THAT(refusal(folder / "000003"), HasSubstr("there is no image of this frame"));
  write_png(folder / "000000.png", Image8(2, 1, 3));
  write_png(folder / "000000_raw.png", Image16(3, 1, 1));
  EXPECT_THAT(refusal(folder / "000000"), HasSubstr("000000.png has 2 x 1 px, but 000000_raw.png"));
  std::ofstream(folder / "000001.exr") << "no EXR";
  EXPECT_THAT(refusal(folder / "000001"), HasSubstr("000001.exr"));
  write_npy(folder / "000000_top.npy", {{"u_px", "<f8"}}, 1, std::as_bytes(std::span(&zero, 1)));
  std::filesystem::remove(folder / "000000_raw.png");
  EXPECT_THAT(refusal(folder / "000000"), HasSubstr("000000_top.npy: it does not contain echoes"));
  std::ofstream(folder / "000002.flo") << "PIEH\x02";
  EXPECT_THAT(refusal(folder / "000002"), HasSubstr("not a complete .flo"));
}

}  // namespace
}  // namespace groundray::recorded_image_test
