#pragma once

// Private to the library: storage on disk for data that does not fit into memory.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace groundray {

/// Temporary file without a name: it disappears with the object, or with the process however that
/// ends.
class TemporaryFile {
 public:
  /// @throws Error naming the folder if no file can be created there.
  explicit TemporaryFile(const std::filesystem::path& folder);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Writes bytes at an offset. @throws Error naming the folder if the system does not accept them.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Reads bytes; any number of threads may call it. @throws Error naming the folder if bytes are
  /// missing.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path folder_;
  int file_ = -1;
};

}  // namespace groundray
