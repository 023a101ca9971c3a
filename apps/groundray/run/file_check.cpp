#include "apps/groundray/run/file_check.h"

#include <fmt/format.h>

#include <system_error>

#include "core/error.h"

namespace groundray {

std::optional<std::string> fault_of(const std::filesystem::path& file, const FileSum& as_written) {
  std::error_code fault;
  const std::filesystem::file_status status = std::filesystem::status(file, fault);
  if (status.type() == std::filesystem::file_type::not_found) return "missing";
  if (status.type() == std::filesystem::file_type::none) return "unreadable: " + fault.message();
  if (!std::filesystem::is_regular_file(status)) return "not a regular file";
  if (const auto bytes = std::filesystem::file_size(file, fault);
      !fault && bytes != as_written.bytes) {
    return fmt::format("has {} bytes instead of {}: {}", bytes, as_written.bytes,
                       bytes < as_written.bytes ? "truncated" : "data was appended");
  }
  try {
    if (sum_file(file) == as_written) return std::nullopt;
  } catch (const Error&) {
    return "unreadable";
  }
  return "changed: its SHA-256 differs";
}

}  // namespace groundray
