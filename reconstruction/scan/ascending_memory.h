#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace groundray {

/// Memory that is handed out in ascending order, for structures that compare addresses: what they
/// do is then the same whatever was in memory before. The thread's is the one made last: those who
/// use it are told of no other, since CGAL's allocators are of a type alone.
class AscendingMemory {
 public:
  /// @param bytes  that are there; what is asked for beyond comes from elsewhere, in any order.
  explicit AscendingMemory(std::size_t bytes)
      : outer_(current()),
        bytes_(bytes),
        block_(std::make_unique_for_overwrite<std::byte[]>(bytes)) {
    current() = this;
  }
  ~AscendingMemory() { current() = outer_; }
  AscendingMemory(const AscendingMemory&) = delete;
  AscendingMemory& operator=(const AscendingMemory&) = delete;

  /// Returns that of this thread, or nothing.
  static AscendingMemory*& current() noexcept {
    static thread_local AscendingMemory* memory = nullptr;
    return memory;
  }

  /// Returns nothing if too little is left.
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

  /// Whether more was asked for than there is. It is not thrown: what is amid a change of its
  /// structure could not be taken down.
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

/// Allocates from the thread's AscendingMemory. Nothing is given back before that goes.
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
