// Under the address sanitizer leaks are looked for while the application still stands. At exit Qt's
// own threads end unjoined, and the sanitizer, which reads the storage of every thread, crashes if
// it meets one that is just going.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#include <gtest/gtest.h>
#include <sanitizer/lsan_interface.h>

namespace groundray::window_leaks {
namespace {

struct LeakCheck : public ::testing::Environment {
  void TearDown() override { __lsan_do_leak_check(); }  // the one at exit is then left out
};

[[maybe_unused]] const ::testing::Environment* const leak_check =
    ::testing::AddGlobalTestEnvironment(new LeakCheck);

}  // namespace
}  // namespace groundray::window_leaks
#endif
#endif
