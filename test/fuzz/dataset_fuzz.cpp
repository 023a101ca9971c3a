#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "apps/dataset/frame_entry.h"

/// Whatever the line, what is read of it stays the same when it is written and read again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto entry = groundray::parse_entry(text)) {
    const std::string again = groundray::text_of(*entry);
    const auto read = groundray::parse_entry(again);
    if (!read || groundray::text_of(*read) != again) std::abort();
  }
  if (const auto file = groundray::parse_named_sum(text)) {
    if (groundray::text_of(*file) != text) std::abort();
  }
  return 0;
}
