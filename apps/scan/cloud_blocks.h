#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "apps/scan/cloud_file.h"

namespace groundray {

/// Reader for a large cloud in blocks of rows, each of which is parsed as read_cloud parses a file
/// of only these rows. It supports formats with rows of constant size: .npy in C order, .bin, and
/// binary .ply and .pcd.
class CloudBlocks {
 public:
  /// Opens a file. Returns nothing if the file is of another format, or its length does not match
  /// its header; read_cloud then reads it, or reports the fault.
  /// @param columns      as read_cloud.
  /// @param block_bytes  size of a block in the file; a block has at least one row.
  static std::optional<CloudBlocks> open(const std::filesystem::path& path,
                                         std::vector<std::string> columns, std::size_t block_bytes);

  /// Returns the next rows; nothing after the last. @throws Error as read_cloud.
  std::optional<CloudFile> next();

  /// Number of rows that have been read.
  std::uint64_t rows_read() const noexcept { return rows_read_; }

 private:
  CloudBlocks() = default;

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::vector<std::string> head_;  // header of a block, split at its number of rows
  std::size_t digits_ = 0;         // minimum width of that number
  std::ifstream file_;
  std::uint64_t rows_ = 0, rows_read_ = 0, block_rows_ = 1;
  std::size_t row_bytes_ = 0;
};

}  // namespace groundray
