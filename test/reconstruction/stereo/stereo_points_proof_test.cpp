#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/image/luminance.h"
#include "core/tracing/scene.h"
#include "reconstruction/stereo/stereo_points.h"
#include "sensors/camera/camera.h"
#include "sensors/sky/sky.h"
#include "terrain/terrain_scene.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/stereo_views.h"
#include "test/support/terrain/sample_terrain.h"
#include "test/support/wave_texture.h"

namespace groundray::stereo_points_proof_test {
namespace {

using namespace std::chrono_literals;
using testing::centred;
using testing::turned;
using testing::view_of;

// Rough ground in the light of a low sun, which gives it texture, and two cameras above it.
struct Shot {
  std::string name;
  LensModel left, right;
  glm::dvec3 right_turn_deg;
  std::uint64_t seed;
};

Scene rough_ground(const HeightGrid& grid) {
  return Scene{RayTracer({full_resolution_level(grid)}, {0, 0, 0}, Tracing::Fast),
               {.label = 1},
               {{"grey", Lambertian{{{300, 0.4}, {2500, 0.4}}}}}};
}

// Image as from an 8-bit camera, with noise of 1 %.
ImageF picture(const LensModel& lens, glm::ivec2 size_px, const Pose& X_DC, const PathTracer& light,
               std::uint32_t number) {
  CameraSpec spec;
  spec.lens = lens;
  spec.size_px = size_px;
  spec.sampling = {.samples = 16, .most_samples = 16, .depth = 2};
  const Exposure exposure =
      Camera(spec).expose(light, Trajectory({{0s, X_DC}, {1s, X_DC}}), 0s, {Seed{1}, number});
  ImageF grey(size_px.x, size_px.y, 1);
  std::vector<float> lights;
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) {
      const auto rgb = exposure.radiance.at(x, y);
      grey.at(x, y)[0] = static_cast<float>(luminance({rgb[0], rgb[1], rgb[2]}));
    }
  }
  // All images have the same exposure: white is the light of a white surface that faces the sun.
  for (float& value : grey.values()) value = std::pow(std::clamp(value / 40.0F, 0.0F, 1.0F), 0.45F);
  testing::add_noise(grey, 0.01, {number});
  for (float& value : grey.values()) value = std::round(std::clamp(value, 0.0F, 1.0F) * 255) / 255;
  return grey;
}

// Errors divided by their stated standard deviations.
struct Residuals {
  std::vector<double> normalised;
  std::vector<double> by_bias;  // effect of one standard deviation of bias on each
  double outlier_share = 0;
};

constexpr double gross = 5;  // standard deviations: mismatches, which are counted separately

// Residuals of depth, from a ray along each point's line of sight.
Residuals residuals_of(const StereoPoints& points, const PinholePair& pair, const Scene& scene) {
  std::vector<Ray> rays;
  for (const glm::dvec3& p_m : points.p_m)
    rays.push_back({pair.X_DL.translation_m, glm::normalize(p_m - pair.X_DL.translation_m)});
  std::vector<Hit> hits(rays.size());
  scene.trace(rays, hits, Batch::Alike);
  const glm::dvec3 ahead = pair.X_DL.rotation * glm::dvec3(0, 0, 1);
  Residuals residuals;
  std::size_t gross_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double true_m = hits[i].range_m * glm::dot(rays[i].direction, ahead);
    const double off_m = static_cast<double>(points.depth_m[i]) - true_m;
    const double sd_m = points.depth_sd_m[i];
    if (!(std::abs(off_m) <= gross * sd_m)) {
      ++gross_count;
      continue;
    }
    residuals.normalised.push_back(off_m / sd_m);
    residuals.by_bias.push_back(glm::dot(glm::dvec3(points.bias_m[i]), ahead) / sd_m);
  }
  residuals.outlier_share =
      static_cast<double>(gross_count) / std::max<double>(1, static_cast<double>(points.size()));
  return residuals;
}

struct SurfaceResiduals {
  Residuals facing, averted;  // of ground that rises away from the camera, and that falls
};

// Residuals from the tangent plane of the ground where a point's line of sight hits it: along its
// normal n an error of covariance C has the variance n' C n. The square is the smallest Mahalanobis
// distance of the point to the plane, chi^2 with one degree of freedom, and involves all of C. The
// plane is that of rays offset to each side by the possible error of a match's position.
SurfaceResiduals surface_residuals_of(const StereoPoints& points, const PinholePair& pair,
                                      const Scene& scene) {
  const double aside = StereoNoise{}.place_px / pair.focal_px;
  std::vector<Ray> rays;
  for (const glm::dvec3& p_m : points.p_m) {
    const glm::dvec3 p_LQ = inverse(pair.X_DL) * p_m;
    for (const glm::dvec2 off : {glm::dvec2(0), {aside, 0}, {-aside, 0}, {0, aside}, {0, -aside}}) {
      const glm::dvec3 ahead(glm::dvec2(p_LQ) / p_LQ.z + off, 1);
      rays.push_back({pair.X_DL.translation_m, glm::normalize(pair.X_DL.rotation * ahead)});
    }
  }
  std::vector<Hit> hits(rays.size());
  scene.trace(rays, hits, Batch::Alike);
  SurfaceResiduals result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto met = [&](std::size_t k) {
      return rays[5 * i + k].direction * hits[5 * i + k].range_m;
    };
    const glm::dvec3 right = met(1) - met(2), down = met(3) - met(4);
    const glm::dvec3 up = glm::cross(right, -down),
                     off_m = points.p_m[i] - pair.X_DL.translation_m - met(0);
    const double sd = std::sqrt(glm::dot(up, glm::dmat3(points.covariance_m2[i]) * up));
    const glm::dvec2 sight(rays[5 * i].direction);
    Residuals& of = glm::dot(glm::dvec2(up), sight) < 0 ? result.facing : result.averted;
    const double off = glm::dot(up, off_m) / sd;
    if (!(std::abs(off) <= gross)) {
      of.outlier_share += 1;
      continue;
    }
    of.normalised.push_back(off);
    of.by_bias.push_back(glm::dot(glm::dvec3(points.bias_m[i]), up) / sd);
  }
  for (Residuals* of : {&result.facing, &result.averted})
    of->outlier_share /=
        std::max(1.0, of->outlier_share + static_cast<double>(of->normalised.size()));
  return result;
}

// Bias, in standard deviations, that best explains the residuals.
double bias_of(const Residuals& residuals) {
  double common = 0, own = 0;
  for (std::size_t i = 0; i < residuals.normalised.size(); ++i) {
    common += residuals.normalised[i] * residuals.by_bias[i];
    own += residuals.by_bias[i] * residuals.by_bias[i];
  }
  return common / own;
}

double share_within(const Residuals& residuals, double bias, double sds) {
  std::size_t within = 0;
  for (std::size_t i = 0; i < residuals.normalised.size(); ++i)
    within += std::abs(residuals.normalised[i] - bias * residuals.by_bias[i]) <= sds ? 1 : 0;
  return static_cast<double>(within) / static_cast<double>(residuals.normalised.size());
}

double rms(const Residuals& residuals, double bias) {
  double sum = 0;
  for (std::size_t i = 0; i < residuals.normalised.size(); ++i)
    sum += std::pow(residuals.normalised[i] - bias * residuals.by_bias[i], 2);
  return std::sqrt(sum / static_cast<double>(residuals.normalised.size()));
}

std::vector<Shot> shots(glm::ivec2 size_px) {
  const double f_px = 0.75 * size_px.x;
  const BrownConrady brown{{{f_px, f_px}, (glm::dvec2(size_px) - 1.0) / 2.0, 0},
                           {-0.28, 0.075, 0.0002, 0.00002}};
  const KannalaBrandt fisheye{centred(0.5 * size_px.x, size_px), {-0.01, 0.002, 0, 0}};
  return {
      {"pinholes", Pinhole{centred(f_px, size_px)}, Pinhole{centred(f_px, size_px)}, {0, 0, 0}, 3},
      {"distorted, turned", brown, brown, {1, -2, 1.5}, 4},
      {"fisheyes", fisheye, fisheye, {-1, 1, 2}, 5}};
}

struct Measured {
  PinholePair pair;
  StereoPoints points;
};

struct View {
  StereoView camera;
  ImageF picture;
};

// @param bias_px  added to all disparities.
Measured measure(const View& left, const View& right, float bias_px) {
  const PinholePair pair = pinhole_pair(left.camera, right.camera);
  DisparityMap map = match(resample(left.picture, pair, StereoSide::Left, left.camera),
                           resample(right.picture, pair, StereoSide::Right, right.camera));
  for (float& disparity_px : map.disparity_px.values()) disparity_px += bias_px;
  return {pair, stereo_points(pair, left.camera, map)};
}

// Checks the limits of the residuals after removal of a bias.
void expect_stated(const std::string& name, const Residuals& residuals, double bias) {
  // One factor covers cameras that spread their noise over neighbours, by demosaicing or
  // resampling, and those that do not: a mean of two pixels has half of their variance, hence the
  // root of that.
  EXPECT_GT(rms(residuals, bias), 0.7) << name;
  EXPECT_LT(rms(residuals, bias), 1.15) << name;
  EXPECT_GT(share_within(residuals, bias, 1), 0.65) << name;
  EXPECT_GT(share_within(residuals, bias, 2), 0.92) << name;
  testing::record_margin("normalised error", rms(residuals, bias), 1.15);
  testing::record_margin("beyond two sd", 1 - share_within(residuals, bias, 2), 0.08);
}

// Factor by which the stated standard deviations are too small, from squares at two quantiles of
// chi^2: 1 if they are correct, and from 0.7 to 1.15 as expect_stated permits. These limits are
// widened by 3.1 standard errors of a sample's quantile, which is 5 % for all 24 comparisons; of
// two neighbours, whose windows overlap, one counts.
void expect_chi2(const std::string& name, const Residuals& residuals, double bias) {
  struct Quantile {
    double share, chi, density;  // of the root of chi^2 there
  };
  const auto count = static_cast<double>(residuals.normalised.size());
  ASSERT_GT(count, 200) << name;
  EXPECT_LT(residuals.outlier_share, 0.02) << name;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < residuals.normalised.size(); ++i)
    sizes.push_back(std::abs(residuals.normalised[i] - bias * residuals.by_bias[i]));
  std::ranges::sort(sizes);
  for (const Quantile& at : {Quantile{0.05, 0.0627, 0.796}, Quantile{0.95, 1.960, 0.1169}}) {
    const double factor = sizes[static_cast<std::size_t>(at.share * count)] / at.chi;
    const double allowed =
        3.1 * std::sqrt(2 * at.share * (1 - at.share) / count) / (at.density * at.chi);
    EXPECT_LT(factor, 1.15 * (1 + allowed)) << name << " at " << at.share;
    EXPECT_GT(factor, 0.7 * (1 - allowed)) << name << " at " << at.share;
    testing::record_margin("chi at the quantile " + std::to_string(at.share).substr(0, 4), factor,
                           1.15 * (1 + allowed));
    ::testing::Test::RecordProperty(name + " at " + std::to_string(at.share).substr(0, 4),
                                    std::to_string(factor));
  }
}

// Images of the ground by both cameras of a shot.
std::pair<View, View> views_of(const Shot& shot, glm::ivec2 size_px, const HeightGrid& grid,
                               const Scene& scene) {
  const Sky sky({ConstantSky{{3, 4, 5}},
                 SunSpec{SunAngles{.azimuth_deg = 70, .elevation_deg = 20}, SunDisc::Uniform}});
  const PathTracer light(scene, sky, 2, std::nullopt);
  const double half_m = -grid.frame().origin_m.x;
  const glm::dvec2 at(-0.5 * half_m, -0.4 * half_m);
  const glm::dvec3 from(at, grid.height_m_at(at).value() + 0.15 * half_m);
  const Pose X_DL = testing::looking(from, {0, 0, from.z - 0.25 * half_m});
  const Pose X_DR = X_DL * Pose{turned(shot.right_turn_deg), {0.025 * half_m, 0.001 * half_m, 0}};
  return {{view_of(shot.left, size_px, X_DL), picture(shot.left, size_px, X_DL, light, 1)},
          {view_of(shot.right, size_px, X_DR), picture(shot.right, size_px, X_DR, light, 2)}};
}

TEST(StereoPointsProof, StatedErrorsAreCorrectForRenderedPairs) {
  const int width = static_cast<int>(testing::proof_size(320, 960));
  const glm::ivec2 size_px(width, width * 3 / 4);
  const double step_m = 32.0 / width;  // facets of a few pixels
  for (const Shot& shot : shots(size_px)) {
    const HeightGrid grid = testing::fractal(513, step_m, 60 * step_m, Seed{shot.seed});
    const Scene scene = rough_ground(grid);
    const auto [left, right] = views_of(shot, size_px, grid, scene);
    const Measured fair = measure(left, right, 0);
    ASSERT_GT(fair.points.size(), static_cast<std::size_t>(width * width / 200)) << shot.name;
    const Residuals residuals = residuals_of(fair.points, fair.pair, scene);
    EXPECT_LT(residuals.outlier_share, 0.02) << shot.name;
    testing::record_margin("mismatches", residuals.outlier_share, 0.02);
    expect_stated(shot.name, residuals, 0);
    ::testing::Test::RecordProperty(shot.name + ", rms", fmt::format("{:.2f}", rms(residuals, 0)));
    // Pixel-locking and the pair's other common errors, with a stated sd of 0.1 px.
    const double own_bias = bias_of(residuals);
    EXPECT_LT(std::abs(own_bias), 1) << shot.name;
    testing::record_margin("bias", own_bias, 1, "sd");
    const SurfaceResiduals surface = surface_residuals_of(fair.points, fair.pair, scene);
    expect_chi2(shot.name + ", facing", surface.facing, own_bias);
    expect_chi2(shot.name + ", averted", surface.averted, own_bias);

    // A bias of three standard deviations is distinguished from the noise by its pattern alone.
    const Measured biased = measure(left, right, 0.3F);
    const Residuals shifted = residuals_of(biased.points, biased.pair, scene);
    EXPECT_NEAR(std::abs(bias_of(shifted) - own_bias), 3, 0.3) << shot.name;
    expect_stated(shot.name, shifted, bias_of(shifted));
  }
}

}  // namespace
}  // namespace groundray::stereo_points_proof_test
