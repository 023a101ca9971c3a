#include "core/io/zip_reader.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>

#include "core/error.h"
#include "core/io/memory.h"

namespace groundray {
namespace {

constexpr std::string_view end_mark("PK\5\6", 4), end64_mark("PK\6\6", 4),
    locator_mark("PK\6\7", 4), entry_mark("PK\1\2", 4), member_mark("PK\3\4", 4);
constexpr std::size_t end_bytes = 22, end64_bytes = 56, locator_bytes = 20, entry_bytes = 46,
                      member_bytes = 30;
constexpr std::uint64_t unknown_32 = 0xffffffff;  // the ZIP64 record holds the number

/// Returns `count` bytes from `offset` on.
std::string_view part_of(std::string_view bytes, std::uint64_t offset, std::uint64_t count) {
  if (offset > bytes.size() || count > bytes.size() - offset) {
    throw Error("the ZIP archive refers to data beyond its end: is it truncated?");
  }
  return bytes.substr(offset, count);
}

template <typename T>
T number_at(std::string_view bytes, std::uint64_t offset) {
  std::array<char, sizeof(T)> raw{};
  part_of(bytes, offset, sizeof(T)).copy(raw.data(), sizeof(T));
  return std::bit_cast<T>(raw);
}

struct Directory {
  std::uint64_t offset = 0, entries = 0;
};

/// Returns the position of the record that ends an archive; a comment may follow it.
std::size_t find_end(std::string_view bytes) {
  constexpr std::size_t most_comment = 0xffff;
  if (bytes.size() >= end_bytes) {
    const std::size_t last = bytes.size() - end_bytes;
    for (std::size_t back = 0; back <= std::min(last, most_comment); ++back) {
      const std::size_t at = last - back;
      if (bytes.substr(at).starts_with(end_mark) &&
          number_at<std::uint16_t>(bytes, at + 20) == back) {
        return at;
      }
    }
  }
  throw Error("it has no ZIP end record: is it a complete ZIP archive?");
}

Directory find_directory(std::string_view bytes) {
  const std::size_t end = find_end(bytes);
  const Directory directory{number_at<std::uint32_t>(bytes, end + 16),
                            number_at<std::uint16_t>(bytes, end + 10)};
  const bool has_64 =
      end >= locator_bytes && bytes.substr(end - locator_bytes).starts_with(locator_mark);
  if (!has_64) {
    if (number_at<std::uint16_t>(bytes, end + 4) != 0) {
      throw Error("the ZIP archive has several volumes: join them first");
    }
    return directory;
  }
  const auto at = number_at<std::uint64_t>(bytes, end - locator_bytes + 8);
  const std::string_view record = part_of(bytes, at, end64_bytes);
  if (!record.starts_with(end64_mark))
    throw Error("the ZIP64 end record of the archive is damaged");
  return {number_at<std::uint64_t>(record, 48), number_at<std::uint64_t>(record, 32)};
}

/// Reads those numbers that 32 bits cannot hold from the ZIP64 record among the extra fields.
void read_zip64(std::string_view extras, ZipMember& member) {
  while (extras.size() >= 4) {
    const auto kind = number_at<std::uint16_t>(extras, 0);
    std::string_view extra = part_of(extras, 4, number_at<std::uint16_t>(extras, 2));
    extras.remove_prefix(4 + extra.size());
    if (kind != 1) continue;
    for (std::uint64_t* value : {&member.size, &member.packed_size, &member.header}) {
      if (*value != unknown_32) continue;
      *value = number_at<std::uint64_t>(extra, 0);
      extra.remove_prefix(8);
    }
    return;
  }
}

}  // namespace

std::vector<ZipMember> zip_members(std::string_view bytes) {
  const Directory directory = find_directory(bytes);
  std::vector<ZipMember> members;
  std::uint64_t at = directory.offset, packed = 0;
  for (std::uint64_t i = 0; i < directory.entries; ++i) {
    const std::string_view entry = part_of(bytes, at, entry_bytes);
    if (!entry.starts_with(entry_mark)) throw Error("the ZIP archive's directory is damaged");
    const std::uint64_t name = number_at<std::uint16_t>(entry, 28);
    const std::uint64_t extra = number_at<std::uint16_t>(entry, 30);
    const std::uint64_t comment = number_at<std::uint16_t>(entry, 32);
    at += entry_bytes;
    ZipMember member{.name = std::string(part_of(bytes, at, name)),
                     .size = number_at<std::uint32_t>(entry, 24),
                     .packed_size = number_at<std::uint32_t>(entry, 20),
                     .header = number_at<std::uint32_t>(entry, 42),
                     .checksum = number_at<std::uint32_t>(entry, 16),
                     .method = number_at<std::uint16_t>(entry, 10)};
    read_zip64(part_of(bytes, at + name, extra), member);
    constexpr unsigned encrypted = 1;
    if ((number_at<std::uint16_t>(entry, 8) & encrypted) != 0) {
      throw Error("{} is encrypted: unpack the ZIP archive first", member.name);
    }
    if (member.packed_size > bytes.size() - packed) {
      throw Error("the ZIP archive's members exceed its size: is it truncated?");
    }
    packed += member.packed_size;
    at += name + extra + comment;
    members.push_back(std::move(member));
  }
  return members;
}

namespace {

/// Calls zlib piece by piece, because its counts have 32 bits. Returns whether all bytes were
/// unpacked.
bool inflate_raw(std::string_view packed, std::string& out) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;  // no header, as in ZIP
  constexpr std::size_t most = 1U << 30;
  // zlib only reads from next_in, but declares it without const.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  std::size_t in_left = packed.size(), out_left = out.size();
  int state = Z_OK;
  while (state == Z_OK) {
    const auto in = static_cast<uInt>(std::min(in_left, most));
    const auto room = static_cast<uInt>(std::min(out_left, most));
    stream.avail_in = in;
    stream.avail_out = room;
    state = inflate(&stream, Z_NO_FLUSH);
    in_left -= in - stream.avail_in;
    out_left -= room - stream.avail_out;
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END && out_left == 0;
}

std::uint32_t checksum_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

std::string unpack_member(std::string_view bytes, const ZipMember& member) {
  const std::string_view header = part_of(bytes, member.header, member_bytes);
  if (!header.starts_with(member_mark)) throw Error("{}: its header is damaged", member.name);
  const std::uint64_t data = member.header + member_bytes + number_at<std::uint16_t>(header, 26) +
                             number_at<std::uint16_t>(header, 28);
  const std::string_view packed = part_of(bytes, data, member.packed_size);
  std::string out;
  if (member.method == Z_DEFLATED) {
    constexpr std::uint64_t most_ratio = 1032;  // limit of deflate
    if (member.size / most_ratio > packed.size()) throw Error("{} is damaged", member.name);
    require_memory(member.name, "its unpacked bytes", static_cast<double>(member.size));
    out.resize(member.size);
    if (!inflate_raw(packed, out)) throw Error("{} is damaged: it cannot be unpacked", member.name);
  } else if (member.method == 0) {
    out = packed;
  } else {
    throw Error("{} is compressed by ZIP method {}, which is not deflate: compress it again",
                member.name, member.method);
  }
  if (out.size() != member.size || checksum_of(out) != member.checksum) {
    throw Error("{} is damaged: its checksum or size is wrong", member.name);
  }
  return out;
}

}  // namespace groundray
