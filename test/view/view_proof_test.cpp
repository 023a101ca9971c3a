#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>

#include <chrono>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <vector>

#include "apps/view/layers/mesh_layer.h"
#include "apps/view/rendering/view.h"
#include "test/support/machine_speed.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::view_proof_test {
namespace {

double wave_m(double x, double y) { return 20 * std::sin(x / 40) * std::cos(y / 55); }

Layer surface(int cells) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) mesh.vertices_m.emplace_back(i, j, wave_m(i, j));
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  Layer layer = mesh_layer("surface", mesh, glm::dvec3(0));
  layer.coloured_by = "height";
  return layer;
}

Layer points(std::size_t count, double size_m) {
  Layer layer{.name = "points", .kind = LayerKind::Cloud, .data = make_points(count)};
  std::vector<float> number(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = std::fmod(static_cast<double>(i) * 0.754877666, 1.0) * size_m;
    const double y = std::fmod(static_cast<double>(i) * 0.569840296, 1.0) * size_m;
    const auto place = coordinates(*layer.data).subspan(3 * i, 3);
    place[0] = static_cast<float>(x);
    place[1] = static_cast<float>(y);
    place[2] = static_cast<float>(wave_m(x, y) + 2);
    number[i] = static_cast<float>(x);
  }
  add_column(layer, {.name = "number", .unit = "", .scale = ColourScale::Vivid}, number);
  layer.coloured_by = "number";
  return layer;
}

// Data that a layer is currently drawn with.
vtkPolyData& drawn(const View& view, const std::string& layer) {
  return *vtkPolyDataMapper::SafeDownCast(view.find(layer)->actor->GetMapper())->GetInput();
}

double frames_per_s(View& view, double size_m, int frames) {
  const auto begin = std::chrono::steady_clock::now();
  const glm::dvec3 middle(size_m / 2, size_m / 2, 0);
  for (int i = 0; i < frames; ++i) {
    const double turn = glm::radians(i * 6.0);
    view.look({middle + 0.8 * size_m * glm::dvec3(std::cos(turn), std::sin(turn), 0.5), middle});
    view.render();
    view.window()->WaitForCompletion();
  }
  return frames / std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// A million triangles and two million points, in a window of 1280 x 720 px without a graphics card:
// at least 15 frames per second during motion, fewer on slower machines.
TEST(ViewProof, KeepsTheFrameRateDuringMotion) {
  const int cells = static_cast<int>(testing::proof_size(250, 708));
  View view(make_offscreen_window({1280, 720}));
  view.add(surface(cells));
  view.add(points(testing::proof_size(200'000, 2'000'000), cells));
  frames_per_s(view, cells, 2);
  const double still = frames_per_s(view, cells, 3);
  view.set_moving(true);
  frames_per_s(view, cells, 2);
  EXPECT_GT(drawn(view, "surface").GetNumberOfPolys(), 5'000);
  EXPECT_GT(drawn(view, "points").GetNumberOfPoints(), 5'000);
  const double moving = frames_per_s(view, cells, 30);
  fmt::print("{} triangles, {} points: {:.1f} frames/s while moving, {:.1f} in full\n",
             view.find("surface")->triangles(), view.find("points")->points(), moving, still);
  RecordProperty("frames_per_s_moving", fmt::format("{:.1f}", moving));
  if (testing::proof_size(0, 1) == 1) {
    EXPECT_GE(moving, 15 / testing::slowness());
  }
  EXPECT_GT(moving, 1);
  // However slow the rendering: both layers are still there.
  EXPECT_GT(drawn(view, "surface").GetNumberOfPolys(), 1'000);
  EXPECT_GT(drawn(view, "points").GetNumberOfPoints(), 1'000);
}

}  // namespace
}  // namespace groundray::view_proof_test
