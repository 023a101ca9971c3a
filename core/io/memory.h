#pragma once

#include <string_view>

namespace groundray {

/// Returns the memory that the machine can still give and the process may still take, bytes:
/// MemAvailable of /proc/meminfo or, if less, what `ulimit -v` leaves. Infinity if unknown. The
/// limit of a container is not considered.
double available_memory_bytes();

/// Checks memory before it is taken for a file's content.
/// @param name  file, for the message
/// @param what  what takes the memory, in the plural: "its 4 x 4 pixels"
/// @throws Error if `bytes` exceed available_memory_bytes().
void require_memory(std::string_view name, std::string_view what, double bytes);

}  // namespace groundray
