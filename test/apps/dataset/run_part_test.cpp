#include "apps/dataset/run_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace groundray::run_part_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

const std::vector<RunSensor> run{{"top", 3}, {"front", 2}, {"eye", 30}};

TEST(FrameChoice, TextsRoundTrip) {
  for (const char* text : {"--sensor top", "--sensor top,eye", "--frames 2:5", "--frames 0:8:2",
                           "--frames 4:", "--sensor eye --frames 1:2"}) {
    const auto choice = parse_choice(text);
    ASSERT_TRUE(choice) << text;
    EXPECT_EQ(text_of(*choice), text);
  }
  EXPECT_THAT(text_of(FrameChoice{}), IsEmpty());
}

TEST(FrameChoice, OtherTextsAreRejected) {
  for (const char* text : {"", "--sensor", "top", "--frames x", "--frames 5:2", "--frames :5",
                           "--sensor top  --frames 1:2", "--frames 1:2 --sensor top"})
    EXPECT_FALSE(parse_choice(text)) << text;
}

TEST(FrameChoice, CountsAsManyFramesAsItContains) {
  for (std::size_t first = 0; first < 6; ++first) {
    for (std::size_t end = first + 1; end < 8; ++end) {
      for (std::size_t step = 1; step < 4; ++step) {
        const FrameChoice choice{.sensors = {}, .frames = {first, end, step}};
        for (std::int64_t frames = 0; frames < 10; ++frames) {
          std::int64_t contained = 0;
          for (std::int64_t frame = 0; frame < frames; ++frame)
            contained += choice.frames.contains(static_cast<std::size_t>(frame)) ? 1 : 0;
          EXPECT_EQ(choice.count(frames), contained);
        }
      }
    }
  }
}

TEST(FrameChoice, SensorsAreInTheOrderOfTheRun) {
  EXPECT_THAT(checked_choice({.sensors = {"eye", "top", "eye"}, .frames = {}}, run).sensors,
              ElementsAre("top", "eye"));
  EXPECT_THAT(checked_choice({.sensors = {"eye", "front", "top"}, .frames = {}}, run).sensors,
              IsEmpty());
}

TEST(FrameChoice, UnknownSensorsAndFramesAreErrors) {
  EXPECT_THAT([] { checked_choice({.sensors = {"fornt"}, .frames = {}}, run); },
              ThrowsMessage<Error>(AllOf(HasSubstr("no sensor 'fornt'; did you mean 'front'?"),
                                         HasSubstr("top, front, eye"))));
  const FrameRange late{.first = 2};
  EXPECT_EQ(checked_choice({.sensors = {"top"}, .frames = late}, run).frames.first, 2u);
  EXPECT_THAT([&] { checked_choice({.sensors = {"front"}, .frames = late}, run); },
              ThrowsMessage<Error>(HasSubstr("those of front are numbered from 0 to 1")));
}

}  // namespace
}  // namespace groundray::run_part_test
