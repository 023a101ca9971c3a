#include "test/device/host_arrays.h"

#include <sys/mman.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <system_error>

namespace groundray::testing {
namespace {

thread_local HostArrays* in_use = nullptr;
// Range of all arrays, which are never freed one by one. There is one HostArrays at a time.
std::byte *first = nullptr, *last = nullptr;

}  // namespace

HostArrays::HostArrays(std::size_t bytes) : size_(bytes) {
  // Kernels take any word of a pass that lies in the arrays for an address, also one of padding and
  // an `int`. Up to 2 GiB from here, no such word has the lower half of a positive `int`.
  constexpr std::uintptr_t place = 0x4000'8000'0000;
  // NOLINTNEXTLINE(performance-no-int-to-ptr)
  void* const memory = mmap(reinterpret_cast<void*>(place), bytes, PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  madvise(memory, bytes, MADV_HUGEPAGE);  // fewer pages change when arrays become unreachable
  begin_ = static_cast<std::byte*>(memory);
  first = begin_;
  last = begin_ + bytes;
}

HostArrays::~HostArrays() {
  first = last = nullptr;
  munmap(begin_, size_);
}

void HostArrays::set_reachable(bool is_reachable) const {
  if (mprotect(begin_, used_, is_reachable ? PROT_READ | PROT_WRITE : PROT_NONE) != 0)
    throw std::system_error(errno, std::generic_category(), "mprotect");
}

void* HostArrays::take(std::size_t bytes) {
  constexpr std::size_t alignment = 64;
  const std::size_t begin = (used_ + alignment - 1) / alignment * alignment;
  if (bytes > size_ - begin) throw std::bad_alloc();
  used_ = begin + bytes;
  return begin_ + begin;
}

HostArrays::Use::Use(HostArrays* arrays) noexcept : before_(in_use) { in_use = arrays; }
HostArrays::Use::~Use() { in_use = before_; }

}  // namespace groundray::testing

void* operator new(std::size_t bytes) {
  using groundray::testing::in_use;
  if (in_use != nullptr) return in_use->take(bytes);
  if (void* const memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept {
  const auto* const at = static_cast<std::byte*>(memory);
  if (at < groundray::testing::first || at >= groundray::testing::last) std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
