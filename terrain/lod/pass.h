#pragma once

#include <concepts>
#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

namespace groundray {

/// Calls `work(begin, end)` for ranges that cover [0, count) once, by oneTBB on all threads.
void run_in_parallel(std::size_t count,
                     const std::function<void(std::size_t begin, std::size_t end)>& work);

/// Processor that runs passes in place of the CPU's threads, for instance a GPU. A pass is a
/// structure with pointers to the arrays that it reads and writes.
class PassDevice {
 public:
  PassDevice() = default;
  PassDevice(const PassDevice&) = delete;
  PassDevice& operator=(const PassDevice&) = delete;
  virtual ~PassDevice() = default;

  /// Runs a pass for each index below `count`, and returns when its arrays are written.
  /// @param name   of the pass: `Pass::name`.
  /// @param bytes  of the pass.
  virtual void run(std::string_view name, std::span<const std::byte> bytes, std::size_t count) = 0;
};

/// Runner of passes, in any order and on any number of threads. The results of a pass depend on
/// neither, because each index writes only its own outputs; nor do they depend on the lengths of
/// runs.
struct PassRunner {
  using Work = std::function<void(std::size_t begin, std::size_t end)>;

  std::function<void(std::size_t count, const Work& work)> on_host = run_in_parallel;
  PassDevice* device = nullptr;  ///< runs the passes that have a name, if there is one
  int run_nodes = 64;            ///< nodes in a row that are one index of a pass over nodes
  int run_samples = 256;         ///< about as many samples or counts are one index of other passes

  PassRunner() = default;
  /// @param host  calls `work(begin, end)` for ranges that cover [0, count) once.
  template <typename Host>
    requires std::invocable<const Host&, std::size_t, const Work&>
  PassRunner(Host host) : on_host(std::move(host)) {}  // NOLINT(google-explicit-constructor)
  explicit PassRunner(PassDevice& on) : device(&on) {}
};

/// Runs `pass(index)` for each index below `count`.
template <typename Pass>
void run_pass(const PassRunner& runner, std::size_t count, const Pass& pass) {
  if constexpr (requires { Pass::name; }) {
    static_assert(std::is_trivially_copyable_v<Pass>);
    if (runner.device != nullptr)
      return runner.device->run(Pass::name, std::as_bytes(std::span(&pass, 1)), count);
  }
  runner.on_host(count, [&pass](std::size_t begin, std::size_t end) {
    for (std::size_t index = begin; index < end; ++index) pass(index);
  });
}

}  // namespace groundray
