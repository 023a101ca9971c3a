#include "apps/golden/compare/images/image_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/io/file_io.h"
#include "test/support/scans/sample_image.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::image_comparison_test {
namespace {

using groundray::testing::figure;
using groundray::testing::image;
using groundray::testing::layer;
using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

constexpr double infinity = std::numeric_limits<double>::infinity();

Section compare(const ImageFile& reference, const ImageFile& other) {
  return compare_images(reference, other, {}, "images");
}

// 40 x 25 px: 20 px are sky in the reference and 20 others in the other image; one depth is 2 m
// off, all others 5 cm.
TEST(CompareImages, ReportsKnownErrorsOfDepths) {
  const glm::ivec2 size_px(40, 25);
  ImageFile reference =
      image({layer("Z", LayerKind::Depth, size_px, 1, [](int, int, int) { return 10.0; })});
  ImageFile other =
      image({layer("Z", LayerKind::Depth, size_px, 1, [](int, int, int) { return 10.05; })});
  for (int x = 0; x < 20; ++x) {
    reference.layers[0].values.at(x, 0)[0] = infinity;
    other.layers[0].values.at(x, 1)[0] = x % 2 == 0 ? 0 : 1e10;  // other programs' values for sky
  }
  other.layers[0].values.at(7, 9)[0] = 8;
  const Section section = compare(reference, other);
  EXPECT_EQ(figure(section, "Z: in both"), 960);
  EXPECT_EQ(figure(section, "Z: in the reference alone"), 20);
  EXPECT_EQ(figure(section, "Z: in the other alone"), 20);
  EXPECT_NEAR(figure(section, "Z: mean error"), (959 * 0.05 - 2) / 960, 1e-12);
  EXPECT_NEAR(figure(section, "Z: RMS error"), std::sqrt((959 * 0.0025 + 4) / 960), 1e-12);
  EXPECT_NEAR(figure(section, "Z: median size of error"), 0.05, 1e-12);
  EXPECT_NEAR(figure(section, "Z: 95th percentile of its size"), 0.05, 1e-12);
  EXPECT_NEAR(figure(section, "Z: largest error"), 2, 1e-12);
  EXPECT_NEAR(figure(section, "Z: median size of relative error"), 0.5, 1e-12);
  EXPECT_NEAR(figure(section, "Z: share of errors beyond 1 %"), 100.0 / 960, 1e-12);
  EXPECT_THAT(section.text,
              HasSubstr("Z: the largest error is in column 7, row 9: 8 where the reference has "
                        "10."));
  EXPECT_EQ(section.verdict, Verdict::Told);
  EXPECT_EQ(section.pictures.size(), 3u);
}

// One image has values in its left half only, the other in its right half only.
TEST(CompareImages, ReportsNoErrorsOfLayersWithoutCommonPixels) {
  struct Kind {
    std::string name;
    LayerKind kind;
    int channels;
  };
  for (const Kind& of : {Kind{"Z", LayerKind::Depth, 1}, Kind{"N", LayerKind::Normal, 3},
                         Kind{"RGB", LayerKind::Colour, 3}, Kind{"FlowForward", LayerKind::Flow, 2},
                         Kind{"P", LayerKind::Number, 3}, Kind{"Bound", LayerKind::Number, 1}}) {
    const auto half = [&](bool left) {
      return image({layer(of.name, of.kind, {20, 20}, of.channels, [left](int x, int, int) {
        return (x < 10) == left ? 1 : std::nan("");
      })});
    };
    const Section section = compare(half(true), half(false));
    EXPECT_EQ(section.verdict, Verdict::Failed) << of.name;
    EXPECT_EQ(figure(section, of.name + ": in both"), 0);
    EXPECT_EQ(figure(section, of.name + ": in the reference alone"), 200);
    EXPECT_EQ(figure(section, of.name + ": in the other alone"), 200);
    EXPECT_EQ(section.measures.size(), 3u) << of.name;
    EXPECT_THAT(section.text, HasSubstr(of.name + ": the images have no pixel in common"));
    EXPECT_TRUE(section.tables.empty() && section.histograms.empty());
    // The backward flow of a sequence's first image, for example, is empty: it equals itself.
    const ImageFile neither = image({layer(of.name, of.kind, {20, 20}, of.channels,
                                           [](int, int, int) { return std::nan(""); })});
    const Section empty = compare(neither, neither);
    EXPECT_EQ(empty.verdict, Verdict::Told) << of.name;
    EXPECT_EQ(empty.measures.size(), 3u) << of.name;
    EXPECT_THAT(empty.text, HasSubstr(of.name + ": neither image has a value"));
  }
}

// 40 x 25 px; the error is 1 cm per column, so within columns 10 to 14 it is 10 to 14 cm.
TEST(CompareImages, ComparesARectangleOfPixels) {
  const auto depth = [](double slope) {
    return image({layer("Z", LayerKind::Depth, {40, 25}, 1,
                        [slope](int x, int, int) { return 10 + slope * x; })});
  };
  const PixelBox box{{10, 3}, {5, 7}};
  const Section section = compare(cropped(depth(0), box), cropped(depth(0.01), box));
  EXPECT_EQ(figure(section, "Z: in both"), 35);
  EXPECT_NEAR(figure(section, "Z: mean error"), 0.12, 1e-12);
  EXPECT_NEAR(figure(section, "Z: largest error"), 0.14, 1e-12);
  EXPECT_THAT(section.text, HasSubstr("Z: the largest error is in column 14, row 3"));
  EXPECT_THAT(section.headline, HasSubstr("Z: RMS error 0.1208 m"));
  EXPECT_THAT(section.main, ElementsAre("Z: RMS error", "Z: largest error", "Z: mean error",
                                        "Z: 95th percentile of its size"));
  const Picture& errors = section.pictures.back();
  EXPECT_EQ(errors.shown, Shown::Errors);
  EXPECT_EQ(errors.across->low, 10);
  EXPECT_EQ(errors.across->high, 15);
  EXPECT_EQ(errors.up->low, 10);
  EXPECT_EQ(errors.up->high, 3);
  EXPECT_EQ(errors.bar->marks.back().second, "0.2");  // 0.14, rounded up
  for (const PixelBox& wrong :
       {PixelBox{{36, 0}, {5, 5}}, PixelBox{{0, 0}, {0, 5}}, PixelBox{{-1, 0}, {5, 5}},
        PixelBox{{0, 24}, {5, 2}}, PixelBox{{2, 2}, {2147483647, 5}}}) {
    EXPECT_THAT([&] { cropped(depth(0), wrong); },
                ThrowsMessage<Error>(HasSubstr("must be COLUMN ROW WIDTH HEIGHT within the image "
                                               "of 40 x 25 px")));
  }
}

TEST(CompareImages, FindsNoDifferenceBetweenEqualImages) {
  const auto some = [](int x, int y, int k) { return std::sin(x + 2.0 * y + k) + 2; };
  const ImageFile one = image({layer("Z", LayerKind::Depth, {20, 20}, 1, some),
                               layer("RGB", LayerKind::Colour, {20, 20}, 3, some),
                               layer("N", LayerKind::Normal, {20, 20}, 3, some),
                               layer("FlowForward", LayerKind::Flow, {20, 20}, 2, some),
                               layer("Label", LayerKind::Label, {20, 20}, 1, some),
                               layer("P", LayerKind::Number, {20, 20}, 3, some)});
  const Section section = compare(one, one);
  for (const Measure& measure : section.measures) {
    if (measure.name.find("error") == std::string::npos) continue;
    EXPECT_EQ(measure.value, 0) << measure.name;
  }
  EXPECT_NEAR(figure(section, "RGB: structural similarity (SSIM) of luminance, an aid to the eye"),
              1, 1e-12);
  EXPECT_EQ(figure(section, "Label: share of equal pixels"), 100);
  EXPECT_EQ(section.text, "");
}

TEST(CompareImages, MeasuresAnglesBetweenNormalsWhateverTheirLengths) {
  const double tilt = 0.01;
  const ImageFile reference = image({layer("N", LayerKind::Normal, {10, 10}, 3,
                                           [](int, int, int k) { return k == 2 ? 1.0 : 0.0; })});
  ImageFile other = image({layer("N", LayerKind::Normal, {10, 10}, 3, [&](int x, int, int k) {
    const double angle = x == 0 ? std::numbers::pi - tilt : tilt;
    return 2 * (k == 0 ? std::sin(angle) : k == 1 ? 0 : std::cos(angle));
  })});
  const Section section = compare(reference, other);
  EXPECT_NEAR(figure(section, "N: angle: median"), tilt * 180 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(figure(section, "N: angle: largest"), 180 - tilt * 180 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(figure(section, "N: share on the other side"), 10, 1e-12);
  for (double& value : other.layers[0].values.values()) value = -value;
  EXPECT_THAT(compare(reference, other).text, HasSubstr("normals point to the opposite side"));
}

TEST(CompareImages, ReportsBiasNoiseAndPeakOfColours) {
  const ImageFile reference = image({layer("Picture", LayerKind::Colour, {16, 16}, 3,
                                           [](int, int, int k) { return 0.2 + 0.1 * k; })});
  const ImageFile other =
      image({layer("Picture", LayerKind::Colour, {16, 16}, 3,
                   [](int x, int, int k) { return 0.2 + 0.1 * k + (x % 2 == 0 ? 0.03 : -0.01); })});
  const Section section = compare(reference, other);
  EXPECT_NEAR(figure(section, "Picture: mean error"), 0.01, 1e-12);
  EXPECT_NEAR(figure(section, "Picture: RMS error"), std::sqrt(0.0005), 1e-12);
  EXPECT_NEAR(figure(section, "Picture: PSNR, white being 1"), -10 * std::log10(0.0005), 1e-9);
  EXPECT_NEAR(figure(section, "Picture: mean of other by mean of reference"), 0.31 / 0.3, 1e-12);
  EXPECT_THAT(section.tables[0].rows[2],
              ElementsAre("Picture", "0.4", "0.41", "0.01", "0.0223607"));
}

// The oracle evaluates the definition window by window.
TEST(StructuralSimilarity, MatchesWangsMeanOverWindows) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform;
  Image<double> a(17, 14, 1), b(17, 14, 1);
  for (std::size_t i = 0; i < a.values().size(); ++i) {
    a.values()[i] = uniform(random);
    b.values()[i] = 0.7 * a.values()[i] + 0.3 * uniform(random);
  }
  double sum = 0;
  for (int y = 5; y < 9; ++y) {
    for (int x = 5; x < 12; ++x) {
      double weights = 0, m = 0, n = 0, mm = 0, nn = 0, mn = 0;
      for (int j = -5; j <= 5; ++j) {
        for (int i = -5; i <= 5; ++i) {
          const double w = std::exp(-(i * i + j * j) / 4.5);
          const double u = a.at(x + i, y + j)[0], v = b.at(x + i, y + j)[0];
          weights += w, m += w * u, n += w * v, mm += w * u * u, nn += w * v * v, mn += w * u * v;
        }
      }
      m /= weights, n /= weights;
      const double uu = mm / weights - m * m, vv = nn / weights - n * n, uv = mn / weights - m * n;
      sum += (2 * m * n + 4e-4) * (2 * uv + 36e-4) / ((m * m + n * n + 4e-4) * (uu + vv + 36e-4));
    }
  }
  EXPECT_NEAR(structural_similarity(a, b, 2), sum / 28, 1e-12);
  EXPECT_NEAR(structural_similarity(a, a, 2), 1, 1e-12);
  EXPECT_TRUE(
      std::isnan(structural_similarity(Image<double>(10, 20, 1), Image<double>(10, 20, 1), 1)));
}

// Flow of 100 px and of 10 px, each 4 px off: within KITTI's 5 % for the first, an outlier for the
// second.
TEST(CompareImages, CountsFlowOutliersByKittisDefinition) {
  const ImageFile reference =
      image({layer("FlowForward", LayerKind::Flow, {10, 10}, 2, [](int x, int, int k) {
        return k == 1 ? 0.0 : x < 3 ? 10.0 : 100.0;
      })});
  ImageFile other = reference;
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) other.layers[0].values.at(x, y)[1] = 4;
  }
  other.layers[0].values.at(9, 9)[0] = std::nan("");
  const Section section = compare(reference, other);
  EXPECT_NEAR(figure(section, "FlowForward: end-point error: mean"), 4, 1e-12);
  EXPECT_NEAR(figure(section, "FlowForward: outliers as KITTI has them (Fl: beyond 3 px and 5 %)"),
              100.0 * 30 / 99, 1e-12);
  EXPECT_EQ(figure(section, "FlowForward: in the reference alone"), 1);
  for (double& value : other.layers[0].values.values()) value = -value;
  EXPECT_THAT(compare(reference, other).text, HasSubstr("with its sign reversed"));
}

TEST(CompareImages, ReportsConfusedLabels) {
  const ImageFile reference =
      image({layer("Label", LayerKind::Label, {10, 10}, 1, [](int, int y, int) { return y; })});
  ImageFile other = reference;
  for (int x = 0; x < 6; ++x) other.layers[0].values.at(x, 3)[0] = 8;
  other.layers[0].values.at(0, 5)[0] = 1;
  const Section section = compare(reference, other);
  EXPECT_NEAR(figure(section, "Label: share of equal pixels"), 93, 1e-12);
  EXPECT_THAT(section.tables[0].rows,
              ElementsAre(ElementsAre("3", "8", "6"), ElementsAre("5", "1", "1")));
}

/// A scene with smooth radiance and edges.
double scene(double x, double y) {
  return 5 + std::sin(0.37 * x + 0.11 * y) + std::sin(0.23 * y - 0.3 * x) + (x > 20.7 ? 3 : 0);
}

TEST(Misalignment, DetectsShiftsAndMirrorings) {
  const auto shifted = [](double dx, double dy) {
    return layer("Z", LayerKind::Depth, {48, 40}, 1,
                 [&](int x, int y, int) { return scene(x - dx, y - dy); });
  };
  const ImageLayer reference = shifted(0, 0);
  const auto found = [&](const ImageLayer& other) {
    const auto result = misalignment(reference.values, other.values);
    return result ? result->what : "nothing";
  };
  EXPECT_EQ(found(reference), "nothing");
  EXPECT_EQ(found(shifted(1, 0)), "moved by (-1, 0) px");
  EXPECT_EQ(found(shifted(-0.5, -0.5)), "moved by (0.5, 0.5) px");
  EXPECT_EQ(found(shifted(0, 0.5)), "moved by (0, -0.5) px");
  EXPECT_EQ(found(layer("Z", LayerKind::Depth, {48, 40}, 1,
                        [](int x, int y, int) { return scene(47 - x, y); })),
            "mirrored left to right");
  EXPECT_EQ(found(layer("Z", LayerKind::Depth, {48, 40}, 1,
                        [](int x, int y, int) { return scene(x, 39 - y); })),
            "mirrored top to bottom");
  EXPECT_EQ(found(layer("Z", LayerKind::Depth, {48, 40}, 1,
                        [](int x, int y, int) { return scene(47 - x, 39 - y); })),
            "turned by 180 degrees");
  ImageLayer scaled = reference;
  for (double& value : scaled.values.values()) value *= 1.1;
  EXPECT_EQ(found(scaled), "nothing");
}

TEST(Misalignment, IsDetectedInLargeImagesBySomeOfTheirPixels) {
  const auto shifted = [](double dx) {
    return layer("Z", LayerKind::Depth, {2100, 2100}, 1,
                 [&](int x, int y, int) { return scene(x - dx, y); });
  };
  const auto found = misalignment(shifted(0).values, shifted(1).values);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->what, "moved by (-1, 0) px");
  EXPECT_LT(found->difference, 1e-12);
}

TEST(Misalignment, IsNotDetectedInNoise) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal(10, 1);
  const auto noise = [&](int, int, int) { return normal(random); };
  for (int i = 0; i < 20; ++i) {
    const ImageLayer a = layer("Y", LayerKind::Colour, {32, 32}, 1, noise);
    const ImageLayer b = layer("Y", LayerKind::Colour, {32, 32}, 1, noise);
    EXPECT_FALSE(misalignment(a.values, b.values));
  }
}

TEST(CompareImages, WarnsOfLikelyMisinterpretations) {
  const auto at = [](double dx) {
    return layer("Z", LayerKind::Depth, {48, 40}, 1,
                 [&](int x, int y, int) { return scene(x - dx, y); });
  };
  EXPECT_THAT(compare(image({at(0)}), image({at(0.5)})).text,
              AllOf(HasSubstr("SEEMS TO BE MISALIGNED"), HasSubstr("moved by (-0.5, 0) px")));
  ImageLayer in_mm = at(0);
  for (double& value : in_mm.values.values()) value *= 1000;
  EXPECT_THAT(compare(image({at(0)}), image({in_mm})).text,
              AllOf(HasSubstr("Z of the other is 1000 times the reference's"),
                    Not(HasSubstr("MISALIGNED"))));
  ImageLayer range = at(0);
  range.name = "Distance";
  for (int x = 0; x < 48; ++x) {
    for (int y = 0; y < 40; ++y) range.values.at(x, y)[0] *= std::hypot(1, x / 48.0 - 0.5);
  }
  ImageLayer range_called_depth = range;
  range_called_depth.name = "Z";
  EXPECT_THAT(compare(image({at(0), range}), image({range_called_depth})).text,
              HasSubstr("The other's Z is much closer to the reference's Distance"));
}

TEST(CompareImages, CountsErrorsBeyondTheBound) {
  const auto constant = [](double value) { return [value](int, int, int) { return value; }; };
  const ImageFile reference = image({layer("Distance", LayerKind::Depth, {4, 4}, 1, constant(10)),
                                     layer("Bound", LayerKind::Number, {4, 4}, 1, constant(0.01))});
  ImageFile other = image({layer("Distance", LayerKind::Depth, {4, 4}, 1, constant(10.009))});
  other.layers[0].values.at(1, 1)[0] = 10.011;
  EXPECT_EQ(figure(compare(reference, other), "Distance: errors beyond the reference's own bound"),
            1);
}

TEST(CompareImages, ReadsFilesAndRejectsIncompatibleOnes) {
  const TemporaryFolder folder;
  ImageF wide(8, 4, 1), narrow(7, 4, 1);
  for (float& value : wide.values()) value = 2;
  write_exr(folder / "a.exr", {{{"Z"}, &wide}});
  write_exr(folder / "b.exr", {{{"depth"}, &wide}});
  write_exr(folder / "c.exr", {{{"Z"}, &narrow}});
  write_exr(folder / "d.exr", {{{"foo"}, &wide}});
  const Section section = compare_images(folder / "a.exr", folder / "b.exr");
  EXPECT_EQ(figure(section, "Z: in both"), 32);
  EXPECT_THAT(section.text, HasSubstr("Z is Z in the reference and depth in the other."));
  EXPECT_THAT(section.title, AllOf(HasSubstr("b.exr against "), HasSubstr("a.exr")));
  EXPECT_THAT([&] { compare_images(folder / "a.exr", folder / "c.exr"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("c.exr cannot be compared with"),
                                         HasSubstr("it has 7 x 4 px and the reference 8 x 4"))));
  EXPECT_THAT(
      [&] { compare_images(folder / "a.exr", folder / "d.exr"); },
      ThrowsMessage<Error>(HasSubstr("they have no layer in common: the reference has Z, the "
                                     "other foo")));
  write_text(folder / "e.exr", "garbage");
  EXPECT_THAT([&] { compare_images(folder / "a.exr", folder / "e.exr"); },
              ThrowsMessage<Error>(HasSubstr("e.exr: it is not an image")));
}

}  // namespace
}  // namespace groundray::golden::image_comparison_test
