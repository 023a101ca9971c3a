#include "core/appearance/seams.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/error.h"

namespace groundray::seams_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Waves of which `columns` and `rows` periods fit the image.
Image8 waves(double columns, double rows) {
  Image8 image(64, 48, 3);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double phase = 2 * std::numbers::pi * (columns * x / 64 + rows * y / 48);
      for (std::uint8_t& value : image.at(x, y))
        value = static_cast<std::uint8_t>(128 + 100 * std::sin(phase));
    }
  }
  return image;
}

TEST(Seams, AreAbsentFromPeriodicImages) {
  for (const auto& [columns, rows] : {std::pair{1, 1}, {3, 0}, {0, 2}, {5, 7}})
    EXPECT_NO_THROW(require_seamless(waves(columns, rows), "waves.png"));
  EXPECT_NO_THROW(require_seamless(Image8(4, 4, 1), "black.png"));
}

TEST(Seams, AreReportedWithFileAndEdges) {
  EXPECT_THAT([] { require_seamless(waves(2, 1.5), "soil.png"); },
              ThrowsMessage<Error>(AllOf(
                  HasSubstr("soil.png: it does not tile: its top and bottom edges differ by"),
                  HasSubstr("make the image seamless, or omit 'tiling' to accept the seam"))));
  EXPECT_THAT([] { require_seamless(waves(2.5, 1), "soil.png"); },
              ThrowsMessage<Error>(HasSubstr("its left and right edges differ by")));
}

}  // namespace
}  // namespace groundray::seams_test
