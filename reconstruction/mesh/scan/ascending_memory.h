#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace groundray {

/// Memory handed out in ascending order of addresses, for structures that compare addresses: their
/// behaviour is then independent of earlier memory use. The latest instance on a thread is current;
/// allocators use the current one, because CGAL specifies allocators by type only.
class AscendingMemory {
 public:
  /// @param bytes  capacity; memory beyond it comes from std::allocator, in any order.
  explicit AscendingMemory(std::size_t bytes)
      : outer_(current()),
        bytes_(bytes),
        block_(std::make_unique_for_overwrite<std::byte[]>(bytes)) {
    current() = this;
  }
  ~AscendingMemory() { current() = outer_; }
  AscendingMemory(const AscendingMemory&) = delete;
  AscendingMemory& operator=(const AscendingMemory&) = delete;

  /// Returns the current instance of this thread, or nullptr.
  static AscendingMemory*& current() noexcept {
    static thread_local AscendingMemory* memory = nullptr;
    return memory;
  }

  /// Returns memory, or nullptr if too little is left.
  void* take(std::size_t bytes, std::size_t alignment) noexcept {
    void* place = block_.get() + used_;
    std::size_t left = bytes_ - used_;
    if (std::align(alignment, bytes, place, left) == nullptr) {
      is_used_up_ = true;
      return nullptr;
    }
    used_ = bytes_ - left + bytes;
    return place;
  }

  std::size_t bytes() const noexcept { return bytes_; }

  /// Returns true if more than the capacity was requested. Reported instead of thrown: an exception
  /// during insertion would leave CGAL's structure inconsistent.
  bool is_used_up() const noexcept { return is_used_up_; }

  bool owns(const void* place) const noexcept {
    const std::less<const void*> is_before;
    return !is_before(place, block_.get()) && is_before(place, block_.get() + bytes_);
  }

 private:
  AscendingMemory* outer_;
  std::size_t bytes_, used_ = 0;
  bool is_used_up_ = false;
  std::unique_ptr<std::byte[]> block_;
};

/// Allocates from the thread's AscendingMemory, which frees all of it at once when destroyed.
template <typename T>
struct AscendingAllocator {
  using value_type = T;

  AscendingAllocator() = default;
  template <typename U>  // NOLINTNEXTLINE(google-explicit-constructor): as allocators convert
  AscendingAllocator(const AscendingAllocator<U>&) noexcept {}

  T* allocate(std::size_t count) {
    AscendingMemory* memory = AscendingMemory::current();
    void* place = memory == nullptr ? nullptr : memory->take(count * sizeof(T), alignof(T));
    return place != nullptr ? static_cast<T*>(place) : std::allocator<T>().allocate(count);
  }

  void deallocate(T* place, std::size_t count) noexcept {
    const AscendingMemory* memory = AscendingMemory::current();
    if (memory == nullptr || !memory->owns(place)) std::allocator<T>().deallocate(place, count);
  }

  friend bool operator==(const AscendingAllocator&, const AscendingAllocator&) { return true; }
};

}  // namespace groundray
