#pragma once

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

namespace groundray {

/// Returns a text in which control characters, except line ends and tabs, are written as `\x1b`,
/// and so are bytes that are not UTF-8: names from files must not control the terminal.
std::string printable(std::string_view text);

/// Prints to a stream as fmt::print does, but printable.
template <typename... Args>
void print_text(std::FILE* to, fmt::format_string<Args...> form, Args&&... args) {
  const std::string text = printable(fmt::format(form, std::forward<Args>(args)...));
  std::fwrite(text.data(), 1, text.size(), to);
}

/// Prints to standard error. A failure is ignored: there is nowhere to report it.
template <typename... Args>
void print_error(fmt::format_string<Args...> form, Args&&... args) noexcept {
  try {
    print_text(stderr, form, std::forward<Args>(args)...);
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
