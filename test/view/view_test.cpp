#include "apps/view/rendering/view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkMapper.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <string>

#include "apps/view/layers/mesh_layer.h"
#include "core/error.h"

namespace groundray::view_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr glm::dvec3 far_away{429'452, 5'150'685, 300};  // magnitude of UTM coordinates

// Points with one colour each, drawn large enough to be found in the picture.
Layer points_at(const std::string& name, const std::vector<glm::dvec3>& p_m,
                const std::vector<glm::u8vec3>& rgb) {
  Layer layer{.name = name, .kind = LayerKind::Cloud, .data = make_points(p_m.size())};
  layer.origin_w_m = far_away;
  std::vector<std::uint8_t> bytes;
  std::vector<float> number;
  for (std::size_t i = 0; i < p_m.size(); ++i) {
    for (glm::length_t k = 0; k < 3; ++k) {
      coordinates(*layer.data)[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p_m[i][k]);
      bytes.push_back(rgb[i][k]);
    }
    number.push_back(static_cast<float>(i));
  }
  add_colours(layer, {.name = "colour", .unit = ""}, bytes);
  add_column(layer, {.name = "number", .unit = ""}, number);
  layer.coloured_by = "colour";
  layer.point_size_px = 5;
  return layer;
}

// A square of side 2 m in the plane z = height.
Layer square_at(const std::string& name, double height_m) {
  TriangleMesh mesh;
  mesh.vertices_m = {{-1, -1, height_m}, {1, -1, height_m}, {1, 1, height_m}, {-1, 1, height_m}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh_layer(name, mesh, far_away);
}

// Projects a point through a pinhole with VTK's view angle of 40 degrees that looks down from
// above, with north up.
glm::dvec2 imaged(const glm::dvec3& p_m, double eye_m, glm::ivec2 size_px) {
  const double focal_px = size_px.y / 2.0 / std::tan(glm::radians(20.0));
  return glm::dvec2(size_px) / 2.0 + focal_px / (eye_m - p_m.z) * glm::dvec2(p_m.x, -p_m.y);
}

Look from_above(double eye_m) { return {far_away + glm::dvec3(0, 0, eye_m), far_away, {0, 1, 0}}; }

// Converts a pixel to integers for messages.
std::vector<int> numbers(std::span<const std::uint8_t> pixel) {
  return {pixel.begin(), pixel.end()};
}

bool is_like(std::span<const std::uint8_t> pixel, glm::u8vec3 rgb) {
  return std::abs(pixel[0] - rgb.r) + std::abs(pixel[1] - rgb.g) + std::abs(pixel[2] - rgb.b) < 12;
}

const std::vector<glm::dvec3> places = {
    {0, 0, 0}, {0.5, 0.25, 0}, {-0.7, 0.3, 0.5}, {0.4, -0.4, 1}};
const std::vector<glm::u8vec3> colours = {
    {250, 10, 10}, {10, 240, 10}, {20, 20, 250}, {250, 250, 0}};

TEST(View, DrawsPointsAtTheirPinholeProjection) {
  constexpr glm::ivec2 size(300, 200);
  View view(make_offscreen_window(size));
  view.add(points_at("cloud", places, colours));
  view.look(from_above(4));
  const Image8 picture = view.picture(size);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const glm::ivec2 at(glm::floor(imaged(places[i], 4, size)));
    EXPECT_TRUE(is_like(picture.at(at.x, at.y), colours[i]))
        << i << ": " << ::testing::PrintToString(numbers(picture.at(at.x, at.y)));
    EXPECT_FALSE(is_like(picture.at(at.x + 6, at.y), colours[i])) << i;
  }
}

// 5000 px are wider than one tile.
TEST(View, DrawsLargePicturesInTiles) {
  constexpr glm::ivec2 size(5000, 400);
  View view(make_offscreen_window({300, 200}));
  std::vector<glm::dvec3> row;
  std::vector<glm::u8vec3> red;
  for (int i = -12; i <= 12; ++i) {
    row.emplace_back(i * 1.4, 0.1 * (i % 5), 0);
    red.emplace_back(250, 10, 10);
  }
  Layer layer = points_at("cloud", row, red);
  layer.point_size_px = 9;
  view.add(std::move(layer));
  view.look(from_above(4));
  const Image8 picture = view.picture(size);
  ASSERT_EQ(picture.width(), size.x);
  ASSERT_EQ(picture.height(), size.y);
  int seen = 0;
  for (const glm::dvec3& p : row) {
    const glm::ivec2 at(glm::floor(imaged(p, 4, size)));
    if (at.x < 0 || at.x >= size.x) continue;
    EXPECT_TRUE(is_like(picture.at(at.x, at.y), {250, 10, 10}))
        << p.x << ": " << ::testing::PrintToString(numbers(picture.at(at.x, at.y)));
    ++seen;
  }
  EXPECT_GT(seen, 10);
}

TEST(View, RejectsInvalidPictureSizes) {
  View view(make_offscreen_window({30, 20}));
  for (const glm::ivec2 size : {glm::ivec2(0, 10), {10, -1}, {70'000, 10}}) {
    EXPECT_THAT([&] { view.picture(size); }, ThrowsMessage<Error>(HasSubstr("1 x 1 to 65535")));
  }
}

TEST(View, PicksThePointUnderAPixel) {
  constexpr glm::ivec2 size(300, 200);
  View view(make_offscreen_window(size));
  view.add(points_at("cloud", places, colours));
  view.look(from_above(4));
  view.render();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const glm::ivec2 at(glm::floor(imaged(places[i], 4, size)));
    for (const glm::ivec2 beside : {glm::ivec2(0), {2, 1}, {-3, 3}}) {
      const auto picked = view.pick(at.x + beside.x, at.y + beside.y);
      ASSERT_TRUE(picked) << i;
      EXPECT_EQ(picked->layer, "cloud");
      EXPECT_EQ(picked->row, static_cast<vtkIdType>(i));
      EXPECT_LT(glm::distance(picked->p_w_m, far_away + places[i]), 1e-6);
      EXPECT_EQ(view.find("cloud")->value(*view.find("cloud")->find("number"), picked->row),
                static_cast<double>(i));
    }
  }
  EXPECT_FALSE(view.pick(2, 2));
}

TEST(View, PicksNoOccludedPoints) {
  constexpr glm::ivec2 size(300, 200);
  View view(make_offscreen_window(size));
  view.add(points_at("cloud", {{0.2, 0.1, 0}, {0.3, 0.1, 1.5}}, {{255, 0, 0}, {0, 255, 0}}));
  view.add(square_at("roof", 1));
  view.look(from_above(4));
  view.render();
  const glm::ivec2 below(glm::floor(imaged({0.2, 0.1, 0}, 4, size)));
  const auto surface = view.pick(below.x, below.y);
  ASSERT_TRUE(surface);
  EXPECT_EQ(surface->layer, "roof");
  EXPECT_EQ(surface->of, LayerColumn::Of::Cells);
  EXPECT_NEAR(surface->p_w_m.z, far_away.z + 1, 1e-6);
  const glm::ivec2 above(glm::floor(imaged({0.3, 0.1, 1.5}, 4, size)));
  EXPECT_EQ(view.pick(above.x, above.y)->layer, "cloud");
  view.set_visible("roof", false);
  EXPECT_EQ(view.pick(below.x, below.y)->layer, "cloud");
}

// The line of sight intersects the plane where the pinhole model predicts, whatever the direction
// of view.
TEST(View, LinesOfSightMatchAPinhole) {
  constexpr glm::ivec2 size(320, 240);
  View view(make_offscreen_window(size));
  view.add(square_at("floor", 0));
  view.look({far_away + glm::dvec3(3, -5, 4), far_away, {0, 0, 1}});
  view.render();
  const auto [from, middle] = view.line_of_sight(160, 120);
  EXPECT_LT(glm::distance(from, far_away + glm::dvec3(3, -5, 4)), 1e-6);
  const auto half_pixel = glm::radians(40.0) / 240;
  EXPECT_LT(std::acos(glm::dot(middle, glm::normalize(glm::dvec3(-3, 5, -4)))), half_pixel);
  const auto [from_upper, upper] = view.line_of_sight(160, 0);
  EXPECT_NEAR(std::acos(glm::dot(upper, glm::normalize(glm::dvec3(-3, 5, -4)))), glm::radians(20.0),
              half_pixel);
  EXPECT_GT(upper.z, middle.z);
}

vtkIdType drawn_points(const View& view, const std::string& layer) {
  auto* const mapper = vtkPolyDataMapper::SafeDownCast(view.find(layer)->actor->GetMapper());
  return mapper->GetInput()->GetNumberOfPoints();
}

TEST(View, DrawsFewerPointsWhileMoving) {
  std::vector<glm::dvec3> many(600'000);
  for (std::size_t i = 0; i < many.size(); ++i)
    many[i] = {static_cast<double>(i % 1000) / 500 - 1,
               std::floor(static_cast<double>(i) / 1000) / 300 - 1, 0};
  View view(make_offscreen_window({300, 200}));
  view.add(points_at("cloud", many, std::vector<glm::u8vec3>(many.size())));
  view.add(points_at("few", places, colours));
  EXPECT_EQ(drawn_points(view, "cloud"), 600'000);
  view.set_moving(true);
  view.render();
  EXPECT_LT(drawn_points(view, "cloud"), 300'000);
  EXPECT_GT(drawn_points(view, "cloud"), 10'000);
  view.set_moving(false);
  EXPECT_EQ(drawn_points(view, "cloud"), 600'000);
}

TEST(View, KeepsTheStyleOfAReplacedLayer) {
  View view(make_offscreen_window({30, 20}));
  view.add(points_at("cloud", places, colours));
  view.colour_by("cloud", "number");
  view.set_opacity("cloud", 0.5);
  view.set_visible("cloud", false);
  const Layer& again = view.add(points_at("cloud", places, colours));
  EXPECT_EQ(again.coloured_by, "number");
  EXPECT_EQ(again.opacity, 0.5);
  EXPECT_FALSE(again.visible);
  EXPECT_EQ(view.layers().size(), 1u);
  view.remove("cloud");
  EXPECT_EQ(view.find("cloud"), nullptr);
  view.remove("cloud");
}

TEST(View, ReportsMissingLayersAndColumns) {
  View view(make_offscreen_window({30, 20}));
  view.add(points_at("cloud", places, colours));
  EXPECT_THAT([&] { view.colour_by("cluod", "number"); }, ThrowsMessage<Error>(HasSubstr("cluod")));
  EXPECT_THAT([&] { view.colour_by("cloud", "depth"); }, ThrowsMessage<Error>(HasSubstr("depth")));
  EXPECT_THAT(
      [&] {
        view.set_range("cloud", "number", {2, 1});
      },
      ThrowsMessage<Error>(HasSubstr("[2, 1]")));
  EXPECT_THAT([&] { view.add({.name = "nothing"}); }, ThrowsMessage<Error>(HasSubstr("nothing")));
  Layer wrong = points_at("wrong", places, colours);
  wrong.columns.push_back({.name = "absent", .unit = ""});
  EXPECT_THAT([&] { view.add(wrong); }, ThrowsMessage<Error>(HasSubstr("absent")));
}

TEST(View, LegendExplainsTheColours) {
  constexpr glm::ivec2 size(400, 300);
  View view(make_offscreen_window(size));
  view.add(points_at("cloud", places, colours));
  view.look(from_above(400));
  const Image8 without = view.picture(size);
  view.colour_by("cloud", "number");
  const Image8 with = view.picture(size);
  view.set_legend_visible(false);
  const Image8 again = view.picture(size);
  const auto changed = [&](const Image8& a, const Image8& b) {
    int pixels = 0;
    for (int y = 100; y < 300; ++y) {
      for (int x = 250; x < 400; ++x)
        pixels += is_like(a.at(x, y), {b.at(x, y)[0], b.at(x, y)[1], b.at(x, y)[2]}) ? 0 : 1;
    }
    return pixels;
  };
  EXPECT_GT(changed(without, with), 5000);
  EXPECT_EQ(changed(without, again), 0);
  // The legend contains the yellow and the violet end of viridis.
  int yellow = 0, violet = 0;
  for (int y = 0; y < 300; ++y) {
    for (int x = 250; x < 400; ++x) {
      yellow += is_like(with.at(x, y), {250, 230, 37}) ? 1 : 0;
      violet += is_like(with.at(x, y), {69, 3, 86}) ? 1 : 0;
    }
  }
  EXPECT_GT(yellow, 5);
  EXPECT_GT(violet, 5);
}

// Ranges without round subdivisions, or which doubles do not resolve.
TEST(View, LegendAcceptsAnyRange) {
  constexpr glm::ivec2 size(200, 150);
  View view(make_offscreen_window(size));
  view.add(points_at("cloud", places, colours));
  view.colour_by("cloud", "number");
  constexpr double most = std::numeric_limits<double>::max();
  for (const glm::dvec2 range :
       {glm::dvec2(1e17, 1e17 + 64), glm::dvec2(-1e300, -1e300 * (1 - 1e-15)),
        glm::dvec2(-most, most), glm::dvec2(0, 5e-324), glm::dvec2(0, 1e-307),
        glm::dvec2(1, 1 + 1e-15), glm::dvec2(0, most)}) {
    view.set_range("cloud", "number", range);
    EXPECT_EQ(view.picture(size).width(), size.x);
  }
}

// Small layers are not thinned to nothing when a large layer is drawn as well.
TEST(View, KeepsSmallLayersWhileMoving) {
  std::vector<glm::dvec3> many(600'000, glm::dvec3(0));
  View view(make_offscreen_window({300, 200}));
  view.add(points_at("cloud", many, std::vector<glm::u8vec3>(many.size())));
  view.add(points_at("few", places, colours));
  TriangleMesh field;
  for (std::uint32_t i = 0; i < 90'000; ++i) {
    for (const glm::dvec3& p : {glm::dvec3(0), glm::dvec3(0.01, 0, 0), glm::dvec3(0, 0.01, 0)})
      field.vertices_m.push_back(
          p + 0.01 * glm::dvec3(i % 300, static_cast<std::uint32_t>(i / 300), 0));
    field.triangles.push_back(glm::uvec3(0, 1, 2) + 3 * i);
  }
  view.add(mesh_layer("field", field, far_away));
  view.add(square_at("floor", 0));
  view.set_moving(true);
  view.render();
  EXPECT_EQ(drawn_points(view, "few"), 4);
  EXPECT_EQ(drawn_points(view, "floor"), 4);
  EXPECT_GT(drawn_points(view, "field"), 5'000);
  EXPECT_LT(drawn_points(view, "field"), 270'000);
}

TEST(View, FitsTheVisibleLayers) {
  View view(make_offscreen_window({200, 200}));
  view.add(square_at("floor", 0));
  view.fit();
  view.render();
  ASSERT_TRUE(view.pick(100, 100));
  EXPECT_LT(glm::distance(view.current_look().at_w_m, far_away), 1e-3);
}

}  // namespace
}  // namespace groundray::view_test
