#include "core/image/flow_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/png_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::flow_io_test {
namespace {

using ::testing::HasSubstr;
using testing::read_png16;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

ImageF random_flow() {
  ImageF flow_px(23, 17, 2);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> offset_px(-400, 400);
  for (float& value : flow_px.values()) value = offset_px(random);
  return flow_px;
}

template <typename T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

TEST(WriteFlo, MatchesTheFormat) {
  const TemporaryFolder folder;
  ImageF flow_px = random_flow();
  flow_px.at(3, 2)[0] = std::numeric_limits<float>::quiet_NaN();
  flow_px.at(4, 2)[1] = -std::numeric_limits<float>::infinity();
  write_flo(folder / "a.flo", flow_px);
  const std::string bytes = read_text(folder / "a.flo");
  ASSERT_EQ(bytes.size(), 12u + 8 * 23 * 17);
  EXPECT_EQ(bytes.substr(0, 4), "PIEH");
  EXPECT_EQ(value_at<std::int32_t>(bytes, 4), 23);
  EXPECT_EQ(value_at<std::int32_t>(bytes, 8), 17);
  for (int y = 0; y < 17; ++y) {
    for (int x = 0; x < 23; ++x) {
      const bool is_unknown = y == 2 && (x == 3 || x == 4);
      for (std::size_t i = 0; i < 2; ++i) {
        const auto offset = 12 + 4 * (static_cast<std::size_t>(y * 23 + x) * 2 + i);
        const auto value = value_at<float>(bytes, offset);
        if (is_unknown) {
          EXPECT_GT(value, 1e9f);
        } else {
          EXPECT_EQ(value, flow_px.at(x, y)[i]);
        }
      }
    }
  }
}

TEST(WriteKittiFlow, StoresKnownFlowTo64thsOfAPixel) {
  const TemporaryFolder folder;
  ImageF flow_px = random_flow();
  flow_px.at(3, 2)[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(write_kitti_flow(folder / "a.png", flow_px), 0u);
  const Image16 codes = read_png16(folder / "a.png");
  ASSERT_EQ(codes.channels(), 3);
  ASSERT_EQ(codes.width(), 23);
  ASSERT_EQ(codes.height(), 17);
  for (int y = 0; y < 17; ++y) {
    for (int x = 0; x < 23; ++x) {
      const auto code = codes.at(x, y);
      const bool is_known = !(x == 3 && y == 2);
      ASSERT_EQ(code[2], is_known ? 1 : 0);
      for (std::size_t i = 0; i < 2 && is_known; ++i)
        EXPECT_NEAR((code[i] - 32768) / 64.0, flow_px.at(x, y)[i], 1.0 / 128);
    }
  }
}

TEST(WriteKittiFlow, OmitsAndCountsFlowOutOfRange) {
  const TemporaryFolder folder;
  ImageF flow_px(6, 1, 2);
  const std::array u_px{-512.0f, 511.984f, -512.1f,
                        512.0f,  1e8f,     std::numeric_limits<float>::infinity()};
  for (int x = 0; x < 6; ++x) flow_px.at(x, 0)[0] = u_px[static_cast<std::size_t>(x)];
  EXPECT_EQ(write_kitti_flow(folder / "a.png", flow_px), 3u);
  const Image16 codes = read_png16(folder / "a.png");
  EXPECT_THAT(codes.values(), ::testing::ElementsAre(0, 32768, 1, 65535, 32768, 1,  //
                                                     0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
}

TEST(WriteFlow, RejectsOtherChannelCounts) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { write_flo(folder / "a.flo", ImageF(2, 2, 3)); },
              ThrowsMessage<Error>(HasSubstr("must have 2 channels, u and v; this has 3")));
  EXPECT_THAT([&] { write_kitti_flow(folder / "a.png", ImageF(2, 2, 1)); },
              ThrowsMessage<Error>(HasSubstr("must have 2 channels, u and v; this has 1")));
}

}  // namespace
}  // namespace groundray::flow_io_test
