#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace groundray {

/// Returns the `size` bytes that `packed` encodes in the format of Lehmann's LibLZF.
/// @throws Error if `packed` encodes more or fewer, or refers to bytes before the first.
std::string unpack_lzf(std::string_view packed, std::size_t size);

}  // namespace groundray
