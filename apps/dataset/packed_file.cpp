#include "apps/dataset/packed_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/memory.h"

namespace groundray {
namespace {

constexpr std::size_t most_bytes = 4'000'000'000;
constexpr int gzip_window = 15 + 16;

}  // namespace

std::string unpack(std::string_view packed, const std::string& name) {
  const auto fail = [&](const char* why) { throw Error("{}: {}", name, why); };
  if (!packed.starts_with("\x1f\x8b"))
    fail("it is not in gzip format, although its name ends in .gz");
  z_stream stream{};
  if (inflateInit2(&stream, gzip_window) != Z_OK) fail("zlib cannot be initialised");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  std::string bytes;
  std::array<char, 1 << 16> block{};
  std::size_t given = 0;
  while (true) {
    if (stream.avail_in == 0) {
      if (given == packed.size()) fail("it is truncated");
      const std::size_t count = std::min<std::size_t>(packed.size() - given, 1 << 20);
      stream.next_in =
          reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + given));  // zlib only reads
      stream.avail_in = static_cast<uInt>(count);
      given += count;
    }
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    const int state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END) fail("it is damaged");
    if (bytes.size() + block.size() > bytes.capacity())  // it doubles
      require_memory(name, "its unpacked bytes", 2.0 * static_cast<double>(bytes.capacity()));
    bytes.append(block.data(), block.size() - stream.avail_out);
    if (bytes.size() > most_bytes) fail("it contains more than 4 GB");
    if (state != Z_STREAM_END) continue;
    const std::string_view rest = packed.substr(given - stream.avail_in);
    if (rest.find_first_not_of('\0') == std::string_view::npos) return bytes;  // padding of tapes
    if (inflateReset(&stream) != Z_OK) fail("zlib cannot be reset");
  }
}

std::string read_packed(const std::filesystem::path& path) {
  std::string bytes = read_text(path);
  return path.extension() == ".gz" ? unpack(bytes, path.string()) : bytes;
}

}  // namespace groundray
