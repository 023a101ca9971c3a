#include "core/io/lzf.h"

#include "core/error.h"

namespace groundray {
namespace {

constexpr const char* damaged = "the compressed points are damaged: {}";

/// Consumes bytes from the front.
class Source {
 public:
  explicit Source(std::string_view bytes) : bytes_(bytes) {}

  bool is_empty() const { return bytes_.empty(); }
  std::size_t next() { return static_cast<unsigned char>(take(1)[0]); }
  std::string_view take(std::size_t count) {
    if (count > bytes_.size()) throw Error(damaged, "they end inside a run");
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }

 private:
  std::string_view bytes_;
};

}  // namespace

std::string unpack_lzf(std::string_view packed, std::size_t size) {
  // 3 bytes encode at most 264: a larger size is rejected before memory is allocated.
  constexpr std::size_t most_ratio = 88;
  if (size / most_ratio > packed.size()) throw Error(damaged, "they are too few");
  std::string out;
  out.reserve(size);
  for (Source source(packed); !source.is_empty();) {
    const std::size_t control = source.next();
    std::size_t length = control >> 5;
    if (length == 0) {
      out += source.take(control + 1);
    } else {
      if (length == 7) length += source.next();
      const std::size_t back = ((control & 0x1f) << 8) + source.next() + 1;
      if (back > out.size()) throw Error(damaged, "they refer to bytes before the first");
      if (out.size() + length + 2 > size) break;
      for (std::size_t i = 0; i < length + 2; ++i) out += out[out.size() - back];  // may overlap
    }
    if (out.size() > size) break;
  }
  if (out.size() != size) throw Error(damaged, "their unpacked size differs from the header's");
  return out;
}

}  // namespace groundray
