#pragma once

#include <cstdint>
#include <string_view>

namespace groundray {

/// Returns the FNV-1a hash of a text. It does not resist deliberate collisions.
constexpr std::uint64_t byte_hash(std::string_view bytes) noexcept {
  std::uint64_t value = 0xcbf29ce484222325;
  for (const char c : bytes) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return value;
}

}  // namespace groundray
