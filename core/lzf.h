#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace groundray {

/// Returns the `size` bytes that `packed` stands for in the form of Lehmann's LibLZF.
/// @throws Error if they are more, fewer, or refer to bytes before the first.
std::string unpack_lzf(std::string_view packed, std::size_t size);

}  // namespace groundray
