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

/// Reads a large cloud some rows at a time, as read_cloud would read a file of these rows alone:
/// .npy in C's order, .bin, and binary .ply and .pcd, whose rows are all of one size.
class CloudBlocks {
 public:
  /// Returns nothing if the file is of another kind, or is not as long as it says: then read_cloud
  /// reads it, or tells what is wrong.
  /// @param columns      as read_cloud.
  /// @param block_bytes  of the file, for a block; a block has one row or more.
  static std::optional<CloudBlocks> open(const std::filesystem::path& path,
                                         std::vector<std::string> columns, std::size_t block_bytes);

  /// Returns the next rows; nothing after the last. @throws Error as read_cloud.
  std::optional<CloudFile> next();

  /// How many rows were read.
  std::uint64_t rows_read() const noexcept { return rows_read_; }

 private:
  CloudBlocks() = default;

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::vector<std::string> head_;  // of a block, with its number of rows between these
  std::size_t digits_ = 0;         // of that number, at least
  std::ifstream file_;
  std::uint64_t rows_ = 0, rows_read_ = 0, block_rows_ = 1;
  std::size_t row_bytes_ = 0;
};

}  // namespace groundray
