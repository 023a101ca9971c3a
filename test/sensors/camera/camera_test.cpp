#include "sensors/camera/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/solid.h"

namespace groundray::camera_test {
namespace {

using namespace std::chrono_literals;
using groundray::testing::board;
using groundray::testing::centred;
using groundray::testing::first_model_label;
using groundray::testing::gliding;
using groundray::testing::icosphere;
using groundray::testing::looking;
using groundray::testing::plane_ground;
using groundray::testing::sample_lenses;
using groundray::testing::scene_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const glm::dvec3 here(0), ahead(1, 0, 0);

CameraSpec pinhole(double focal_px, glm::ivec2 size_px, int samples) {
  return {.lens = Pinhole{centred(focal_px, size_px)},
          .size_px = size_px,
          .sampling = {.samples = samples, .most_samples = samples, .depth = 1}};
}

const Sky& even_sky() {
  static const Sky sky({.dome = ConstantSky{glm::dvec3(2, 1, 0.5)}});
  return sky;
}

// Fraction of each pixel that shows the first model.
ImageF share_of_model(const Camera& camera, const Scene& scene, const Trajectory& path) {
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const std::vector<std::uint16_t> labels{first_model_label};
  return camera.expose(light, path, 0ns, {.seed = {5}}, labels).coverage;
}

// An object whose edge is at y = 0 and which otherwise exceeds the image: it covers the right half.
Scene right_half(double depth_m) {
  return scene_of(plane_ground(0, 0, -1000), {board(100)}, {{.p_DO = {depth_m, -100, 0}}});
}

// Mean and variance of an edge's spread across columns, px: the steps between columns are the
// spread blurred twice by a pixel's width, which adds 1/6 to the variance.
struct Spread {
  double mean_px = 0, variance_px2 = 0;
};
Spread spread_of(const ImageF& share, int first_row, int end_row) {
  std::vector<double> columns(static_cast<std::size_t>(share.width()));
  for (int x = 0; x < share.width(); ++x) {
    for (int y = first_row; y < end_row; ++y)
      columns[static_cast<std::size_t>(x)] += double(share.at(x, y)[0]) / (end_row - first_row);
  }
  EXPECT_EQ(columns.front(), 0);
  EXPECT_EQ(columns.back(), 1);
  Spread spread;
  double square = 0;
  for (std::size_t x = 0; x + 1 < columns.size(); ++x) {
    const double step = columns[x + 1] - columns[x], at = static_cast<double>(x) + 0.5;
    spread.mean_px += step * at;
    square += step * at * at;
  }
  spread.variance_px2 = square - spread.mean_px * spread.mean_px - 1.0 / 6;
  return spread;
}

// A uniform disc of diameter c has a variance of c^2 / 16 along one axis. On the sensor c is A f |Z
// - Z_f| / (Z (Z_f - f)); f_px and the image distance f Z_f / (Z_f - f) convert it to pixels.
TEST(Camera, DefocusBlursToTheDiscOfAThinLens) {
  const double focal_m = 0.05, f_number = 1.25, aperture_m = focal_m / f_number;
  for (const auto& [focus_m, depth_m] :
       {std::pair(8.0, 3.0), {8.0, 40.0}, {std::numeric_limits<double>::infinity(), 4.0}}) {
    CameraSpec spec = pinhole(2000, {64, 16}, 256);
    spec.aperture = {{.focal_length_m = focal_m, .f_number = f_number, .focus_m = focus_m}};
    const double image_m = std::isinf(focus_m) ? focal_m : focal_m * focus_m / (focus_m - focal_m);
    const double on_sensor_m =
        std::isinf(focus_m)
            ? aperture_m * focal_m / depth_m
            : aperture_m * focal_m * std::abs(depth_m - focus_m) / (depth_m * (focus_m - focal_m));
    const double disc_px = on_sensor_m * 2000 / image_m;
    const ImageF share =
        share_of_model(Camera(spec), right_half(depth_m), gliding(looking(here, ahead), {}));
    const Spread spread = spread_of(share, 0, 16);
    EXPECT_NEAR(4 * std::sqrt(spread.variance_px2), disc_px, 0.01 * disc_px);
    testing::record_margin("disc out of focus", 4 * std::sqrt(spread.variance_px2) / disc_px - 1,
                           0.01);
    EXPECT_NEAR(spread.mean_px, 31.5, 0.05);
  }
}

TEST(Camera, IsSharpInFocusAndWithoutAFocusDistance) {
  for (const auto& focus_m : {std::optional(10.0), std::optional<double>()}) {
    CameraSpec spec = pinhole(2000, {16, 16}, 64);
    spec.aperture = {{.focal_length_m = 0.05, .f_number = 1.25, .focus_m = focus_m}};
    const ImageF share =
        share_of_model(Camera(spec), right_half(10), gliding(looking(here, ahead), {}));
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) EXPECT_EQ(share.at(x, y)[0], x < 8 ? 0 : 1);
    }
  }
}

// Uniform over a width w = f v T / Z, of variance w^2 / 12, whether the camera or the object moves.
TEST(Camera, MotionBlurIsSpeedTimesExposure) {
  for (const double exposure_s : {0.01, 0.03}) {
    CameraSpec spec = pinhole(500, {64, 16}, 256);
    spec.shutter.exposure_s = exposure_s;
    const double speed_m_s = 20, width_px = 500 * speed_m_s * exposure_s / 10;
    const Camera camera(spec);
    const Trajectory path = gliding(looking(here, ahead), {0, speed_m_s, 0});
    const Trajectory still = gliding(looking(here, ahead), {});
    const Scene moving =
        scene_of(plane_ground(0, 0, -1000), {board(100)}, {},
                 {{.X_DO = gliding({.translation_m = {10, -100, 0}}, {0, -speed_m_s, 0})}});
    for (const ImageF& share :
         {share_of_model(camera, right_half(10), path), share_of_model(camera, moving, still)}) {
      const Spread spread = spread_of(share, 0, 16);
      EXPECT_NEAR(std::sqrt(12 * spread.variance_px2), width_px, 0.01 * width_px);
      testing::record_margin("motion blur", std::sqrt(12 * spread.variance_px2) / width_px - 1,
                             0.01);
      EXPECT_NEAR(spread.mean_px, 31.5 + width_px / 2, 0.05);
    }
  }
}

// The edge moves by f v t_row / Z px from row to row, and not at all with a global shutter.
TEST(Camera, RollingShutterShiftsRowByRow) {
  for (const double row_s : {0.0, 0.5e-3}) {
    CameraSpec spec = pinhole(500, {48, 64}, 256);
    spec.shutter = {.exposure_s = 0.008, .row_s = row_s};
    const ImageF share =
        share_of_model(Camera(spec), right_half(10), gliding(looking(here, ahead), {0, -8, 0}));
    // A line fitted to the edges of all rows; an edge's position is the part of its row that the
    // model leaves free.
    double slope_px = 0, weight = 0;
    for (int y = 0; y < 64; ++y) {
      double edge_px = 48;
      for (int x = 0; x < 48; ++x) edge_px -= double(share.at(x, y)[0]);
      slope_px += (y - 31.5) * edge_px;
      weight += (y - 31.5) * (y - 31.5);
    }
    slope_px /= weight;
    // Some pixels of each row are mixed, known to 1/256 each by stratification: 0.01 px, and over
    // 64 rows 1e-4.
    EXPECT_NEAR(slope_px, -500 * 8 * row_s / 10, 1e-3);
    testing::record_margin("rolling shutter", slope_px + 500 * 8 * row_s / 10, 1e-3, "px a row");
  }
}

// A board across the line of sight covers (f side / Z)^2 px.
TEST(Camera, CoverageSumsToOneAndMatchesTheCoveredArea) {
  const Scene scene = scene_of(plane_ground(0, 0, -2), {board(1), icosphere(0.7, 2)},
                               {{.p_DO = {10, 1, 0}}, {.p_DO = {8, -2, 0}, .model = 1}});
  const std::vector<std::uint16_t> labels = labels_of(scene);
  EXPECT_THAT(labels, ElementsAre(0, 3, 10, 11));
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const Camera camera(pinhole(93.7, {64, 48}, 64));
  const Exposure exposure =
      camera.expose(light, gliding(looking(here, ahead), {}), 0ns, {}, labels);
  double board_px = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto shares = exposure.coverage.at(x, y);
      EXPECT_EQ(std::accumulate(shares.begin(), shares.end(), 0.0f), 1);
      board_px += double(shares[2]);
    }
  }
  // 75 pixels on its boundary are each known to about 1/64.
  EXPECT_NEAR(board_px, 93.7 * 93.7 * 4 / 100, 4.0 / 64 * std::sqrt(75));
  EXPECT_EQ(camera.expose(light, gliding(looking(here, ahead), {}), 0ns, {}).coverage.width(), 0);
}

// Pixels beyond the fold have no ray; of pixels on the fold, only the part inside it counts.
TEST(Camera, IsDarkBeyondTheFold) {
  const auto lenses = sample_lenses();
  const auto folds =
      std::ranges::find(lenses, "fisheye, folds", &groundray::testing::LensSample::name);
  const Scene scene = scene_of(plane_ground(0, 0, -1e6), {});  // a speck straight behind the camera
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const Camera camera({.lens = folds->model,
                       .size_px = folds->size_px,
                       .sampling = {.samples = 8, .most_samples = 8, .depth = 1}});
  const std::vector<std::uint16_t> labels{0};
  const Exposure exposure = camera.expose(light, gliding(looking(here, {0.01, 0, 1}), {}), 0ns, {},
                                          labels);  // in view of the sky
  int nowhere = 0, in_part = 0;
  for (int y = 0; y < folds->size_px.y; ++y) {
    for (int x = 0; x < folds->size_px.x; ++x) {
      const bool looks = camera.lens().ray({x, y}).has_value();
      const float samples = exposure.samples.at(x, y)[0];
      EXPECT_EQ(exposure.radiance.at(x, y)[0], looks ? 2 : 0);
      EXPECT_EQ(exposure.coverage.at(x, y)[0], looks ? 1 : 0);
      EXPECT_EQ(samples > 0, looks);
      EXPECT_LE(samples, 8);
      nowhere += !looks;
      in_part += looks && samples < 8;
    }
  }
  EXPECT_GT(nowhere, 1000);
  EXPECT_GT(in_part, 20);
}

// More paths are requested only where the radiance differs within a pixel, and up to four pixels
// from there, where a pilot may have missed what its neighbours see.
TEST(Camera, TracesMorePathsWhereTheErrorIsLarge) {
  const Scene scene = right_half(10);  // unlit at depth 1
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  CameraSpec spec = pinhole(500, {17, 8}, 8);
  // The edge splits column 8 at 2/3: nets do not know that share exactly, as they do 1/2.
  std::get<Pinhole>(spec.lens).scale.centre_px.x += 1 / 6.0;
  spec.sampling.most_samples = 128;
  spec.sampling.relative_error = 1e-3;
  const Exposure exposure =
      Camera(spec).expose(light, gliding(looking(here, ahead), {}), 0ns, {.seed = {1}});
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 17; ++x) {
      if (std::abs(x - 8) > 4) {
        EXPECT_EQ(exposure.samples.at(x, y)[0], 8);
        EXPECT_EQ(exposure.standard_error.at(x, y)[0], 0);
      }
    }
    EXPECT_EQ(exposure.samples.at(8, y)[0], 128);
    EXPECT_NEAR(exposure.radiance.at(8, y)[0], 4.0 / 3, 2 * 4.0 / 128);  // within 4 of 128 strata
  }
  // In single rows the nets may agree; all eight are within the surroundings of row 4.
  EXPECT_GT(exposure.standard_error.at(8, 4)[0], 0);
}

// Most pilots of 4 paths miss a sliver of 1/64 of a column. Their pixels then take only 4 paths,
// which must not bias the mean of many images low. Means of 512 images x 8 rows, each of variance
// at most 4 p (1 - p) / 4, differ from 2 p by 4.9 standard deviations with a probability of 1e-6.
TEST(Camera, AdaptiveSamplingIsUnbiased) {
  const Scene scene = right_half(10);  // unlit at depth 1
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  CameraSpec spec = pinhole(500, {17, 8}, 4);
  std::get<Pinhole>(spec.lens).scale.centre_px.x -= 0.5 - 1 / 64.0;
  spec.sampling.most_samples = 64;
  spec.sampling.relative_error = 1e-2;
  const Camera camera(spec);
  constexpr int frames = 512;
  double sum = 0;
  bool any_takes_few = false;
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    const Exposure exposure =
        camera.expose(light, gliding(looking(here, ahead), {}), 0ns, {.seed = {1}, .frame = frame});
    for (int y = 0; y < 8; ++y) {
      const float mean = std::min(exposure.radiance.at(8, y)[0], 2 - exposure.radiance.at(8, y)[0]);
      sum += mean;
      any_takes_few |= exposure.samples.at(8, y)[0] == 4 && mean == 0;
    }
  }
  EXPECT_TRUE(any_takes_few);
  const double expected = 2 / 64.0, sigma = std::sqrt(expected * (2 - expected) / 4);
  EXPECT_NEAR(sum / (frames * 8), expected, 4.9 * sigma / std::sqrt(frames * 8));
}

TEST(Camera, StandardErrorOfOnePathIsInfinite) {
  const Scene scene = right_half(10);
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  CameraSpec spec = pinhole(500, {3, 3}, 1);
  const Trajectory still = gliding(looking(here, ahead), {});
  EXPECT_TRUE(std::isinf(Camera(spec).expose(light, still, 0ns, {}).standard_error.at(1, 1)[0]));
  spec.sampling.most_samples = 32;
  spec.sampling.relative_error = 0.5;
  EXPECT_EQ(Camera(spec).expose(light, still, 0ns, {}).samples.at(1, 1)[0], 32);
}

TEST(Camera, ExposesTheSameOnAnyNumberOfThreads) {
  const Scene scene =
      scene_of(plane_ground(0.125, 0, -2), {icosphere(1, 2)}, {{.p_DO = {8, 0, 0}}});
  const PathTracer light(scene, even_sky(), 3, std::nullopt);
  CameraSpec spec = pinhole(30, {45, 31}, 4);
  spec.sampling.most_samples = 16;
  spec.sampling.relative_error = 0.05;
  spec.shutter.row_s = 1e-4;
  const Trajectory path = gliding(looking(here, ahead), {3, 1, 0.2});
  const std::vector<std::uint16_t> labels = labels_of(scene);
  const Camera camera(spec);
  const auto expose = [&](std::uint32_t frame) {
    return camera.expose(light, path, 0ns, {.seed = {9}, .frame = frame}, labels);
  };
  const Exposure first = expose(0);
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena(threads).execute([&] {
      const Exposure again = expose(0);
      EXPECT_TRUE(std::ranges::equal(again.radiance.values(), first.radiance.values()));
      EXPECT_TRUE(std::ranges::equal(again.standard_error.values(), first.standard_error.values()));
      EXPECT_TRUE(std::ranges::equal(again.samples.values(), first.samples.values()));
      EXPECT_TRUE(std::ranges::equal(again.coverage.values(), first.coverage.values()));
    });
  }
  EXPECT_FALSE(std::ranges::equal(expose(1).radiance.values(), first.radiance.values()));
}

TEST(Camera, ErrorListsEveryFault) {
  CameraSpec spec = pinhole(100, {64, 48}, 24);
  spec.shutter = {.exposure_s = 0, .row_s = -1};
  spec.sampling.most_samples = 8;
  spec.aperture = {{.focal_length_m = 0.05, .f_number = -2, .focus_m = 0.04, .transmission = 0}};
  EXPECT_THAT([&] { Camera{spec}; },
              ThrowsMessage<Error>(AllOf(
                  HasSubstr("exposure_s = 0 must be positive"), HasSubstr("row_s = -1"),
                  HasSubstr("samples = 24 must be a power of two"), HasSubstr("most_samples = 8"),
                  HasSubstr("f_number = -2"), HasSubstr("focus_m = 0.04 must be more than"),
                  HasSubstr("transmission = 0"))));
}

TEST(Camera, RejectsImagesWithoutPixelsOrWithTooMany) {
  EXPECT_THAT(
      [] {
        Camera{pinhole(100, {0, 48}, 1)};
      },
      ThrowsMessage<Error>(HasSubstr("an image of 0 x 48 px must have from 1 to")));
  EXPECT_THAT(
      [] {
        Camera{pinhole(100, {40000, 25000}, 1)};
      },  // 72 bytes per pixel
      ThrowsMessage<Error>(AllOf(HasSubstr("an image of 40000 x 25000 px must have"),
                                 HasSubstr("its rays take 68664 MiB"))));
}

// Coefficients in an order other than OpenCV's; a focal length of 0.
TEST(Camera, RejectsLensesThatImageNothing) {
  EXPECT_THAT([] { Camera{pinhole(0, {64, 48}, 1)}; }, ThrowsMessage<Error>(HasSubstr("focal")));
  CameraSpec spec = pinhole(100, {64, 48}, 1);
  spec.lens = Eucm{centred(100, {64, 48}), 2, 1};
  EXPECT_THAT([&] { Camera{spec}; }, ThrowsMessage<Error>(HasSubstr("alpha")));
}

TEST(Camera, StopsBetweenRowsOnRequest) {
  struct Stopped {};
  const Scene scene = scene_of(plane_ground(0, 0, -2), {});
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  std::atomic<int> left = 3;
  EXPECT_THROW(Camera(pinhole(100, {64, 256}, 1))
                   .expose(light, gliding(looking(here, ahead), {}), 0ns, {}, {},
                           [&] {
                             if (--left < 0) throw Stopped{};
                           }),
               Stopped);
}

TEST(Camera, RejectsATrajectoryThatDoesNotCoverTheExposure) {
  const Scene scene = scene_of(plane_ground(0, 0, -2), {});
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  EXPECT_THAT(
      [&] {
        Camera(pinhole(100, {8, 8}, 1))
            .expose(light, gliding(looking(here, ahead), {}), 1998ms, {});
      },
      ThrowsMessage<Error>(HasSubstr("exposed from 1.998000 s to 2.003000 s")));
}

// Seen from a camera that moves along an edge's normal, the edge is blurred over the distance of an
// exposure, about its position in the middle of it.
TEST(Camera, ShorterExposuresHaveTheSameMiddle) {
  CameraSpec spec = pinhole(100, {40, 4}, 256);
  spec.shutter.exposure_s = 0.1;
  const Camera camera(spec);
  const Scene scene = right_half(10);
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const std::vector<std::uint16_t> labels{first_model_label};
  const Trajectory path = gliding(looking({0, 0, 0}, ahead), {0, 10, 0});  // 10 px in 0.1 s
  const auto shares = [&](double exposure_s) {
    const ImageF coverage =
        camera.expose(light, path, 0ns, {.seed = {5}}, labels, {}, exposure_s).coverage;
    return std::vector<float>(coverage.values().begin(), coverage.values().begin() + 40);
  };
  const auto blurred = [](const std::vector<float>& row) {
    return std::ranges::count_if(row, [](float share) { return share > 0 && share < 1; });
  };
  const std::vector<float> whole = shares(0.1), quarter = shares(0.025);
  const auto sum = [](const std::vector<float>& row) {
    return std::accumulate(row.begin(), row.end(), 0.0);
  };
  EXPECT_NEAR(sum(whole), sum(quarter), 0.05);  // the edge's mean position, px: 256 paths each
  EXPECT_NEAR(static_cast<double>(blurred(whole)), 10, 1.01);
  EXPECT_NEAR(static_cast<double>(blurred(quarter)), 2.5, 1.51);
}

// A row or a column has pixels of the lattice, too.
TEST(Camera, MetersImagesOfOneRowOrColumn) {
  const Scene scene = scene_of(plane_ground(0, 0, -1000), {});
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const Trajectory path = gliding(looking(here, {1, 0, 1}), {});
  for (const glm::ivec2 size_px : {glm::ivec2(4096, 1), glm::ivec2(1, 4096), glm::ivec2(1, 1)}) {
    const Camera camera(pinhole(1e4, size_px, 1));
    const auto metered = camera.meter(light, path, 0ns, {.seed = {5}});
    EXPECT_GE(metered.size(), size_px == glm::ivec2(1) ? 1u : 2000u);
  }
}

TEST(Camera, MetersTheLightOfALattice) {
  const Scene scene = scene_of(plane_ground(0, 0, -1000), {});
  const PathTracer light(scene, even_sky(), 1, std::nullopt);
  const Camera camera(pinhole(400, {400, 300}, 1));
  const Trajectory path = gliding(looking(here, {1, 0, 1}), {});
  const auto metered = camera.meter(light, path, 0ns, {.seed = {5}});
  EXPECT_GT(metered.size(), 2000u);
  EXPECT_LE(metered.size(), 3300u);
  for (const MeteredPixel& each : metered) {
    EXPECT_EQ(each.radiance, glm::vec3(2, 1, 0.5));
    EXPECT_TRUE(each.pixel.x < 400 && each.pixel.y < 300);
  }
  // The same light whatever the number of threads.
  const Scene edge = right_half(10);
  const PathTracer partly(edge, even_sky(), 1, std::nullopt);
  const auto once = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      return camera.meter(partly, gliding(looking(here, ahead), {}), 0ns, {.seed = {5}});
    });
  };
  const auto one = once(1), four = once(4);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].radiance, four[i].radiance);
}

}  // namespace
}  // namespace groundray::camera_test
