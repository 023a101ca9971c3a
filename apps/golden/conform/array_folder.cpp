#include "apps/golden/conform/array_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "apps/dataset/file_sum.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t most_header_bytes = 1 << 16;

std::string text_of(const std::vector<std::uint64_t>& shape) {
  std::vector<std::string> extents;
  for (const std::uint64_t extent : shape)
    extents.push_back(extent == any ? "n" : fmt::format("{}", extent));
  return fmt::format("({}{})", fmt::join(extents, ", "), shape.size() == 1 ? "," : "");
}

std::string text_of(NumberType type, ByteOrder order) {
  constexpr std::string_view kinds = "fffiiiiuuuub";
  const std::size_t bytes = size_of(type);
  const char mark = bytes == 1 ? '|' : order == ByteOrder::Little ? '<' : '>';
  return fmt::format("{}{}{}", mark, kinds[static_cast<std::size_t>(type)], bytes);
}

// Returns the largest number of items that an array of this shape may have.
std::uint64_t most_items(const std::vector<std::uint64_t>& shape, std::uint64_t most) {
  std::uint64_t items = 1;
  for (const std::uint64_t extent : shape) items *= extent == any ? most : extent;
  return items;
}

template <typename T>
void check_no_nan(const std::string& bytes) {
  for (std::size_t i = 0; i < bytes.size() / sizeof(T); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    if (std::isnan(value)) throw Error("number {} is NaN", i);
  }
}

}  // namespace

fs::path ArrayFolder::file(const std::string& name) const {
  const fs::path path = folder_ / name;
  std::error_code fault;
  const fs::path real = fs::canonical(path, fault);
  if (fault)
    throw Error("{}: {}; docs/guide/gpu.md lists the files", path.string(), why_no_file(path));
  const fs::path inside = real.lexically_relative(fs::canonical(folder_, fault));
  if (fault || inside.empty() || *inside.begin() == "..")
    throw Error("{}: it leads out of the folder, to {}", path.string(), real.string());
  if (!fs::is_regular_file(real, fault)) throw Error("{}: it is not a file", path.string());
  return real;
}

RawNpy ArrayFolder::read_raw(const std::string& name, std::string_view type,
                             const std::vector<std::uint64_t>& shape, std::uint64_t most,
                             bool holes) const {
  const fs::path real = file(name + ".npy");
  try {
    const std::uint64_t limit = most_header_bytes + 16 * most_items(shape, most);
    if (const auto bytes = fs::file_size(real); bytes > limit)
      throw Error("it has {} bytes, more than an array of shape {} can", bytes, text_of(shape));
    RawNpy raw = read_raw_npy(real);
    const bool fits = std::ranges::equal(raw.shape, shape, [](auto extent, auto wanted) {
      return wanted == any || extent == wanted;
    });
    const std::string found = text_of(raw.type, raw.order);
    if (!fits || found != type) {
      throw Error("it is {} of shape {}; {} of shape {} is required", found, text_of(raw.shape),
                  type, text_of(shape));
    }
    if (most_items(raw.shape, 0) > most_items(shape, most))
      throw Error("it has {} rows; at most {} are possible", raw.shape[0], most);
    if (!holes && raw.type == NumberType::Float32) check_no_nan<float>(raw.bytes);
    if (!holes && raw.type == NumberType::Float64) check_no_nan<double>(raw.bytes);
    return raw;
  } catch (const Error& rule) {
    const std::string place = (folder_ / (name + ".npy")).string();
    const std::string_view text = rule.what();  // may begin with the real path
    const std::string prefix = real.string() + ": ";
    throw Error("{}: {}", place, text.starts_with(prefix) ? text.substr(prefix.size()) : text);
  }
}

void ArrayWriter::write_bytes(ArrayEntry entry, std::span<const std::byte> bytes) {
  const fs::path path = folder_ / (entry.name + ".npy");
  fs::create_directories(path.parent_path());
  write_npy(path, entry.type, entry.shape, bytes);
  entry.sha256 = sha256_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  entries_.push_back(std::move(entry));
}

}  // namespace groundray::golden
