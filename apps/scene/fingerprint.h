#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/appearance/material.h"

namespace groundray {

/// FNV-1a hash of the input values of a run, which distinguishes runs with equal scene files.
class Fingerprint {
 public:
  /// Adds values of a type without padding.
  template <typename T>
  void add(std::span<const T> values) {
    for (const std::byte byte : std::as_bytes(values)) {
      value_ = (value_ ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3;
    }
  }
  template <typename... T>
  void add_all(const T&... values) {
    (add(std::span<const T>(&values, 1)), ...);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

/// Returns the fingerprint of a material, including its name.
std::uint64_t fingerprint_of(const Material& material);

}  // namespace groundray
