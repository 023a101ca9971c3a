#include "apps/dataset/write/background_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace groundray::background_writer_test {
namespace {

using namespace std::chrono_literals;

TEST(BackgroundWriter, RunsJobsInOrder) {
  std::vector<int> done;
  std::atomic<int> at_once = 0, most_at_once = 0;
  BackgroundWriter writer;
  for (int i = 0; i < 50; ++i) {
    writer.begin([&, i] {
      most_at_once = std::max(most_at_once.load(), ++at_once);
      done.push_back(i);
      --at_once;
    });
  }
  writer.wait();
  ASSERT_EQ(done.size(), 50u);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
  EXPECT_EQ(most_at_once, 1);
}

// The caller continues while a job runs; otherwise this test would never end.
TEST(BackgroundWriter, DoesNotBlockItsCaller) {
  std::atomic<bool> has_gone_on = false;
  BackgroundWriter writer;
  writer.begin([&] {
    while (!has_gone_on) std::this_thread::yield();
  });
  has_gone_on = true;
  writer.wait();
}

TEST(BackgroundWriter, ReportsTheExceptionOfAJobOnce) {
  BackgroundWriter writer;
  bool is_begun = false;
  writer.begin([] { throw std::runtime_error("full"); });
  EXPECT_THROW(writer.begin([&] { is_begun = true; }), std::runtime_error);
  writer.wait();
  EXPECT_FALSE(is_begun);
}

// Returns the message of the exception that a caller which failed with `callers` throws once its
// job has ended.
template <typename Callers, typename Job>
std::string failure(const Callers& callers, const Job& job) {
  BackgroundWriter writer;
  writer.begin(job);
  try {
    writer.fail(std::make_exception_ptr(callers));
  } catch (const std::exception& fault) {
    return fault.what();
  } catch (const int& stop) {
    return std::to_string(stop);
  }
}

TEST(BackgroundWriter, ReportsItsOwnErrorBesideTheCallers) {
  const auto full = [] { throw std::runtime_error("full"); };
  const auto well = [] {};
  EXPECT_EQ(failure(std::runtime_error("torn"), full), "torn\nfull");
  EXPECT_EQ(failure(std::runtime_error("torn"), well), "torn");
  EXPECT_EQ(failure(7, full), "full");  // 7 acts as a request to stop: no message
  EXPECT_EQ(failure(7, well), "7");
}

TEST(BackgroundWriter, DestructorWaitsForTheJob) {
  bool is_done = false;
  {
    BackgroundWriter writer;
    auto owned = std::make_unique<int>(3);  // jobs can be move-only
    writer.begin([&is_done, owned = std::move(owned)] {
      std::this_thread::sleep_for(20ms);
      is_done = *owned == 3;
    });
  }
  EXPECT_TRUE(is_done);
}

}  // namespace
}  // namespace groundray::background_writer_test
