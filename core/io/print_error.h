#pragma once

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <string>
#include <utility>

namespace groundray {

/// Prints to standard error. A failure is ignored: there is nowhere to report it.
template <typename... Args>
void print_error(fmt::format_string<Args...> form, Args&&... args) noexcept {
  try {
    const std::string text = fmt::format(form, std::forward<Args>(args)...);
    std::fwrite(text.data(), 1, text.size(), stderr);
  } catch (...) {  // there is not enough memory
    std::fputs("groundray: an error cannot be printed\n", stderr);
  }
}

/// Writes what standard output still holds.
/// @return false if that, or something before, could not be written; true if its reader has closed
///         it.
inline bool flush_output() noexcept {
  const bool has_failed = std::ferror(stdout) != 0;
  return std::fflush(stdout) == 0 ? !has_failed : errno == EPIPE;
}

}  // namespace groundray
