#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <memory>
#include <vector>

#include "apps/view/layers/mesh_layer.h"
#include "apps/view/rendering/picture_file.h"
#include "apps/view/rendering/view.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::view_display_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr glm::dvec3 far_away{429'452, 5'150'685, 300};  // magnitude of UTM coordinates
constexpr glm::ivec2 size_px(300, 300);
constexpr double eye_m = 4;

Layer white_cloud(const std::vector<glm::dvec3>& p_m) {
  Layer layer{.name = "cloud", .kind = LayerKind::Cloud, .data = make_points(p_m.size())};
  layer.origin_w_m = far_away;
  for (std::size_t i = 0; i < p_m.size(); ++i) {
    for (glm::length_t k = 0; k < 3; ++k)
      coordinates(*layer.data)[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p_m[i][k]);
  }
  layer.colour = glm::vec3(1);
  layer.point_size_px = 6;
  return layer;
}

// A plate of points 3 px apart, with a block half a metre above its middle.
Layer plate_with_block() {
  std::vector<glm::dvec3> p_m;
  for (int i = -45; i <= 45; ++i) {
    for (int k = -45; k <= 45; ++k) {
      const glm::dvec2 at = 0.03 * glm::dvec2(i, k);
      const bool is_block = std::abs(at.x) < 0.4 && std::abs(at.y) < 0.4;
      p_m.emplace_back(at, is_block ? 0.5 : 0.0);
    }
  }
  return white_cloud(p_m);
}

// A square of side 2 m in the plane z = 0.
Layer square() {
  TriangleMesh mesh;
  mesh.vertices_m = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh_layer("square", mesh, far_away);
}

void look_from_above(View& view) {
  view.look({far_away + glm::dvec3(0, 0, eye_m), far_away, {0, 1, 0}});
  view.set_legend_visible(false);
}

// Pinhole with VTK's view angle of 40 degrees that looks down from above, with north up.
glm::ivec2 imaged(const glm::dvec3& p_m) {
  const double focal_px = size_px.y / 2.0 / std::tan(glm::radians(20.0));
  return glm::dvec2(size_px) / 2.0 + focal_px / (eye_m - p_m.z) * glm::dvec2(p_m.x, -p_m.y);
}

int brightness(const Image8& picture, glm::ivec2 pixel) {
  const auto rgb = picture.at(pixel.x, pixel.y);
  return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

TEST(EyeDome, DarkensThePlateOnlyBesideTheBlock) {
  View view(make_offscreen_window(size_px));
  view.add(plate_with_block());
  look_from_above(view);
  const Image8 plain = view.picture(size_px);
  // The block's edge is seen at 0.4 * 4 / 3.5 = 0.457 m of the plate.
  const std::array<glm::ivec2, 4> beside{imaged({0.475, 0, 0}), imaged({-0.475, 0.1, 0}),
                                         imaged({0.1, 0.475, 0}), imaged({0, -0.475, 0})};
  const std::array<glm::ivec2, 4> away{imaged({0.8, 0, 0}), imaged({-0.8, 0.3, 0}),
                                       imaged({0, 0.8, 0}), imaged({0.1, 0.1, 0.5})};
  for (const glm::ivec2 pixel : beside) EXPECT_EQ(brightness(plain, pixel), 255);
  for (const glm::ivec2 pixel : away) EXPECT_EQ(brightness(plain, pixel), 255);
  EXPECT_FALSE(view.has_eye_dome());
  view.set_eye_dome(true);
  EXPECT_TRUE(view.has_eye_dome());
  const Image8 lit = view.picture(size_px);
  for (const glm::ivec2 pixel : beside) EXPECT_LT(brightness(lit, pixel), 200);
  for (const glm::ivec2 pixel : away) EXPECT_GT(brightness(lit, pixel), 235);
  view.set_eye_dome(false);
  EXPECT_TRUE(std::ranges::equal(view.picture(size_px).values(), plain.values()));
}

TEST(ClipBox, HidesWhatLiesOutside) {
  View view(make_offscreen_window(size_px));
  view.add(square());
  look_from_above(view);
  const glm::ivec2 west = imaged({-0.5, 0, 0}), east = imaged({0.5, 0, 0});
  const Image8 whole = view.picture(size_px);
  view.set_clip(ClipBox{far_away + glm::dvec3(-2, -2, -2), far_away + glm::dvec3(0, 2, 2)});
  const Image8 half = view.picture(size_px);
  EXPECT_EQ(brightness(half, west), brightness(whole, west));
  EXPECT_NE(brightness(half, east), brightness(whole, east));
  // The boundary is where the box ends, to a pixel.
  EXPECT_EQ(brightness(half, imaged({-0.015, 0, 0})), brightness(whole, west));
  EXPECT_EQ(brightness(half, imaged({0.015, 0, 0})), brightness(half, east));
  EXPECT_TRUE(view.pick(west.x, west.y));
  EXPECT_FALSE(view.pick(east.x, east.y));
  // Replaced layers are clipped, too; exempt ones are not.
  view.add(square());
  EXPECT_TRUE(std::ranges::equal(view.picture(size_px).values(), half.values()));
  view.set_clipped("square", false);
  EXPECT_TRUE(std::ranges::equal(view.picture(size_px).values(), whole.values()));
  EXPECT_TRUE(view.pick(east.x, east.y));
  view.set_clipped("square", true);
  view.set_clip(std::nullopt);
  EXPECT_TRUE(std::ranges::equal(view.picture(size_px).values(), whole.values()));
  EXPECT_THAT([&] { view.set_clip(ClipBox{}); }, ThrowsMessage<Error>(HasSubstr("empty")));
}

TEST(ClipBox, HidesPointsFromPicking) {
  View view(make_offscreen_window(size_px));
  view.add(white_cloud({{0.5, 0, 0}, {0.5, 0, 1}}));
  look_from_above(view);
  const glm::ivec2 upper = imaged({0.5, 0, 1}), lower = imaged({0.5, 0, 0});
  ASSERT_TRUE(view.pick(upper.x, upper.y));
  view.set_clip(ClipBox{far_away + glm::dvec3(-1, -1, -1), far_away + glm::dvec3(1, 1, 0.5)});
  EXPECT_FALSE(view.pick(upper.x, upper.y));
  ASSERT_TRUE(view.pick(lower.x, lower.y));
  EXPECT_EQ(view.pick(lower.x, lower.y)->row, 0);
}

TEST(View, BoundsAreThoseOfVisibleLayers) {
  View view(make_offscreen_window(size_px));
  EXPECT_FALSE(view.bounds());
  view.add(square());
  view.add(white_cloud({{0, 0, -3}, {5, 0, 1}}));
  ASSERT_TRUE(view.bounds());
  EXPECT_EQ(view.bounds()->low_w_m, far_away + glm::dvec3(-1, -1, -3));
  EXPECT_EQ(view.bounds()->high_w_m, far_away + glm::dvec3(5, 1, 1));
  view.set_visible("cloud", false);
  EXPECT_EQ(view.bounds()->low_w_m, far_away + glm::dvec3(-1, -1, 0));
}

TEST(View, PicksTheNearestCornerExactly) {
  View view(make_offscreen_window(size_px));
  view.add(square());
  look_from_above(view);
  const glm::ivec2 corner = imaged({1, 1, 0});
  const auto picked = view.pick_vertex(corner.x - 3, corner.y + 2);
  ASSERT_TRUE(picked);
  EXPECT_EQ(picked->of, LayerColumn::Of::Points);
  EXPECT_EQ(picked->row, 2);
  EXPECT_EQ(picked->p_w_m, far_away + glm::dvec3(1, 1, 0));
  const glm::ivec2 middle = imaged({0.3, 0.1, 0});
  const auto surface = view.pick_vertex(middle.x, middle.y);
  ASSERT_TRUE(surface);
  EXPECT_EQ(surface->of, LayerColumn::Of::Cells);
  constexpr double pixel_m = 1 / 103.0;
  EXPECT_LT(glm::distance(surface->p_w_m, far_away + glm::dvec3(0.3, 0.1, 0)), 1.5 * pixel_m);
}

// The western half of the mask is transparent.
TEST(View, MasksCutSurfacesOutInAnyColour) {
  View view(make_offscreen_window(size_px));
  Layer layer = square();
  Image8 mask(2, 1, 4);
  for (auto& byte : mask.values()) byte = 255;
  mask.at(0, 0)[3] = 0;
  layer.mask = make_mask(mask);
  constexpr std::array<glm::vec2, 4> places = {glm::vec2(0, 0), {1, 0}, {1, 1}, {0, 1}};
  set_texture_coordinates(*layer.data, places);
  const std::array<float, 2> labels{5, 5};
  add_column(layer,
             {.name = "label", .unit = "", .of = LayerColumn::Of::Cells, .categories = {{5, "a"}}},
             labels);
  view.add(std::move(layer));
  look_from_above(view);
  const glm::ivec2 west = imaged({-0.5, 0, 0}), east = imaged({0.5, 0, 0});
  view.set_visible("square", false);
  const Image8 nothing = view.picture(size_px);
  view.set_visible("square", true);
  for (const char* const column : {"", "height", "label"}) {
    view.colour_by("square", column);
    const Image8 picture = view.picture(size_px);
    EXPECT_EQ(brightness(picture, west), brightness(nothing, west)) << column;
    EXPECT_GT(glm::distance(glm::dvec3(picture.at(east.x, east.y)[0], picture.at(east.x, east.y)[1],
                                       picture.at(east.x, east.y)[2]),
                            glm::dvec3(nothing.at(east.x, east.y)[0], nothing.at(east.x, east.y)[1],
                                       nothing.at(east.x, east.y)[2])),
              20)
        << column;
  }
}

TEST(View, LabelsAreDrawnInFrontOfEverything) {
  View view(make_offscreen_window(size_px));
  view.add(square());
  look_from_above(view);
  const Image8 without = view.picture(size_px);
  view.set_label(ViewLabel{"12.345 m", far_away + glm::dvec3(0, 0, -1)});
  const Image8 with = view.picture(size_px);
  EXPECT_FALSE(std::ranges::equal(with.values(), without.values()));
  view.set_label(std::nullopt);
  EXPECT_TRUE(std::ranges::equal(view.picture(size_px).values(), without.values()));
}

// sRGB, IEC 61966-2-1.
double encoded(double linear) {
  linear = std::clamp(linear, 0.0, 1.0);
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
}

double decoded(double byte) {
  return byte <= 10 ? byte / 255 / 12.92 : std::pow((byte / 255 + 0.055) / 1.055, 2.4);
}

constexpr int picture_px = 48;  // width and height

// Returns the colour of a picture's centre, seen from straight ahead.
std::array<int, 3> centre_of(View& view) {
  constexpr double middle = picture_px / 2.0;
  view.look({{middle, middle, 90}, {middle, middle, 0}, {0, 1, 0}});
  view.set_legend_visible(false);
  const Image8 shown = view.picture(size_px);
  const auto rgb = shown.at(size_px.x / 2, size_px.y / 2);
  return {rgb[0], rgb[1], rgb[2]};
}

constexpr double drawing_tolerance = 1;  // of bytes: that of the picture is rounded twice

TEST(Exposure, BrightensPicturesInLinearLight) {
  const auto file = std::make_shared<PictureFile>();
  file->picture = Image8(picture_px, picture_px, 3);
  constexpr std::array<std::uint8_t, 3> colour = {55, 120, 5};
  for (std::size_t i = 0; i < file->picture.values().size(); ++i)
    file->picture.values()[i] = colour[i % 3];
  View view(make_offscreen_window(size_px));
  view.add(picture_layer("first", file));
  for (const double exposure_ev : {0.0, 1.0, -1.0, 2.5, 0.0}) {
    view.set_exposure(exposure_ev);
    EXPECT_EQ(view.exposure_ev(), exposure_ev);
    const auto shown = centre_of(view);
    for (std::size_t k = 0; k < 3; ++k) {
      const double expected = encoded(std::exp2(exposure_ev) * decoded(colour[k]));
      EXPECT_NEAR(shown[k], expected, drawing_tolerance) << exposure_ev << " EV";
    }
  }
}

// 1 is the 99 % quantile of the light. Values above it become visible when the exposure is lowered.
TEST(Exposure, KeepsTheRangeOfLight) {
  const testing::TemporaryFolder folder;
  for (const float centre : {0.25f, 3.0f}) {
    ImageF light(picture_px, picture_px, 3);
    std::ranges::fill(light.values(), 1.0f);
    for (int y = picture_px / 2 - 2; y < picture_px / 2 + 2; ++y) {
      for (int x = picture_px / 2 - 2; x < picture_px / 2 + 2; ++x)
        std::ranges::fill(light.at(x, y), centre);
    }
    write_exr(folder / "light.exr", {{{"R", "G", "B"}, &light}});
    View view(make_offscreen_window(size_px));
    view.set_exposure(-2);  // layers that are added later have it, too
    view.add(picture_layer(
        "light", std::make_shared<const PictureFile>(read_picture(folder / "light.exr"))));
    for (const double exposure_ev : {-2.0, 0.0, 1.0}) {
      view.set_exposure(exposure_ev);
      EXPECT_NEAR(centre_of(view)[0], encoded(std::exp2(exposure_ev) * static_cast<double>(centre)),
                  drawing_tolerance)
          << centre << " at " << exposure_ev << " EV";
    }
  }
}

TEST(Exposure, LeavesColoursOfNumbers) {
  const testing::TemporaryFolder folder;
  ImageF depth(picture_px, picture_px, 1);
  std::ranges::fill(depth.values(), 7.0f);
  write_exr(folder / "depth.exr", {{{"Z"}, &depth}});
  View view(make_offscreen_window(size_px));
  view.add(picture_layer("depth",
                         std::make_shared<const PictureFile>(read_picture(folder / "depth.exr"))));
  const auto before = centre_of(view);
  view.set_exposure(3);
  EXPECT_EQ(centre_of(view), before);
  EXPECT_THAT([&] { view.set_exposure(std::nan("")); },
              ThrowsMessage<Error>(HasSubstr("must be finite")));
}

}  // namespace
}  // namespace groundray::view_display_test
