#pragma once

#include <cstddef>

namespace groundray::testing {

/// Memory of the host for the arrays of passes. While a HostArrays::Use exists, `new` takes memory
/// from it on the thread that made the Use; nothing is returned until `clear`. A device can thus
/// copy all arrays at once, and tests can make them unreachable while it runs.
class HostArrays {
 public:
  /// @param bytes  of address space; memory is taken as it is used.
  explicit HostArrays(std::size_t bytes);
  ~HostArrays();
  HostArrays(const HostArrays&) = delete;
  HostArrays& operator=(const HostArrays&) = delete;

  std::byte* begin() const noexcept { return begin_; }
  std::size_t size() const noexcept { return size_; }
  /// Returns the number of bytes used, from the beginning.
  std::size_t used() const noexcept { return used_; }

  bool holds(const void* address) const noexcept {
    const auto* const at = static_cast<const std::byte*>(address);
    return at >= begin_ && at < begin_ + used_;
  }

  /// Makes all arrays unreachable, or reachable again.
  void set_reachable(bool is_reachable) const;

  void* take(std::size_t bytes);
  /// Frees all memory; nothing that was allocated in it may still be used.
  void clear() noexcept { used_ = 0; }

  /// Lets `new` take memory from arrays, or from nowhere special (nullptr), until its end.
  class Use {
   public:
    explicit Use(HostArrays* arrays) noexcept;
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    HostArrays* before_;
  };

 private:
  std::byte* begin_ = nullptr;
  std::size_t size_ = 0, used_ = 0;
};

}  // namespace groundray::testing
