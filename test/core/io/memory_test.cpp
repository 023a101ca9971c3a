#include "core/io/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace groundray::memory_test {
namespace {

TEST(Memory, IsRequiredBeforeItIsTaken) {
  EXPECT_GT(available_memory_bytes(), 0);
  EXPECT_LT(available_memory_bytes(), 0x1p50);
  EXPECT_NO_THROW(require_memory("a.png", "its pixels", 0x1p20));
  EXPECT_THAT([] { require_memory("a.png", "its pixels", 0x1p60); },
              ::testing::ThrowsMessage<Error>(::testing::StartsWith(
                  "a.png: its pixels take 1073741824.0 GiB of memory, but ")));
}

}  // namespace
}  // namespace groundray::memory_test
