#include "test/device/kernel_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>

namespace groundray::testing {
namespace {

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Makes the host's arrays unreachable until its end.
class Unreachable {
 public:
  explicit Unreachable(const HostArrays& arrays) : arrays_(arrays) { arrays_.set_reachable(false); }
  ~Unreachable() { arrays_.set_reachable(true); }
  Unreachable(const Unreachable&) = delete;
  Unreachable& operator=(const Unreachable&) = delete;

 private:
  const HostArrays& arrays_;
};

}  // namespace

KernelCode read_kernels(const std::filesystem::path& folder) {
  KernelCode code{.spirv = read_file(folder / "passes.spv"),
                  .spir = read_file(folder / "passes.spir"),
                  .ptx = read_file(folder / "passes.ptx"),
                  .code_objects = {}};
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.path().extension() == ".hsaco") code.code_objects.push_back(read_file(file.path()));
  }
  return code;
}

void KernelDevice::run(std::string_view pass, std::span<const std::byte> bytes, std::size_t count) {
  if (count == 0) return;
  const HostArrays::Use elsewhere(nullptr);
  const auto begin = std::chrono::steady_clock::now();
  // Whole words, as the kernel reads them.
  std::vector<std::byte> words(bytes.begin(), bytes.end());
  words.resize((words.size() + 7) / 8 * 8);
  if (words.size() > most_of_a_pass)
    throw std::runtime_error(fmt::format("{}: {} bytes are too many", pass, words.size()));
  const std::span<std::byte> used(arrays_.begin(), arrays_.used());
  write(Memory::Pass, words);
  write(Memory::Arrays, used);
  {
    const Unreachable while_running(arrays_);
    last_.kernel_ms = launch({.kernel = pass,
                              .groups = (count + group - 1) / group,
                              .indices = count,
                              .host = reinterpret_cast<std::uintptr_t>(arrays_.begin()),
                              .size = arrays_.size()});
  }
  read(used);
  const std::chrono::duration<double, std::milli> all = std::chrono::steady_clock::now() - begin;
  last_.all_ms = all.count();
}

}  // namespace groundray::testing
