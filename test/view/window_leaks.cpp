// With the address sanitizer, leaks are checked while the application still exists. At exit, Qt's
// own threads end without being joined, and the sanitizer, which reads the storage of every thread,
// crashes if a thread is just ending.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#include <gtest/gtest.h>
#include <sanitizer/lsan_interface.h>

namespace groundray::window_leaks {
namespace {

struct LeakCheck : public ::testing::Environment {
  void TearDown() override { __lsan_do_leak_check(); }  // replaces the check at exit
};

[[maybe_unused]] const ::testing::Environment* const leak_check =
    ::testing::AddGlobalTestEnvironment(new LeakCheck);

}  // namespace
}  // namespace groundray::window_leaks
#endif
#endif
