#include "apps/view/rendering/offscreen_render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/rendering/view.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::offscreen_render_test {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

std::vector<Opened> jacksboro() {
  std::vector<Opened> inputs;
  inputs.push_back(open_any(testing::data_folder() / "terrain/jacksboro.tif"));
  return inputs;
}

Image8 still_of(std::vector<Opened> inputs, const StillSpec& spec) {
  View view(make_offscreen_window(spec.size_px));
  arrange(view, inputs, spec);
  return view.picture(spec.size_px);
}

// Compares means over blocks of 8 x 8 pixels: edges that move by a pixel change them little.
double largest_block_difference(const Image8& a, const Image8& b) {
  double largest = 0;
  for (int y = 0; y + 8 <= a.height(); y += 8) {
    for (int x = 0; x + 8 <= a.width(); x += 8) {
      for (std::size_t k = 0; k < 3; ++k) {
        double sum = 0;
        for (int j = 0; j < 64; ++j)
          sum += a.at(x + j % 8, y + j / 8)[k] - b.at(x + j % 8, y + j / 8)[k];
        largest = std::max(largest, std::abs(sum) / 64);
      }
    }
  }
  return largest;
}

// The golden pictures are groundray-view's own:
//   groundray-view data/terrain/jacksboro.tif --size 320x184 [--colour-by slope]
//     --screenshot test/view/golden/jacksboro[_slope].png
class Golden : public ::testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(Golden, TerrainMatchesTheGoldenImage) {
  const auto& [column, name] = GetParam();
  StillSpec spec{.size_px = {320, 184}};
  if (column[0] != '\0') spec.view.colour_by = {column};
  const Image8 now = still_of(jacksboro(), spec);
  const Image8 golden =
      read_image8(testing::data_folder().parent_path() / "test/view/golden" / name);
  ASSERT_EQ(golden.width(), now.width());
  ASSERT_EQ(golden.height(), now.height());
  // Other versions of FreeType draw the legend's letters slightly differently: in a block that is
  // half letters, by a tenth.
  EXPECT_LT(largest_block_difference(now, golden), 13);
}

INSTANTIATE_TEST_SUITE_P(Jacksboro, Golden,
                         ::testing::Values(std::pair("", "jacksboro.png"),
                                           std::pair("slope", "jacksboro_slope.png"),
                                           std::pair("cell size", "jacksboro_cell_size.png")));

TEST(Still, NeedsNoDisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const Image8 picture = still_of(jacksboro(), {.size_px = {64, 48}});
  EXPECT_EQ(picture.width(), 64);
}

TEST(Still, LooksAtTheGivenPoint) {
  std::vector<Opened> inputs = jacksboro();
  View view(make_offscreen_window({64, 48}));
  const glm::dvec3 from(740'000, 4'030'000, 9'000), at(741'000, 4'031'000, 300);
  arrange(view, inputs, {.view = {.from_w_m = from, .at_w_m = at}});
  EXPECT_LT(glm::distance(view.current_look().from_w_m, from), 1e-6);
  EXPECT_LT(glm::distance(view.current_look().at_w_m, at), 1e-6);
  EXPECT_THAT([&] { arrange(view, inputs, {.view = {.from_w_m = from, .at_w_m = from}}); },
              ThrowsMessage<Error>(HasSubstr("the same point")));
}

TEST(Still, HidesLayersAndDrawsWireframes) {
  const Image8 hidden =
      still_of(jacksboro(), {.size_px = {320, 184}, .view = {.hide = {"terrain"}}});
  const Image8 shown =
      still_of(jacksboro(), {.size_px = {320, 184}, .view = {.has_legend = false}});
  const Image8 wires =
      still_of(jacksboro(), {.size_px = {320, 184}, .view = {.is_wireframe = true}});
  // Where the terrain is hidden, only the background remains, which is constant in each row.
  for (int y = 0; y < 184; ++y) {
    for (int x = 1; x < 200; ++x) ASSERT_NEAR(hidden.at(x, y)[1], hidden.at(0, y)[1], 1);
  }
  EXPECT_GT(largest_block_difference(hidden, shown), 40);
  EXPECT_GT(largest_block_difference(wires, shown), 10);
}

TEST(Still, TurntableIsACompleteTurn) {
  TemporaryFolder folder;
  std::vector<Opened> inputs = jacksboro();
  View view(make_offscreen_window({64, 48}));
  arrange(view, inputs, {.view = {.has_legend = false}});
  const glm::dvec3 from = view.current_look().from_w_m;
  write_turntable(view, folder / "turn", 4, {64, 48});
  EXPECT_LT(glm::distance(view.current_look().from_w_m, from), 1e-6);
  int pictures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "turn"))
    pictures += entry.path().extension() == ".png" ? 1 : 0;
  EXPECT_EQ(pictures, 4);
  const Image8 first = read_image8(folder / "turn/0000.png");
  EXPECT_LT(largest_block_difference(first, view.picture({64, 48})), 1);
  EXPECT_GT(largest_block_difference(first, read_image8(folder / "turn/0002.png")), 5);
  EXPECT_THAT(
      [&] {
        write_turntable(view, folder / "turn", 1, {64, 48});
      },
      ThrowsMessage<Error>(HasSubstr("2 to 9999")));
}

TEST(Still, ParsesSizesAndPlaces) {
  EXPECT_EQ(parse_size("1280x720"), glm::ivec2(1280, 720));
  EXPECT_EQ(parse_place("1.5,-2e3,7", "--look-at"), glm::dvec3(1.5, -2000, 7));
  for (const char* const text : {"", "12", "12x", "x12", "0x5", "12x-4", "12x5x7", "12 x 5"}) {
    EXPECT_THAT([&] { parse_size(text); }, ThrowsMessage<Error>(HasSubstr("--size"))) << text;
  }
  for (const char* const text : {"", "1,2", "1,2,3,4", "1;2;3", "nan,1,2", "1,2,inf"}) {
    EXPECT_THAT([&] { parse_place(text, "--look-at"); },
                ThrowsMessage<Error>(HasSubstr("--look-at")))
        << text;
  }
}

TEST(Still, ParsesOriginsAndBoxes) {
  const FrameOrigin of_all = parse_origin("1,2,3.5"), of_one = parse_origin("a=b.ply=-1,2,3");
  EXPECT_EQ(of_all.input, "");
  EXPECT_EQ(of_all.origin_w_m, glm::dvec3(1, 2, 3.5));
  EXPECT_EQ(of_one.input, "a=b.ply");
  EXPECT_EQ(of_one.origin_w_m, glm::dvec3(-1, 2, 3));
  for (const char* const text : {"", "1,2", "a.ply", "a.ply=", "a.ply=1,2,x"}) {
    EXPECT_THAT([&] { parse_origin(text); }, ThrowsMessage<Error>(HasSubstr("--origin"))) << text;
  }
  EXPECT_EQ(parse_box("1,2,3,4,5,6").high_w_m, glm::dvec3(4, 5, 6));
  for (const char* const text : {"", "1,2,3", "1,2,3,4,5,inf", "1,2,3,4,5,3", "1,2,3,4,5,6,7"}) {
    EXPECT_THAT([&] { parse_box(text); }, ThrowsMessage<Error>(HasSubstr("--clip"))) << text;
  }
}

TEST(Still, ReportsOriginsThatApplyToNoInput) {
  std::vector<Opened> inputs = jacksboro();
  EXPECT_THAT([&] { place_inputs(inputs, {parse_origin("1,2,3")}); },
              ThrowsMessage<Error>(HasSubstr("--origin 1,2,3: no input")));
}

TEST(Still, ReportsMissingLayersAndColumns) {
  EXPECT_THAT([] { still_of(jacksboro(), {.view = {.colour_by = {"depth"}}}); },
              ThrowsMessage<Error>(HasSubstr("terrain=height")));
  EXPECT_THAT([] { still_of(jacksboro(), {.view = {.hide = {"sensors"}}}); },
              ThrowsMessage<Error>(HasSubstr("there are terrain")));
}

}  // namespace
}  // namespace groundray::offscreen_render_test
