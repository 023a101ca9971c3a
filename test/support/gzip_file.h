#pragma once

#include <zlib.h>

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace groundray::testing {

/// Returns the unpacked bytes of a .gz file. @throws std::runtime_error if it cannot be read.
inline std::string read_gzip(const std::filesystem::path& path) {
  gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) throw std::runtime_error(path.string() + " cannot be opened");
  std::string bytes;
  std::array<char, 1 << 16> block;
  int count = 0;
  while ((count = gzread(file, block.data(), block.size())) > 0)
    bytes.append(block.data(), static_cast<std::size_t>(count));
  if (gzclose(file) != Z_OK || count < 0) throw std::runtime_error(path.string() + " is damaged");
  return bytes;
}

}  // namespace groundray::testing
