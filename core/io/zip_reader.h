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
  std::uint64_t header = 0;       ///< position of its local header
  std::uint32_t checksum = 0;     ///< CRC-32 of the unpacked bytes
  std::uint16_t method = 0;       ///< 0 stored, 8 deflated
};

/// Returns the members of an archive in its directory's order; ZIP64 is supported.
/// @throws Error if `bytes` are not an archive, are truncated or damaged, or are of several
///         volumes, or if a member is encrypted.
/// @see PKWARE, .ZIP File Format Specification (APPNOTE), 4.3.
std::vector<ZipMember> zip_members(std::string_view bytes);

/// Returns a member's unpacked bytes.
/// @throws Error if it is neither stored nor deflated, or damaged.
std::string unpack_member(std::string_view bytes, const ZipMember& member);

}  // namespace groundray
