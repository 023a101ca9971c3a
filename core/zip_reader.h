#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace groundray {

/// A file within a ZIP archive.
struct ZipMember {
  std::string name;
  std::uint64_t size = 0;         ///< bytes, unpacked
  std::uint64_t packed_size = 0;  ///< bytes in the archive
  std::uint64_t header = 0;       ///< where its own header begins
  std::uint32_t checksum = 0;     ///< CRC-32 of the unpacked bytes
  std::uint16_t method = 0;       ///< 0 as it is, 8 deflated
};

/// Returns the members of an archive in its directory's order; ZIP64 is understood.
/// @throws Error if `bytes` are no archive, cut short, or of several volumes.
/// @see PKWARE, .ZIP File Format Specification (APPNOTE), 4.3.
std::vector<ZipMember> zip_members(std::string_view bytes);

/// Returns a member's unpacked bytes.
/// @throws Error if it is encrypted, packed by another method than deflate, or damaged.
std::string unpack_member(std::string_view bytes, const ZipMember& member);

}  // namespace groundray
