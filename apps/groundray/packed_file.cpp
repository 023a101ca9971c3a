#include "apps/groundray/packed_file.h"

#include <zlib.h>

#include <array>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "core/product_io.h"

namespace groundray {

std::string read_packed(const std::filesystem::path& path) {
  if (path.extension() != ".gz") return read_text(path);
  constexpr std::size_t most_bytes = 4'000'000'000;
  const std::string packed = read_text(path);
  if (packed.size() < 2 || packed[0] != '\x1f' || packed[1] != '\x8b')
    throw Error("{}: it is not packed by gzip, as its name says", path.string());
  const auto fail = [&](const char* why) { throw Error("{}: {}", path.string(), why); };
  z_stream stream{};
  constexpr int gzip_window = 15 + 16;
  if (inflateInit2(&stream, gzip_window) != Z_OK) fail("zlib cannot begin");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  std::string bytes;
  std::array<char, 1 << 16> block{};
  std::size_t given = 0;
  for (int state = Z_OK; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      if (given == packed.size()) fail("it is cut short");
      const std::size_t count = std::min<std::size_t>(packed.size() - given, 1 << 20);
      stream.next_in =
          reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + given));  // zlib only reads
      stream.avail_in = static_cast<uInt>(count);
      given += count;
    }
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END) fail("it is damaged");
    bytes.append(block.data(), block.size() - stream.avail_out);
    if (bytes.size() > most_bytes) fail("it holds more than 4 GB");
  }
  return bytes;
}

}  // namespace groundray
