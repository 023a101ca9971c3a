#pragma once

// Private to the library: room on disk for what does not fit into memory.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace groundray {

/// A file without a name: it goes with the object, and with the process whatever ends that.
class NamelessFile {
 public:
  /// @throws Error that names the folder if no file can be made there.
  explicit NamelessFile(const std::filesystem::path& folder);
  ~NamelessFile();
  NamelessFile(const NamelessFile&) = delete;
  NamelessFile& operator=(const NamelessFile&) = delete;

  /// @throws Error that names the folder if the system does not take the bytes.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Any number of threads may read. @throws Error that names the folder if bytes are missing.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path folder_;
  int file_ = -1;
};

}  // namespace groundray
