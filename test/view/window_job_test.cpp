#include <atomic>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "apps/scene/interruption.h"
#include "apps/view/window/job.h"
#include "core/error.h"
#include "test/view/window_fixture.h"

namespace groundray::window_job_test {
namespace {

using namespace std::chrono_literals;
using testing::wait_until;

struct JobTest : public ::testing::Test {
  JobTest() { testing::application(); }

  Job::Hooks hooks() {
    return {.progress = [this](double share, const std::string&) { shares.push_back(share); },
            .failed = [this](const std::string& message) { fault = message; },
            .cancelled = [this] { is_cancelled = true; },
            .ended = [this] { ++ends; }};
  }

  // Waits for a request to stop and obeys it.
  static int wait_for_stop(const std::stop_token& stop) {
    while (!stop.stop_requested()) std::this_thread::sleep_for(1ms);
    throw Interrupted{};
  }

  std::vector<double> shares;
  std::string fault;
  bool is_cancelled = false;
  int ends = 0;
  int result = 0;
};

TEST_F(JobTest, RunsInAnotherThreadAndReturnsInThisOne) {
  Job job;
  const auto here = std::this_thread::get_id();
  std::thread::id worked, done;
  job.start(
      [&](const auto&, const JobProgress& reported) {
        worked = std::this_thread::get_id();
        reported(0.5, "half");
        return 42;
      },
      [&](int value) {
        done = std::this_thread::get_id();
        result = value;
      },
      hooks());
  EXPECT_TRUE(job.is_running());
  EXPECT_TRUE(wait_until([&] { return ends == 1; }));
  EXPECT_EQ(result, 42);
  EXPECT_NE(worked, here);
  EXPECT_EQ(done, here);
  EXPECT_EQ(shares, std::vector<double>{0.5});
  EXPECT_FALSE(job.is_running());
}

TEST_F(JobTest, ReportsErrors) {
  Job job;
  job.start([](const auto&, const auto&) -> int { throw Error("the file is gone"); },
            [&](int value) { result = value; }, hooks());
  EXPECT_TRUE(wait_until([&] { return ends == 1; }));
  EXPECT_EQ(fault, "the file is gone");
  job.start([](const auto&, const auto&) { return 1; },
            [](int) { throw Error("what came cannot be shown"); }, hooks());
  EXPECT_TRUE(wait_until([&] { return ends == 2; }));
  EXPECT_EQ(fault, "what came cannot be shown");
  EXPECT_EQ(result, 0);
}

TEST_F(JobTest, StopsOnRequest) {
  Job job;
  job.start([](const std::stop_token& stop, const auto&) { return wait_for_stop(stop); },
            [&](int value) { result = value; }, hooks());
  job.cancel();
  EXPECT_TRUE(wait_until([&] { return ends == 1; }));
  EXPECT_TRUE(is_cancelled);
  // Work that finishes in spite of a request to stop also counts as cancelled.
  is_cancelled = false;
  std::atomic<bool> may_end = false;
  job.start(
      [&](const auto&, const auto&) {
        while (!may_end) std::this_thread::sleep_for(1ms);
        return 7;
      },
      [&](int value) { result = value; }, hooks());
  job.cancel();
  may_end = true;
  EXPECT_TRUE(wait_until([&] { return ends == 2; }));
  EXPECT_TRUE(is_cancelled);
  EXPECT_EQ(result, 0);
}

TEST_F(JobTest, ReportsOnlyTheLastJob) {
  Job job;
  for (int i = 1; i <= 20; ++i) {
    job.start(
        [i](const std::stop_token& stop, const auto&) { return i < 20 ? wait_for_stop(stop) : i; },
        [&](int value) { result = value; }, hooks());
  }
  EXPECT_TRUE(wait_until([&] { return ends > 0; }));
  QTest::qWait(50);
  EXPECT_EQ(ends, 1);
  EXPECT_EQ(result, 20);
  EXPECT_FALSE(is_cancelled);
  job.start([](const std::stop_token& stop, const auto&) { return wait_for_stop(stop); },
            [&](int value) { result = value; }, hooks());
  job.abandon();
  EXPECT_FALSE(job.is_running());
  QTest::qWait(50);
  EXPECT_EQ(ends, 1);
}

TEST_F(JobTest, MayBeDestroyedWhileRunning) {
  std::atomic<bool> has_ended = false;
  {
    Job job;
    job.start(
        [&](const std::stop_token& stop, const JobProgress& reported) {
          while (!stop.stop_requested()) reported(0, "");
          has_ended = true;
          return 1;
        },
        [&](int value) { result = value; }, hooks());
    QTest::qWait(5);
  }
  EXPECT_TRUE(has_ended);  // the destructor waited for it
  QTest::qWait(20);
  EXPECT_EQ(result, 0);
  EXPECT_EQ(ends, 0);
}

}  // namespace
}  // namespace groundray::window_job_test
