#include "sensors/camera/image_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/model/displacement.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/solid.h"

namespace groundray::image_truth_test {
namespace {

using namespace std::chrono_literals;
using groundray::testing::board;
using groundray::testing::box_model;
using groundray::testing::centred;
using groundray::testing::first_model_label;
using groundray::testing::gliding;
using groundray::testing::ground_label;
using groundray::testing::icosphere;
using groundray::testing::LensSample;
using groundray::testing::looking;
using groundray::testing::plane_ground;
using groundray::testing::sample_lenses;
using groundray::testing::scene_of;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double float_rounding = 1.2e-7;  // relative; twice the rounding error of a float

const Materials::InColour grey{{{LambertianBsdf{glm::dvec3(0.5)}}}, {glm::vec3(0.5f)}};

CameraSpec pinhole(double focal_px = 100, glm::ivec2 size_px = {64, 48}) {
  return {.lens = Pinhole{centred(focal_px, size_px)}, .size_px = size_px};
}

const glm::dvec3 here(0), ahead(1, 0, 0);

glm::dvec3 point(const ImageTruth& truth, int x, int y) {
  const auto p = truth.p_DQ.at(x, y);
  return {p[0], p[1], p[2]};
}
glm::dvec2 flow(const Flow& of, int x, int y) {
  return {of.offset_px.at(x, y)[0], of.offset_px.at(x, y)[1]};
}

template <typename Act>
void for_each_pixel(const Camera& camera, const Act& act) {
  for (int y = 0; y < camera.spec().size_px.y; ++y) {
    for (int x = 0; x < camera.spec().size_px.x; ++x) act(x, y);
  }
}

// Pixels at which OpenCV images points of C; none if OpenCV does not have the model, or not that
// far off the axis.
std::vector<cv::Point2d> images_by_opencv(const LensModel& model,
                                          const std::vector<cv::Point3d>& points) {
  const cv::Vec3d still(0, 0, 0);
  std::vector<cv::Point2d> images;
  const auto matrix = [](const PixelScale& scale) {
    return cv::Matx33d(scale.focal_px.x, scale.skew * scale.focal_px.x, scale.centre_px.x, 0,
                       scale.focal_px.y, scale.centre_px.y, 0, 0, 1);
  };
  if (const auto* brown = std::get_if<BrownConrady>(&model); brown && brown->scale.skew == 0) {
    cv::projectPoints(points, still, still, matrix(brown->scale),
                      std::vector<double>(brown->k.begin(), brown->k.end()), images);
  }
  const bool is_before = std::ranges::all_of(points, [](const auto& p) { return p.z > 0; });
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model); fisheye && is_before) {
    cv::fisheye::projectPoints(points, images, still, still, matrix(fisheye->scale),
                               cv::Vec4d(fisheye->k.data()));
  }
  return images;
}

// The same by the equations of docs/theory/camera_lens.md, for models that OpenCV does not have.
glm::dvec2 image_by_hand(const Pinhole& model, const glm::dvec3& p) {
  const glm::dvec2 m = glm::dvec2(p) / p.z;
  return {model.scale.focal_px.x * (m.x + model.scale.skew * m.y) + model.scale.centre_px.x,
          model.scale.focal_px.y * m.y + model.scale.centre_px.y};
}
glm::dvec2 image_by_hand(const KannalaBrandt& model, const glm::dvec3& p) {
  const double across = std::hypot(p.x, p.y), t = std::atan2(across, p.z), t2 = t * t;
  const double t_d =
      t * (1 + t2 * (model.k[0] + t2 * (model.k[1] + t2 * (model.k[2] + t2 * model.k[3]))));
  return model.scale.focal_px * (t_d / across * glm::dvec2(p)) + model.scale.centre_px;
}
glm::dvec2 image_by_hand(const Eucm& model, const glm::dvec3& p) {
  const double d = std::sqrt(model.beta * (p.x * p.x + p.y * p.y) + p.z * p.z);
  return model.scale.focal_px * glm::dvec2(p) / (model.alpha * d + (1 - model.alpha) * p.z) +
         model.scale.centre_px;
}
glm::dvec2 image_by_hand(const DoubleSphere& model, const glm::dvec3& p) {
  const double z = model.xi * glm::length(p) + p.z;
  const double d = std::sqrt(p.x * p.x + p.y * p.y + z * z);
  return model.scale.focal_px * glm::dvec2(p) / (model.alpha * d + (1 - model.alpha) * z) +
         model.scale.centre_px;
}
glm::dvec2 image_by_hand(const Equirectangular&, const glm::dvec3& p) {
  constexpr double pi = std::numbers::pi;  // for an image of 240 x 120 px
  return {(std::atan2(p.x, p.z) / (2 * pi) + 0.5) * 240 - 0.5,
          (std::asin(p.y / glm::length(p)) / pi + 0.5) * 120 - 0.5};
}

// Cameras inside a box see nothing but its walls, so positions have one independent oracle and
// their pixels another.
class EveryLensInABox : public ::testing::TestWithParam<LensSample> {};

TEST_P(EveryLensInABox, PositionsLieOnTheWallsAndProjectToTheirPixels) {
  const glm::dvec3 half(10, 8, 6);
  const Scene scene = scene_of(plane_ground(0, 0, -100), {box_model(2.0 * half)}, {{}});
  const Camera camera({.lens = GetParam().model, .size_px = GetParam().size_px});
  const Pose X_DC = looking({1, -2, 0.5}, {2, -1.7, 0.4});
  const ImageTruth truth = image_truth(camera, scene, grey, gliding(X_DC, {}), {});
  std::vector<cv::Point3d> points;
  std::vector<glm::dvec2> pixels;
  for_each_pixel(camera, [&](int x, int y) {
    const bool looks = truth.is_valid.at(x, y)[0] == 1;
    if ((x + 5 * y) % 17 == 0) {
      ASSERT_EQ(camera.lens().ray({x, y}).has_value(), looks);
    }
    if (!looks) {
      EXPECT_EQ(truth.range_m.at(x, y)[0], std::numeric_limits<float>::infinity());
      EXPECT_TRUE(std::isnan(truth.p_DQ.at(x, y)[2]));
      EXPECT_EQ(truth.instance.at(x, y)[0], 0u);
      return;
    }
    const glm::dvec3 p_DQ = point(truth, x, y);
    const glm::dvec3 off = glm::abs(p_DQ) - half;
    ASSERT_NEAR(std::max({off.x, off.y, off.z}), 0, 2e-8);  // ranges: 1e-9 of up to 20 m
    EXPECT_EQ(truth.instance.at(x, y)[0], 1u);
    const glm::dvec3 p_C = inverse(X_DC) * p_DQ;
    EXPECT_NEAR(truth.range_m.at(x, y)[0], glm::length(p_C), float_rounding * 20);
    EXPECT_NEAR(truth.depth_m.at(x, y)[0], p_C.z, float_rounding * 20);
    points.emplace_back(p_C.x, p_C.y, p_C.z);
    pixels.emplace_back(x, y);
  });
  ASSERT_GT(points.size(), 100u);
  // Rays are accurate to 1e-9 px, and positions on them to 4e-15 m of rounding; near the pole of
  // one model its image moves by 1e9 px per radian.
  const double tolerance_px = GetParam().name == "rational 8, pole" ? 1e-4 : 1e-6;
  const auto images = images_by_opencv(GetParam().model, points);
  for (std::size_t i = 0; i < images.size(); ++i) {
    ASSERT_LT(glm::distance(pixels[i], {images[i].x, images[i].y}), tolerance_px);
    testing::record_margin("pixel", glm::distance(pixels[i], {images[i].x, images[i].y}),
                           tolerance_px, "px");
  }
  std::visit(
      [&]<typename Model>(const Model& model) {
        if constexpr (requires { image_by_hand(model, glm::dvec3()); }) {
          for (std::size_t i = 0; i < points.size(); ++i) {
            const glm::dvec3 p_C(points[i].x, points[i].y, points[i].z);
            ASSERT_LT(glm::distance(pixels[i], image_by_hand(model, p_C)), tolerance_px);
            testing::record_margin("pixel", glm::distance(pixels[i], image_by_hand(model, p_C)),
                                   tolerance_px, "px");
          }
        }
      },
      GetParam().model);
}

INSTANTIATE_TEST_SUITE_P(Sample, EveryLensInABox, ::testing::ValuesIn(sample_lenses()),
                         [](const auto& of) {
                           std::string name = of.param.name;
                           std::erase_if(name, [](char c) { return !std::isalnum(c); });
                           return name;
                         });

// Z = d / (n K^-1 (u, v, 1)) for the plane's n and d in C; range = Z |K^-1 (u, v, 1)|.
TEST(ImageTruth, DepthAndRangeOfAPlaneMatchTheClosedForms) {
  const glm::dvec3 n_D = glm::normalize(glm::dvec3(-0.25, 0.125, 1));  // z = x/4 - y/8 - 30
  const Scene scene = scene_of(plane_ground(0.25, -0.125, -30), {});
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const Scene traced = scene_of(plane_ground(0.25, -0.125, -30), {}, {}, {}, tracing);
    const Camera camera(pinhole());
    const Pose X_DC = looking({3, 4, 5}, {6, 5, -3});
    const ImageTruth truth = image_truth(camera, traced, grey, gliding(X_DC, {}), {});
    const glm::dvec3 n_C = glm::conjugate(X_DC.rotation) * n_D;
    const double d_m = glm::dot(n_D, glm::dvec3(0, 0, -30) - X_DC.translation_m);
    for_each_pixel(camera, [&](int x, int y) {
      const glm::dvec3 m((x - 31.5) / 100, (y - 23.5) / 100, 1);
      const double depth_m = d_m / glm::dot(n_C, m), range_m = depth_m * glm::length(m);
      EXPECT_NEAR(truth.depth_m.at(x, y)[0], depth_m, float_rounding * depth_m);
      testing::record_margin("Z of a plane", truth.depth_m.at(x, y)[0] / depth_m - 1,
                             float_rounding);
      EXPECT_NEAR(truth.range_m.at(x, y)[0], range_m, float_rounding * range_m);
      testing::record_margin("its range", truth.range_m.at(x, y)[0] / range_m - 1, float_rounding);
      const auto normal = truth.normal.at(x, y);
      EXPECT_LT(glm::distance(glm::dvec3(normal[0], normal[1], normal[2]), n_D), 1e-6);
      // The arc cosine is ill-conditioned in single precision near 0; the angle itself is not.
      EXPECT_NEAR(truth.incidence_rad.at(x, y)[0], std::acos(-glm::dot(n_C, m) / glm::length(m)),
                  1e-6);
      EXPECT_EQ(truth.label.at(x, y)[0], ground_label);
      EXPECT_EQ(truth.material.at(x, y)[0], 1u);
      EXPECT_EQ(truth.albedo.at(x, y)[0], 0.5f);
    });
  }
}

// Facets lie between the sphere and the smaller concentric one that touches the nearest of them.
TEST(ImageTruth, DepthIsOfTheNearSideOfASphere) {
  const double radius_m = 2;
  const Model ball = icosphere(radius_m, 3);
  double inner_radius_m = radius_m;
  for (const glm::uvec3& t : ball.mesh.triangles) {
    const auto& v = ball.mesh.vertices_m;
    const glm::dvec3 n = glm::normalize(glm::cross(v[t.y] - v[t.x], v[t.z] - v[t.x]));
    inner_radius_m = std::min(inner_radius_m, std::abs(glm::dot(n, v[t.x])));
  }
  ASSERT_GT(inner_radius_m, 1.98);
  const glm::dvec3 centre(12, 0.5, -0.25);
  const Scene scene = scene_of(plane_ground(0, 0, -100), {ball}, {{.p_DO = centre}});
  const Camera camera(pinhole());
  const ImageTruth truth = image_truth(camera, scene, grey, gliding(looking(here, ahead), {}), {});
  int seen = 0;
  for_each_pixel(camera, [&](int x, int y) {
    const glm::dvec3 d = glm::normalize(glm::dvec3(1, (31.5 - x) / 100, (23.5 - y) / 100));
    // The smaller root of |t d - c| = r, for the spheres that circumscribe and inscribe the facets.
    const auto root = [&](double r) {
      const double along = glm::dot(d, centre);
      return along - std::sqrt(along * along - glm::dot(centre, centre) + r * r);
    };
    const double inner_m = root(inner_radius_m), outer_m = root(radius_m);
    if (std::isnan(outer_m)) {
      EXPECT_EQ(truth.instance.at(x, y)[0], 0u);
    }
    if (std::isnan(inner_m)) return;  // between the two spheres, the facets decide
    ++seen;
    EXPECT_EQ(truth.instance.at(x, y)[0], 1u);
    EXPECT_LE(truth.range_m.at(x, y)[0], inner_m * (1 + float_rounding));
    EXPECT_GE(truth.range_m.at(x, y)[0], outer_m * (1 - float_rounding));
  });
  EXPECT_GT(seen, 500);
}

// A rotated box; its slab intersection decides whether sky is seen, and which object otherwise.
TEST(ImageTruth, IdsAreOfTheVisibleObject) {
  const glm::dquat turned = glm::angleAxis(0.6, glm::normalize(glm::dvec3(1, 2, 3)));
  const glm::dvec3 half(1, 2, 1.5);
  const std::vector<PlacedObject> boxes{
      {.p_DO = {12, 1, 0}, .R_DO = turned},
      {.p_DO = {20, -2, 1}, .R_DO = turned, .scale = 1.5, .model = 1}};
  const Scene scene =
      scene_of(plane_ground(0, 0, -4), {box_model(2.0 * half), box_model(2.0 * half)}, boxes);
  const Camera camera(pinhole());
  const ImageTruth truth = image_truth(camera, scene, grey, gliding(looking(here, ahead), {}), {});
  std::set<std::uint32_t> seen;
  for_each_pixel(camera, [&](int x, int y) {
    const glm::dvec3 d = glm::normalize(glm::dvec3(1, (31.5 - x) / 100, (23.5 - y) / 100));
    double range_m = d.z < 0 ? -4 / d.z : std::numeric_limits<double>::infinity();
    std::uint32_t instance = 0;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
      const glm::dvec3 o = glm::conjugate(boxes[i].R_DO) * -boxes[i].p_DO;
      const glm::dvec3 along = glm::conjugate(boxes[i].R_DO) * d;
      const glm::dvec3 a = (-half * boxes[i].scale - o) / along;
      const glm::dvec3 b = (half * boxes[i].scale - o) / along;
      const glm::dvec3 low = glm::min(a, b), high = glm::max(a, b);
      const double in_m = std::max({low.x, low.y, low.z});
      if (in_m > std::min({high.x, high.y, high.z}) || in_m > range_m) continue;
      range_m = in_m;
      instance = i + 1;
    }
    const bool is_sky = std::isinf(range_m);
    const std::uint32_t label = is_sky     ? 0
                                : instance ? first_model_label + instance - 1
                                           : ground_label;
    EXPECT_EQ(truth.instance.at(x, y)[0], instance);
    EXPECT_EQ(truth.label.at(x, y)[0], label);
    EXPECT_EQ(truth.material.at(x, y)[0], is_sky ? 0u : 1u);
    EXPECT_EQ(truth.is_valid.at(x, y)[0], 1);
    if (is_sky)
      EXPECT_TRUE(std::isinf(truth.range_m.at(x, y)[0]));
    else
      EXPECT_NEAR(truth.range_m.at(x, y)[0], range_m, float_rounding * range_m);
    seen.insert(truth.label.at(x, y)[0]);
  });
  EXPECT_EQ(seen, (std::set<std::uint32_t>{0, ground_label, 10, 11}));
}

TEST(ImageTruth, BumpsKeepPositionsAndDisplacementMovesThem) {
  const Camera camera(pinhole());
  const auto truth_of = [&](Model model) {
    const Scene scene =
        scene_of(plane_ground(0, 0, -100), {std::move(model)},
                 {{.p_DO = {10, 0, 0}, .R_DO = {0, 0, 0, 1}}});  // facing the camera
    return image_truth(camera, scene, grey, gliding(looking(here, ahead), {}), {});
  };
  Model bumpy = board(2);
  bumpy.surfaces[0].normal.pixels = Image8(1, 1, 3);
  std::ranges::copy(std::initializer_list<std::uint8_t>{200, 90, 220},
                    bumpy.surfaces[0].normal.pixels.values().begin());
  ImageF white(1, 1, 1);
  white.at(0, 0)[0] = 1;
  const ImageTruth plain = truth_of(board(2)), bumped = truth_of(std::move(bumpy));
  const ImageTruth moved = truth_of(displaced(board(2), {white, 0.5, 0.5, 1}));
  for_each_pixel(camera, [&](int x, int y) {
    EXPECT_EQ(plain.depth_m.at(x, y)[0], bumped.depth_m.at(x, y)[0]);
    EXPECT_TRUE(std::ranges::equal(plain.normal.at(x, y), bumped.normal.at(x, y)) ||
                plain.instance.at(x, y)[0] == 0);
    if (plain.instance.at(x, y)[0] == 0) return;
    EXPECT_NEAR(plain.depth_m.at(x, y)[0], 10, 1e-6);
    EXPECT_NEAR(moved.depth_m.at(x, y)[0], 9.75,
                1e-6);  // displaced by 0.5 (1 - 0.5) towards its front
    EXPECT_GT(std::abs(bumped.shading_normal.at(x, y)[1]), 0.1f);
    EXPECT_EQ(plain.shading_normal.at(x, y)[0], -1);
  });
}

// Two texels side by side, repeated, linear between their centres: the albedo is the material's,
// times the ratio of the texture to its mean, and at most 1.
TEST(ImageTruth, AlbedosVaryWithTheTexture) {
  Model model = board(2);
  Image8 texels(2, 1, 1);
  texels.at(0, 0)[0] = 64;
  texels.at(1, 0)[0] = 255;
  model.surfaces[0].albedo.pixels = std::move(texels);
  const double dark = std::pow((64 / 255.0 + 0.055) / 1.055, 2.4);  // IEC 61966-2-1
  const double mean = (dark + 1) / 2;
  const Scene scene =
      scene_of(plane_ground(0, 0, -100), {std::move(model)}, {{.p_DO = {10, 0, 0}}});
  const Camera camera(pinhole());
  const glm::dvec3 of_material(0.5, 0.25, 0.9);
  const Materials::InColour materials{{{LambertianBsdf{of_material}}}, {glm::vec3(of_material)}};
  const ImageTruth truth =
      image_truth(camera, scene, materials, gliding(looking(here, ahead), {}), {});
  int checked = 0;
  for_each_pixel(camera, [&](int x, int y) {
    if (truth.instance.at(x, y)[0] == 0) return;
    const double u = (point(truth, x, y).y + 2) / 4;  // the bright texel's centre is at 3/4
    const double bright = 1 - std::abs((u < 0.25 ? u + 1 : u) - 0.75) / 0.5;
    const double texel = dark + bright * (1 - dark);
    for (int k = 0; k < 3; ++k) {
      const double albedo = std::min(of_material[k] * texel / mean, 1.0);
      EXPECT_NEAR(truth.albedo.at(x, y)[static_cast<std::size_t>(k)], albedo, 1e-5);
    }
    ++checked;
  });
  EXPECT_GT(checked, 300);
}

// Points x of the plane n x = d move by x' = R x + t = (R + t n^T / d) x: a homography of rays, and
// of pixels after the lens.
TEST(ImageTruthFlow, OfAPlaneIsAHomographyThroughAnyDistortion) {
  const Scene scene = scene_of(plane_ground(0.25, -0.125, -8), {});
  const PixelScale scale = centred(100, {64, 48});
  const std::array<double, 14> k{-0.3, 0.12, 1e-3, -5e-4, -0.02, 0.01,  0.02,
                                 0,    1e-3, 5e-4, -1e-3, 2e-4,  0.035, -0.052};
  const Camera camera({.lens = BrownConrady{scale, k}, .size_px = {64, 48}});
  const Pose first = looking({0, 0, 0}, {3, 0.5, -3});
  const Pose second = looking({0.5, -0.3, 0.2}, {3.6, 0, -2.9});
  const Trajectory path({{-1s, first}, {0s, first}, {1s, second}, {2s, second}});
  // The middles of the exposures, 2.5 ms after their start, fall where the camera is at rest.
  const TruthRequest request{.begin = -500ms, .before = 1500ms, .after = 1100ms};
  const ImageTruth truth = image_truth(camera, scene, grey, path, request);
  const glm::dvec3 n_D = glm::normalize(glm::dvec3(-0.25, 0.125, 1));
  const glm::dvec3 n = glm::conjugate(first.rotation) * n_D;
  const double d_m = glm::dot(n_D, glm::dvec3(0, 0, -8) - first.translation_m);
  const Pose moved = inverse(second) * first;
  const glm::dmat3 homography =
      glm::mat3_cast(moved.rotation) + glm::outerProduct(moved.translation_m, n) / d_m;
  int inside = 0;
  for_each_pixel(camera, [&](int x, int y) {
    const glm::dvec3 ray = homography * camera.lens().ray({x, y})->direction;
    std::vector<cv::Point2d> image;
    cv::projectPoints(std::vector<cv::Point3d>{{ray.x, ray.y, ray.z}}, cv::Vec3d(0, 0, 0),
                      cv::Vec3d(0, 0, 0),
                      cv::Matx33d(100, 0, scale.centre_px.x, 0, 100, scale.centre_px.y, 0, 0, 1),
                      std::vector<double>(k.begin(), k.end()), image);
    const glm::dvec2 to(image[0].x, image[0].y);
    // Offsets are floats of about 10 px.
    EXPECT_LT(glm::distance(flow(truth.forward, x, y), to - glm::dvec2(x, y)), 1e-5);
    EXPECT_LT(glm::distance(flow(truth.backward, x, y), to - glm::dvec2(x, y)), 1e-5);
    testing::record_margin("flow of a plane",
                           glm::distance(flow(truth.forward, x, y), to - glm::dvec2(x, y)), 1e-5,
                           "px");
    const bool is_inside = -0.5 <= to.x && to.x < 63.5 && -0.5 <= to.y && to.y < 47.5;
    EXPECT_EQ(truth.forward.is_seen.at(x, y)[0], is_inside ? 1 : 0);
    inside += is_inside;
  });
  EXPECT_GT(inside, 1000);
  EXPECT_LT(inside, 64 * 48);
}

// A board 5 m ahead, in front of a wall at 20 m, from two positions side by side: by similar
// triangles.
TEST(ImageTruthFlow, ReportsOcclusionByABoardInFront) {
  const Scene scene = scene_of(plane_ground(0, 0, -100), {board(1), board(50)},
                               {{.p_DO = {5, 0, 0}}, {.p_DO = {20, 0, 0}, .model = 1}});
  const Camera camera(pinhole(60));
  const Trajectory path = gliding(looking(here, ahead), {0, 0.7, 0});
  const ImageTruth truth = image_truth(camera, scene, grey, path, {.after = 1s});
  int hidden = 0;
  for_each_pixel(camera, [&](int x, int y) {
    const glm::dvec3 p = point(truth, x, y);
    const double near_m = p.x;
    const double du = 60 * 0.7 / near_m;  // to the right, because the camera moves to the left
    EXPECT_NEAR(flow(truth.forward, x, y).x, du, 1e-5);
    testing::record_margin("of a board", flow(truth.forward, x, y).x - du, 1e-5, "px");
    EXPECT_NEAR(flow(truth.forward, x, y).y, 0, 1e-5);
    const double eye_m = 0.7 + 0.7 * 0.0025;  // in the middle of the exposure
    const double at_y = eye_m + (p.y - eye_m) / 4, at_z = p.z / 4;
    const bool is_hidden = near_m > 10 && std::abs(at_y) < 1 && std::abs(at_z) < 1;
    const bool is_inside = x + du < 63.5;
    EXPECT_EQ(truth.forward.is_seen.at(x, y)[0], is_inside && !is_hidden ? 1 : 0) << x << ' ' << y;
    hidden += is_hidden;
  });
  EXPECT_GT(hidden, 100);
}

// A board that turns about the optical axis while it moves sideways.
TEST(ImageTruthFlow, FollowsMovingObjects) {
  const glm::dvec3 going(0, -1, 0.5);
  const double turning_rad_s = 0.4;
  std::vector<Trajectory::Sample> samples;
  for (int i = -10; i <= 20; ++i) {
    const double t = 0.1 * i;
    samples.push_back({i * 100ms,
                       {glm::angleAxis(turning_rad_s * t, glm::dvec3(1, 0, 0)),
                        glm::dvec3(10, 0, 0) + going * t}});
  }
  const Scene scene =
      scene_of(plane_ground(0, 0, -100), {board(1)}, {}, {{.X_DO = Trajectory(samples)}});
  CameraSpec spec = pinhole();
  spec.shutter.exposure_s = 2e-9;  // 1 ns
  const Camera camera(spec);
  const ImageTruth truth = image_truth(camera, scene, grey, gliding(looking(here, ahead), {}),
                                       {.before = -500ms, .after = 500ms});
  int on = 0, covered = 0;
  for_each_pixel(camera, [&](int x, int y) {
    const glm::dvec3 p = point(truth, x, y);
    if (truth.instance.at(x, y)[0] == 0) {
      if (!std::isinf(truth.range_m.at(x, y)[0])) return;
      // The sky is static, and is occluded where the board will be at that time.
      EXPECT_LT(glm::length(flow(truth.forward, x, y)), 1e-5);
      const glm::dvec3 at(10, (31.5 - x) / 10, (23.5 - y) / 10);
      const glm::dvec3 p_O = glm::angleAxis(-turning_rad_s * 0.5, glm::dvec3(1, 0, 0)) *
                             (at - glm::dvec3(10, 0, 0) - going * 0.5);
      const bool is_hidden = std::max(std::abs(p_O.y), std::abs(p_O.z)) < 1;
      EXPECT_EQ(truth.forward.is_seen.at(x, y)[0], is_hidden ? 0 : 1);
      covered += is_hidden;
      return;
    }
    ++on;
    const glm::dvec3 velocity =
        going + turning_rad_s * glm::cross(glm::dvec3(1, 0, 0), p - glm::dvec3(10, 0, 0));
    const auto reported = truth.velocity_m_s.at(x, y);
    // Between poses 0.1 s apart the path is an arc of 0.04 rad; at its start the direction differs
    // from the chord by half of that.
    EXPECT_LT(glm::distance(glm::dvec3(reported[0], reported[1], reported[2]), velocity),
              0.021 * glm::length(going));
    for (const auto& [of, t] : {std::pair(&truth.forward, 0.5), {&truth.backward, -0.5}}) {
      const glm::dvec3 then =
          glm::dvec3(10, 0, 0) + going * t +
          glm::angleAxis(turning_rad_s * t, glm::dvec3(1, 0, 0)) * (p - glm::dvec3(10, 0, 0));
      const glm::dvec2 to(31.5 - 100 * then.y / then.x, 23.5 - 100 * then.z / then.x);
      EXPECT_LT(glm::distance(flow(*of, x, y), to - glm::dvec2(x, y)), 1e-5);
      testing::record_margin("of what moves", glm::distance(flow(*of, x, y), to - glm::dvec2(x, y)),
                             1e-5, "px");
    }
  });
  EXPECT_GT(on, 300);
  EXPECT_GT(covered, 20);
}

// A wall at Z, seen from a camera that moves at v: row r is exposed at t = r t_row, so that an
// upright edge leans by f v t_row / Z px per row, and not at all with a global shutter.
TEST(ImageTruth, RollingShutterSkewMatchesTheClosedForm) {
  const Scene scene = scene_of(plane_ground(0, 0, -100), {board(50)}, {{.p_DO = {10, 0, 0}}});
  const double speed_m_s = 8;
  for (const double row_s : {0.0, 1e-4, 2e-3}) {
    CameraSpec spec = pinhole();
    spec.shutter = {.exposure_s = 0.004, .row_s = row_s};
    const Camera camera(spec);
    const Trajectory path = gliding(looking(here, ahead), {0, -speed_m_s, 0});  // to the right
    const ImageTruth truth = image_truth(camera, scene, grey, path, {});
    for_each_pixel(camera, [&](int x, int y) {
      // Pixel of the point from the camera's initial position.
      const glm::dvec3 p = point(truth, x, y);
      const double still_px = 31.5 - 100 * p.y / p.x;
      const double lean_px = 100 * speed_m_s * (row_s * y + 0.002) / 10;
      EXPECT_NEAR(still_px - x, lean_px, 1e-6);  // times are whole nanoseconds: 8e-8 px
    });
  }
}

// For motion along the columns the row, and with it the time of exposure, changes: r' = r + k (T +
// (r' - r) t_row), k in rows per second, so r' - r = k T / (1 - k t_row).
TEST(ImageTruthFlow, SolvesForTheExposedRow) {
  const Scene scene = scene_of(plane_ground(0, 0, -100), {board(50)}, {{.p_DO = {10, 0, 0}}});
  for (const double speed_m_s : {-3.0, 3.0, 20.0}) {
    CameraSpec spec = pinhole();
    spec.shutter.row_s = 1e-3;
    const Camera camera(spec);
    const Trajectory path = gliding(looking(here, ahead), {0, 0, speed_m_s});
    const ImageTruth truth = image_truth(camera, scene, grey, path, {.after = 50ms});
    const double k = 100 * speed_m_s / 10, rows = k * 0.05 / (1 - k * 1e-3);
    for_each_pixel(camera, [&](int x, int y) {
      if (y + rows < 0 || y + rows > 47)
        return;  // rows outside the image take the time of the last row
      EXPECT_NEAR(flow(truth.forward, x, y).x, 0, 1e-5);
      EXPECT_NEAR(flow(truth.forward, x, y).y, rows, 1e-5);
      testing::record_margin("to rows of a rolling shutter", flow(truth.forward, x, y).y - rows,
                             1e-5, "px");
    });
  }
}

// The ground's facets at full resolution are the reference: the bound is the accuracy of ranges.
TEST(ImageTruth, ReportsBoundsOnRequest) {
  const Scene scene = scene_of(plane_ground(0, 0, -4), {board(1)}, {{.p_DO = {10, 0, 0}}});
  const Camera camera(pinhole());
  const Trajectory path = gliding(looking(here, ahead), {});
  EXPECT_EQ(image_truth(camera, scene, grey, path, {}).bound_m.width(), 0);
  const ImageTruth truth = image_truth(camera, scene, grey, path, {.bounds = true});
  for (std::size_t i = 0; i < truth.bound_m.values().size(); ++i) {
    if (!std::isfinite(truth.range_m.values()[i])) continue;
    const double accuracy_m = 1e-9 * double{truth.range_m.values()[i]} + 1e-9;
    EXPECT_NEAR(double{truth.bound_m.values()[i]}, accuracy_m, accuracy_m);
  }
}

void expect_same(const ImageTruth& a, const ImageTruth& b) {
  const auto same = [](const auto& one, const auto& other) {
    return std::ranges::equal(std::as_bytes(one.values()), std::as_bytes(other.values()));
  };
  EXPECT_TRUE(same(a.is_valid, b.is_valid));
  EXPECT_TRUE(same(a.range_m, b.range_m));
  EXPECT_TRUE(same(a.depth_m, b.depth_m));
  EXPECT_TRUE(same(a.p_DQ, b.p_DQ));
  EXPECT_TRUE(same(a.normal, b.normal));
  EXPECT_TRUE(same(a.shading_normal, b.shading_normal));
  EXPECT_TRUE(same(a.albedo, b.albedo));
  EXPECT_TRUE(same(a.incidence_rad, b.incidence_rad));
  EXPECT_TRUE(same(a.velocity_m_s, b.velocity_m_s));
  EXPECT_TRUE(same(a.bound_m, b.bound_m));
  EXPECT_TRUE(same(a.label, b.label));
  EXPECT_TRUE(same(a.instance, b.instance));
  EXPECT_TRUE(same(a.material, b.material));
  for (const auto& [one, other] : {std::pair(&a.forward, &b.forward), {&a.backward, &b.backward}}) {
    EXPECT_TRUE(same(one->offset_px, other->offset_px));
    EXPECT_TRUE(same(one->is_seen, other->is_seen));
  }
}

TEST(ImageTruth, IsTheSameOnAnyNumberOfThreadsAndInReusedMemory) {
  const Scene scene = scene_of(plane_ground(0.125, 0, -4), {icosphere(2, 2)},
                               {{.p_DO = {10, 0, 0}}, {.p_DO = {14, 3, 1}}});
  CameraSpec spec{.lens = sample_lenses()[14].model, .size_px = sample_lenses()[14].size_px};
  spec.shutter.row_s = 1e-4;
  const Camera camera(spec);
  const Trajectory path = gliding(looking(here, ahead), {3, 1, 0.2});
  const TruthRequest request{.before = -100ms, .after = 100ms, .bounds = true};
  ImageTruth first = image_truth(camera, scene, grey, path, request);
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena(threads).execute(
        [&] { expect_same(image_truth(Camera(spec), scene, grey, path, request), first); });
  }
  ImageTruth other = image_truth(camera, scene, grey, path, {.begin = 300ms});
  expect_same(image_truth(camera, scene, grey, path, request, std::move(other)), first);
}

TEST(ImageTruth, RequiresATrajectoryAndAlbedos) {
  const Scene scene = scene_of(plane_ground(0, 0, -4), {});
  const Camera camera(pinhole());
  const Trajectory path = gliding(looking(here, ahead), {});
  EXPECT_THAT([&] { image_truth(camera, scene, grey, path, {.after = 1996ms}); },
              ThrowsMessage<Error>(HasSubstr(
                  "an image is exposed from 1.996000 s to 2.001000 s but the camera's trajectory "
                  "covers [-1.000000, 2.000000] s")));
  EXPECT_THAT(
      [&] { image_truth(camera, scene, {}, path, {}); },
      ThrowsMessage<Error>(HasSubstr("the scene uses material 0, but there are 0 albedos")));
}

}  // namespace
}  // namespace groundray::image_truth_test
