#include "apps/view/layers/cut_out.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "apps/view/layers/scene_layers.h"
#include "apps/view/rendering/view.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::cut_out_test {
namespace {

// A square of two triangles, whose image is transparent in its lower half and repeats in the second
// triangle.
Model card() {
  Model model;
  model.mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.uv = {{3, -2}, {4, -2}, {4, -1}, {8, -1}};
  model.surface_of = {0, 0};
  ModelSurface surface;
  surface.albedo.pixels = Image8(4, 8, 4);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 4; ++x) surface.albedo.pixels.at(x, y)[3] = y < 4 ? 200 : 60;
  }
  model.surfaces = {surface};
  return model;
}

TEST(CutOuts, PlaceRepeatsOfTheImageInTheTexture) {
  const Model model = card();
  const std::vector<const Model*> models{&model};
  const CutOuts cut_outs(models);
  EXPECT_FALSE(cut_outs.empty());
  const auto corners = cut_outs.corners(0, 0);
  ASSERT_TRUE(corners);
  // The texture is 5 texels wide: an opaque one and the four of the mask.
  EXPECT_NEAR((*corners)[0].x, 0.2, 1e-6);
  EXPECT_NEAR((*corners)[0].y, 0, 1e-6);
  EXPECT_NEAR((*corners)[2].x, 1, 1e-6);
  EXPECT_NEAR((*corners)[2].y, 1, 1e-6);
  EXPECT_LT(cut_outs.opaque().x, 0.2f);
  EXPECT_FALSE(cut_outs.corners(0, 1));  // spans five repeats: drawn as a whole
}

TEST(CutOuts, SurfacesWithoutAlphaOrWithItUnusedAreWhole) {
  Model unused = card(), grey = card();
  unused.surfaces[0].least_alpha = 0;
  grey.surfaces[0].albedo.pixels = Image8(4, 4, 3);
  const std::vector<const Model*> models{&unused, &grey};
  const CutOuts cut_outs(models);
  EXPECT_TRUE(cut_outs.empty());
  EXPECT_EQ(cut_outs.texture(), nullptr);
  EXPECT_FALSE(cut_outs.corners(0, 0));
}

std::size_t pixels_of(const Layer& layer) {
  constexpr glm::ivec2 size_px(300, 300);
  View view(make_offscreen_window(size_px));
  view.add(layer);
  view.set_legend_visible(false);
  view.fit();
  const Image8 with = view.picture(size_px);
  view.set_visible(layer.name, false);
  const Image8 without = view.picture(size_px);
  std::size_t count = 0;
  for (int i = 0; i < size_px.x * size_px.y; ++i) {
    const glm::ivec2 at(i % size_px.x, i / size_px.x);
    count += std::ranges::equal(with.at(at.x, at.y), without.at(at.x, at.y)) ? 0U : 1U;
  }
  return count;
}

// Leaves are on cards, of which less than half is opaque: without the mask a tree covers more of
// the picture, whatever it is coloured by.
TEST(CutOuts, LeavesOfTreesAreCutOutWhenColouredByLabel) {
  const testing::TemporaryFolder folder;
  std::string text = testing::sample_scene();
  const std::string post = "asset: fence_post";
  text.replace(text.find(post), post.size(), "asset: broadleaf_tree");
  const auto scene = testing::write_sample_scene(folder.path(), text);
  const Simulation simulation = load_simulation(scene);
  Layer tree =
      object_layer(simulation, 0, std::chrono::nanoseconds(0), middle_of_run(simulation), 600'000);
  ASSERT_NE(tree.mask, nullptr);
  for (const char* const column : {"colour", "label", "instance"}) {
    tree.coloured_by = column;
    Layer whole = tree;
    whole.mask = nullptr;
    EXPECT_LT(static_cast<double>(pixels_of(tree)), 0.9 * static_cast<double>(pixels_of(whole)))
        << column;
  }
  const Layer cart =
      object_layer(simulation, 1, std::chrono::nanoseconds(0), middle_of_run(simulation), 600'000);
  EXPECT_EQ(cart.mask, nullptr);
}

}  // namespace
}  // namespace groundray::cut_out_test
