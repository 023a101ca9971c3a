#include <QTest>
#include <array>
#include <fstream>

#include "apps/view/window/panels/picture_area.h"
#include "apps/view/window/window.h"
#include "core/image/image_io.h"
#include "core/image/png_io.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_image_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using testing::wait_until;
using WindowImageTest = testing::WindowTest;

void write_picture(const std::filesystem::path& path, int width_px) {
  Image8 picture(width_px, 24, 3);
  for (std::size_t i = 0; i < picture.values().size(); ++i) {
    picture.values()[i] = static_cast<std::uint8_t>(i * 7 % 256);
  }
  write_png(path, picture);
}

// Writes an uncompressed TIFF 6.0 file with 3 bands of bytes in one strip, without a library.
void write_tiff(const std::filesystem::path& path, std::uint32_t width_px,
                std::uint32_t height_px) {
  std::string bytes = "II";
  const auto put = [&](std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xffU));
  };
  constexpr std::uint32_t is_short = 3, is_long = 4, entries = 10;
  constexpr std::uint32_t bits_at = 8 + 2 + 12 * entries + 4, pixels_at = bits_at + 6;
  put(42, 2);
  put(8, 4);
  put(entries, 2);
  const std::array<std::array<std::uint32_t, 4>, entries> tags{
      {{256, is_long, 1, width_px},
       {257, is_long, 1, height_px},
       {258, is_short, 3, bits_at},
       {259, is_short, 1, 1},
       {262, is_short, 1, 2},
       {273, is_long, 1, pixels_at},
       {277, is_short, 1, 3},
       {278, is_long, 1, height_px},
       {279, is_long, 1, 3 * width_px * height_px},
       {284, is_short, 1, 1}}};
  for (const auto& [tag, type, count, value] : tags) {
    put(tag, 2);
    put(type, 2);
    put(count, 4);
    put(value, 4);
  }
  put(0, 4);
  for (int i = 0; i < 3; ++i) put(8, 2);
  for (std::uint32_t i = 0; i < 3 * width_px * height_px; ++i) put(i * 5 % 256, 1);
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(WindowImageTest, PictureWithoutCameraHasNoRay) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_picture(folder / "picture.png", 64);
  open(SampleDataset::get().path());
  window.timeline_panel().go_to(window.timeline_panel().timeline()->end());
  settle();
  ImagePanel& panel = window.image_panel();
  const auto click = [&] {
    const QPoint place = panel.area().place_of({31, 20}).toPoint();
    QTest::mouseClick(&panel.area(), Qt::LeftButton, Qt::NoModifier, place);
  };
  click();
  EXPECT_NE(window.view().find("picked/ray"), nullptr);
  open(folder / "picture.png");  // while the dataset's camera has a frame at this time
  ASSERT_TRUE(panel.shown());
  EXPECT_EQ(panel.shown()->timeline, nullptr);
  click();
  EXPECT_EQ(window.view().find("picked/ray"), nullptr);
  EXPECT_NE(window.picked().value("picture"), "");
}

TEST_F(WindowImageTest, ShowsTiffFiles) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_tiff(folder / "colours.tif", 40, 30);
  open(folder / "colours.tif");
  EXPECT_EQ(dismiss_fault(), "");
  ASSERT_NE(window.image_panel().image(), nullptr);
  const RecordedImage& image = *window.image_panel().image();
  EXPECT_EQ(image.size_px(), glm::ivec2(40, 30));
  EXPECT_EQ(image.numbers_at(0, {1, 0}), (std::vector<double>{15, 20, 25}));
}

TEST_F(WindowImageTest, ClearedImageDoesNotReappear) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_picture(folder / "picture.png", 64);
  ImagePanel& panel = window.image_panel();
  panel.show_image({.title = "picture", .file = folder / "picture.png"});
  panel.clear();
  EXPECT_FALSE(panel.is_busy());
  QTest::qWait(300);
  EXPECT_EQ(panel.image(), nullptr);
}

TEST_F(WindowImageTest, BrokenImageDoesNotBlockTheNext) {
  Window& window = shown();
  const TemporaryFolder folder;
  std::ofstream(folder / "broken.png") << "no picture";
  write_picture(folder / "whole.png", 48);
  ImagePanel& panel = window.image_panel();
  panel.show_image({.title = "broken", .file = folder / "broken.png"});
  panel.show_image({.title = "whole", .file = folder / "whole.png"});
  EXPECT_TRUE(wait_until([&] { return panel.image() != nullptr; }, 20'000));
  EXPECT_EQ(panel.shown()->title, "whole");
  EXPECT_NE(dismiss_fault().find("broken.png"), std::string::npos);
}

}  // namespace
}  // namespace groundray::window_image_test
