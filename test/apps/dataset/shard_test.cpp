#include "apps/dataset/shard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace groundray::shard_test {
namespace {

TEST(Shard, ParsesIndexAndCount) {
  EXPECT_EQ(parse_shard("1/1"), (Shard{1, 1}));
  EXPECT_EQ(parse_shard("17/400"), (Shard{17, 400}));
  EXPECT_EQ(text_of({17, 400}), "17/400");
  for (const char* const text : {"", "/", "1", "1/", "/1", "0/1", "2/1", "-1/2", "1/-2", "+1/2",
                                 "1/2/3", " 1/2", "1/2 ", "1.0/2", "1/1000001", "1/4294967297"})
    EXPECT_FALSE(parse_shard(text)) << text;
}

// Each frame belongs to exactly one shard, and the shards' numbers of frames of a sensor differ by
// one at most.
TEST(Shard, DistributesFramesEvenly) {
  for (const std::uint32_t count : {1u, 2u, 3u, 7u, 40u}) {
    for (const std::int64_t frames : {1, 2, 5, 6, 39, 100}) {
      for (const std::uint32_t sensor : {0u, 1u, 5u}) {
        std::vector<std::int64_t> sizes(count);
        for (std::int64_t frame = 0; frame < frames; ++frame) {
          int owners = 0;
          for (std::uint32_t k = 0; k < count; ++k) {
            if (!Shard{k + 1, count}.has(sensor, frame, frames)) continue;
            ++owners;
            ++sizes[k];
          }
          EXPECT_EQ(owners, 1) << frame << " of " << frames << " by " << count;
        }
        for (std::uint32_t k = 0; k < count; ++k)
          EXPECT_EQ((Shard{k + 1, count}.share(sensor, frames)), sizes[k]);
        const auto [least, most] = std::ranges::minmax(sizes);
        EXPECT_LE(most - least, 1) << frames << " by " << count;
      }
    }
  }
}

TEST(Shard, HandlesNoFramesAndTheMaximumOfFrames) {
  EXPECT_EQ((Shard{2, 3}.share(0, 0)), 0);
  EXPECT_FALSE((Shard{2, 3}.has(0, 0, 0)));
  EXPECT_EQ((Shard{1, 1}.share(0, 4'294'967'295)), 4'294'967'295);
  EXPECT_EQ((Shard{1'000'000, 1'000'000}.share(7, 4'294'967'295)), 4294);
}

// Sensors with one frame each are distributed over the shards.
TEST(Shard, DistributesSensorsWithOneFrame) {
  for (std::uint32_t sensor = 0; sensor < 6; ++sensor)
    EXPECT_TRUE((Shard{1 + sensor % 3, 3}.has(sensor, 0, 1))) << sensor;
}

}  // namespace
}  // namespace groundray::shard_test
