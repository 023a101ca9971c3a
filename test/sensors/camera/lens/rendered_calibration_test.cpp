// Rendered chessboards: OpenCV predicts the positions of their corners, and recovers the lenses.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>
#include <vector>

#include "sensors/camera/camera.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"

namespace groundray::rendered_calibration_test {
namespace {

using namespace std::chrono_literals;

// A chessboard in the plane z = 0 of O, centred at the origin. Only the black squares exist; the
// bright sky behind them supplies the white.
struct Board {
  int columns = 5, rows = 5;
  double side_m = 0.125;

  // Common corner of four squares; 0 < i < columns, 0 < j < rows.
  glm::dvec3 corner(int i, int j) const {
    return side_m * glm::dvec3(i - columns / 2.0, j - rows / 2.0, 0);
  }
  Model model() const {
    Model made;
    made.surfaces = {{.name = "black"}};
    for (int j = 0; j < rows; ++j) {
      for (int i = j % 2; i < columns; i += 2) {
        const auto first = static_cast<glm::uint>(made.mesh.vertices_m.size());
        for (const auto& [x, y] : {std::pair(i, j), {i + 1, j}, {i + 1, j + 1}, {i, j + 1}})
          made.mesh.vertices_m.push_back(corner(x, y));
        made.mesh.triangles.emplace_back(first, first + 1, first + 2);
        made.mesh.triangles.emplace_back(first, first + 2, first + 3);
      }
    }
    made.surface_of.assign(made.mesh.triangles.size(), 0);
    return made;
  }
};

// C is D: the camera looks up, and the ground, also black, is behind it.
ImageF picture(const Board& board, const Pose& X_CO, const CameraSpec& spec) {
  const RayDevice device;
  const HeightGrid ground({2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, -1000));
  const Material black{"black", Lambertian{{{300, 0}, {2500, 0}}}};
  const Scene scene{RayTracer({full_resolution_level(ground)}, {0, 0, 0}, Tracing::Exact),
                    {.label = 1},
                    {black},
                    {device,
                     {ModelScene(device, board.model(), Tracing::Exact)},
                     {{.p_DO = X_CO.translation_m, .R_DO = X_CO.rotation}},
                     {}},
                    {{2, {0}}}};
  const Sky sky({ConstantSky{glm::dvec3(1)}});
  const PathTracer light(scene, sky, 1, std::nullopt);
  const Trajectory still({{0s, {}}, {1s, {}}});
  return Camera(spec).expose(light, still, 0s, {Seed{6}}).radiance;
}

// Pixels of one colour need few paths. Pixels that contain less of the other colour than one path
// represents are classified as uniform: that moves edges by less than half of that fraction.
CameraSpec camera_of(LensModel lens, glm::ivec2 size_px, int samples, int most_samples) {
  CameraSpec spec;
  spec.lens = std::move(lens);
  spec.size_px = size_px;
  spec.sampling = {.samples = samples, .most_samples = most_samples, .relative_error = 1e-6};
  return spec;
}

// Least-squares parabola y = a + b x + c x^2 through points.
glm::dvec3 parabola(const std::vector<glm::dvec2>& points) {
  glm::dmat3 normal(0);
  glm::dvec3 right(0);
  for (const glm::dvec2& p : points) {
    const glm::dvec3 powers(1, p.x, p.x * p.x);
    normal += glm::outerProduct(powers, powers);
    right += p.y * powers;
  }
  return glm::inverse(normal) * right;
}

// Finds corners in a picture of 0 and 1. Pixels are means over squares, so the sum along a row
// gives exactly the position at which an edge crosses it, averaged over the row's height. Parabolas
// through such positions on both edges, on both sides of the corner but away from it, intersect in
// the corner.
class CornerFinder {
 public:
  explicit CornerFinder(const ImageF& picture) : picture_(picture) {}

  // `near` is within a pixel of the corner; `across` and `along` point to the next corners.
  glm::dvec2 find(const glm::dvec2& near, const glm::dvec2& across, const glm::dvec2& along) const {
    const glm::ivec2 at = glm::round(near);
    const bool is_upright = std::abs(along.y) > std::abs(along.x);
    const glm::dvec2 &down = is_upright ? along : across, &right = is_upright ? across : along;
    const int far_down = farthest(at, down), far_right = farthest(at, right);
    const glm::dvec3 x_of_y = edge(at, 0, down.x / down.y, far_down);
    const glm::dvec3 y_of_x = edge(at, 1, right.y / right.x, far_right);
    glm::dvec2 p(0);
    for (int step = 0; step < 20; ++step) {
      p.x = x_of_y[0] + p.y * (x_of_y[1] + p.y * x_of_y[2]);
      p.y = y_of_x[0] + p.x * (y_of_x[1] + p.x * y_of_x[2]);
    }
    return glm::dvec2(at) + p;
  }

 private:
  static constexpr int nearest = 3;  // steps along an edge from the corner
  static constexpr int reach = 3;    // to either side of the edge, px

  // Less than half of the distance to the next corner.
  int farthest(const glm::ivec2& at, const glm::dvec2& next) const {
    const int steps = static_cast<int>(0.42 * glm::length(next));
    const glm::ivec2 rim = glm::ivec2(picture_.width(), picture_.height()) - 1 - at;
    EXPECT_GT(steps, nearest);
    EXPECT_GE(std::min({at.x, at.y, rim.x, rim.y}), steps + reach) << "too near the rim";
    return steps;
  }
  double value(const glm::ivec2& at, int axis, int offset, int step) const {
    glm::ivec2 pixel = at;
    pixel[axis] += offset;
    pixel[1 - axis] += step;
    return double{picture_.at(pixel.x, pixel.y)[0]};
  }
  // Offset along `axis` of the edge that crosses it, as a function of the step along the other
  // axis.
  glm::dvec3 edge(const glm::ivec2& at, int axis, double slope, int farthest) const {
    std::vector<glm::dvec2> places;
    for (int step = -farthest; step <= farthest; ++step) {
      if (std::abs(step) < nearest) continue;
      const int middle = static_cast<int>(std::lround(slope * step));
      double sum = 0;
      for (int i = middle - reach; i <= middle + reach; ++i) sum += value(at, axis, i, step);
      const bool is_dark_first =
          value(at, axis, middle - reach, step) < value(at, axis, middle + reach, step);
      const double place = is_dark_first ? middle + reach + 0.5 - sum : middle - reach - 0.5 + sum;
      places.emplace_back(step, place);
    }
    return parabola(places);
  }

  const ImageF& picture_;
};

// A board in a given direction from the camera: turned to face it, then about its own axes.
Pose facing(const glm::dvec2& direction_deg, double distance_m, const glm::dvec3& turn_deg) {
  const glm::dvec2 direction = glm::radians(direction_deg);
  const glm::dquat towards = glm::angleAxis(direction.x, glm::dvec3(0, 1, 0)) *
                             glm::angleAxis(-direction.y, glm::dvec3(1, 0, 0));
  return {towards * glm::dquat(glm::radians(turn_deg)), towards * glm::dvec3(0, 0, distance_m)};
}

struct Corners {
  std::vector<cv::Point3d> on_board;
  std::vector<cv::Point2d> in_picture;
};

Corners corners_of(const Board& board, const Pose& X_CO, const CameraSpec& camera) {
  const Lens lens(camera.lens, camera.size_px);
  const ImageF image = picture(board, X_CO, camera);
  const CornerFinder finder(image);
  const auto about = [&](int i, int j) { return lens.project(X_CO * board.corner(i, j)).value(); };
  Corners corners;
  for (int j = 1; j < board.rows; ++j) {
    for (int i = 1; i < board.columns; ++i) {
      const glm::dvec2 near = about(i, j);
      const glm::dvec2 found = finder.find(near, about(i + 1, j) - near, about(i, j + 1) - near);
      const glm::dvec3 p = board.corner(i, j);
      corners.on_board.emplace_back(p.x, p.y, p.z);
      corners.in_picture.emplace_back(found.x, found.y);
    }
  }
  return corners;
}

cv::Matx33d matrix_of(const PixelScale& s) {
  return {s.focal_px.x, 0, s.centre_px.x, 0, s.focal_px.y, s.centre_px.y, 0, 0, 1};
}
cv::Vec3d rodrigues(const glm::dquat& q) {
  const glm::dvec3 v = glm::angle(q) * glm::axis(q);
  return {v.x, v.y, v.z};
}
cv::Vec3d vector_of(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

// Pixels are means of 1024 stratified paths: corners are located to about 2e-3 px.
constexpr double found_px = 0.01;
constexpr glm::ivec2 small_px{120, 104};
const PixelScale scale{{180.5, 178}, {58.25, 51.5}, 0};

void expect_found(const char* by, const std::vector<cv::Point2d>& found,
                  const std::vector<cv::Point2d>& said) {
  ASSERT_EQ(found.size(), said.size());
  double most = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    most = std::max(most, cv::norm(found[i] - said[i]));
  EXPECT_LT(most, found_px);
  testing::record_margin(fmt::format("corners by {}", by), most, found_px, "px");
}

CameraSpec fine(LensModel lens) { return camera_of(std::move(lens), small_px, 256, 1024); }

TEST(RenderedChessboard, CornersMatchProjectPoints) {
  const std::array<double, 14> k{-0.28, 0.09, 1e-3, -2e-3, -0.01, 0.05, 0.01,
                                 0.002, 2e-3, 1e-3, -1e-3, 2e-3,  0.02, -0.03};
  const LensModel lens = BrownConrady{scale, k, sensor_homography(k[12], k[13])};
  const Pose X_CO = facing({3, -2}, 1.2, {20, -25, 15});
  const Corners corners = corners_of({}, X_CO, fine(lens));
  std::vector<cv::Point2d> said;
  cv::projectPoints(corners.on_board, rodrigues(X_CO.rotation), vector_of(X_CO.translation_m),
                    matrix_of(scale), std::vector<double>(k.begin(), k.end()), said);
  expect_found("projectPoints", corners.in_picture, said);
}

TEST(RenderedChessboard, CornersMatchFisheye) {
  const std::array<double, 4> k{-0.012, 0.02, -0.012, 0.002};
  const PixelScale wide{{70, 70.5}, {12.25, 51.5}, 0};
  const Pose X_CO = facing({40, 3}, 0.57, {-15, 20, 10});
  const Corners corners = corners_of({}, X_CO, fine(KannalaBrandt{wide, k}));
  std::vector<cv::Point2d> said;
  cv::fisheye::projectPoints(corners.on_board, said, rodrigues(X_CO.rotation),
                             vector_of(X_CO.translation_m), matrix_of(wide), cv::Vec4d(k.data()));
  expect_found("fisheye", corners.in_picture, said);
}

TEST(RenderedChessboard, CornersMatchOmnidir) {
  const Mei lens{{{220, 222}, {38.25, 61.5}, 0}, 0.9, {-0.2, 0.05, 1e-3, -1e-3}};
  const Pose X_CO = facing({13, -5}, 0.75, {20, -25, -10});
  const Corners corners = corners_of({}, X_CO, fine(lens));
  std::vector<cv::Point2d> said;
  cv::omnidir::projectPoints(corners.on_board, said, rodrigues(X_CO.rotation),
                             vector_of(X_CO.translation_m), matrix_of(lens.scale), lens.xi,
                             cv::Vec4d(lens.k.data()));
  expect_found("omnidir", corners.in_picture, said);
}

// Beyond 90 degrees, which OpenCV does not support: an equidistant lens images at f theta.
TEST(RenderedChessboard, CornersMatchAFisheyeOf190Degrees) {
  const double f = 65;
  const glm::dvec2 c(-30, 51.5);
  const Pose X_CO = facing({80, 0}, 0.5, {0, 0, 5});
  const Corners corners = corners_of({}, X_CO, fine(KannalaBrandt{{{f, f}, c, 0}, {}}));
  std::vector<cv::Point2d> said;
  double widest_deg = 0;
  for (const cv::Point3d& p_O : corners.on_board) {
    const glm::dvec3 p = X_CO * glm::dvec3(p_O.x, p_O.y, p_O.z);
    const double theta = std::atan2(std::hypot(p.x, p.y), p.z), azimuth = std::atan2(p.y, p.x);
    said.emplace_back(c.x + f * theta * std::cos(azimuth), c.y + f * theta * std::sin(azimuth));
    widest_deg = std::max(widest_deg, glm::degrees(theta));
  }
  expect_found("equidistant", corners.in_picture, said);
  EXPECT_GT(widest_deg, 95);
}

// Twelve boards all over the image, each with a different orientation; coarse pictures, for speed.
constexpr glm::ivec2 whole_px{200, 150};

CameraSpec coarse(LensModel lens) { return camera_of(std::move(lens), whole_px, 8, 64); }

std::vector<Pose> twelve(double distance_m, const glm::dvec2& spread_deg) {
  std::vector<Pose> poses;
  for (int i = 0; i < 12; ++i) {
    const int column = i % 4, row = i / 4;
    const glm::dvec2 place(column / 1.5 - 1, row - 1.0);
    const glm::dvec3 turn_deg(i % 2 == 0 ? 25 : -25, i % 3 == 0 ? -30 : 20, 7 * (i % 5) - 14);
    poses.push_back(facing(spread_deg * place, distance_m, turn_deg));
  }
  return poses;
}

// With normal errors, one in a hundred such tests would have a parameter whose error exceeds this
// number of standard deviations: the two-sided quantile of 0.99^(1/9).
constexpr double most_sigmas = 3.26;

TEST(RenderedChessboard, OpenCvRecoversTheBrownConradyLens) {
  const PixelScale truth{{175.5, 173}, {98.25, 76.5}, 0};
  const std::array<double, 14> k{-0.28, 0.09, 1e-3, -2e-3, -0.02};
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> pictures;
  for (const Pose& X_CO : twelve(0.95, {13, 9})) {
    const Corners corners = corners_of({5, 4, 0.125}, X_CO, coarse(BrownConrady{truth, k}));
    boards.emplace_back(corners.on_board.begin(), corners.on_board.end());
    pictures.emplace_back(corners.in_picture.begin(), corners.in_picture.end());
  }
  cv::Mat matrix, coefficients, rotations, translations, sigma, sigma_poses, errors;
  cv::calibrateCamera(boards, pictures, {whole_px.x, whole_px.y}, matrix, coefficients, rotations,
                      translations, sigma, sigma_poses, errors, 0,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-14});
  const cv::Matx33d off = cv::Matx33d(matrix) - matrix_of(truth);
  std::vector<double> offs{off(0, 0), off(1, 1), off(0, 2), off(1, 2)};
  for (int i = 0; i < 5; ++i)
    offs.push_back(coefficients.at<double>(i) - k[static_cast<std::size_t>(i)]);
  for (int i = 0; i < 9; ++i) {
    const double in_sigmas = offs[static_cast<std::size_t>(i)] / sigma.at<double>(i);
    EXPECT_LT(std::abs(in_sigmas), most_sigmas) << i;
    testing::record_margin("parameters", in_sigmas, most_sigmas, "standard deviations");
    RecordProperty(fmt::format("parameter {}", i),
                   fmt::format("{:.2f} of {:.2g}", in_sigmas, sigma.at<double>(i)));
  }
  EXPECT_LT(sigma.at<double>(0), 0.5);
}

// Standard deviations of f, c and k from the residuals and their derivatives at the solution.
std::array<double, 8> sigmas(const std::vector<std::vector<cv::Point3d>>& boards,
                             const std::vector<std::vector<cv::Point2d>>& pictures,
                             const cv::Matx33d& matrix, const cv::Vec4d& k,
                             const std::vector<cv::Vec3d>& rotations,
                             const std::vector<cv::Vec3d>& translations) {
  const int views = static_cast<int>(boards.size()), unknowns = 8 + 6 * views;
  cv::Mat_<double> normal(unknowns, unknowns, 0.0);
  double squares = 0;
  int residuals = 0;
  for (int view = 0; view < views; ++view) {
    const auto n = static_cast<std::size_t>(view);
    std::vector<cv::Point2d> images;
    cv::Mat_<double> by;  // f c k, rotation and translation of the board, skew
    cv::fisheye::projectPoints(boards[n], images, rotations[n], translations[n], matrix, k, 0, by);
    const auto place = [&](int column) { return column < 8 ? column : 6 * view + column; };
    for (int row = 0; row < by.rows; ++row) {
      for (int a = 0; a < 14; ++a) {
        for (int b = 0; b < 14; ++b) normal(place(a), place(b)) += by(row, a) * by(row, b);
      }
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      const cv::Point2d off = images[i] - pictures[n][i];
      squares += off.dot(off);
      residuals += 2;
    }
  }
  cv::Mat_<double> covariance;
  cv::invert(normal, covariance);
  covariance *= squares / (residuals - unknowns);
  std::array<double, 8> result{};
  for (int i = 0; i < 8; ++i) result[static_cast<std::size_t>(i)] = std::sqrt(covariance(i, i));
  return result;
}

TEST(RenderedChessboard, OpenCvRecoversTheFisheye) {
  const PixelScale truth{{85.5, 84}, {98.25, 76.5}, 0};
  const std::array<double, 4> k{-0.012, 0.02, -0.012, 0.002};
  std::vector<std::vector<cv::Point3d>> boards;
  std::vector<std::vector<cv::Point2d>> pictures;
  for (const Pose& X_CO : twelve(0.45, {28, 18})) {
    const Corners corners = corners_of({5, 4, 0.125}, X_CO, coarse(KannalaBrandt{truth, k}));
    boards.push_back(corners.on_board);
    pictures.push_back(corners.in_picture);
  }
  cv::Matx33d matrix;
  cv::Vec4d coefficients;
  std::vector<cv::Vec3d> rotations, translations;
  cv::fisheye::calibrate(boards, pictures, {whole_px.x, whole_px.y}, matrix, coefficients,
                         rotations, translations,
                         cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
                         {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-14});
  const auto sigma = sigmas(boards, pictures, matrix, coefficients, rotations, translations);
  const cv::Matx33d off = matrix - matrix_of(truth);
  std::vector<double> offs{off(0, 0), off(1, 1), off(0, 2), off(1, 2)};
  for (int i = 0; i < 4; ++i) offs.push_back(coefficients[i] - k[static_cast<std::size_t>(i)]);
  for (std::size_t i = 0; i < offs.size(); ++i) {
    EXPECT_LT(std::abs(offs[i]), most_sigmas * sigma[i]) << i;
    testing::record_margin("parameters", offs[i] / sigma[i], most_sigmas, "standard deviations");
    RecordProperty(fmt::format("parameter {}", i),
                   fmt::format("{:.2f} of {:.2g}", offs[i] / sigma[i], sigma[i]));
  }
  EXPECT_LT(sigma[0], 0.1);
}

}  // namespace
}  // namespace groundray::rendered_calibration_test
