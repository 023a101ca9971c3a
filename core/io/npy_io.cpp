#include "core/io/npy_io.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "core/io/file_io.h"

namespace groundray {
namespace {

std::string descr_of(const std::vector<NpyField>& fields) {
  if (fields.size() == 1 && fields[0].name.empty()) return fmt::format("'{}'", fields[0].type);
  std::vector<std::string> parts;
  for (const NpyField& field : fields)
    parts.push_back(fmt::format("('{}', '{}')", field.name, field.type));
  return fmt::format("[{}]", fmt::join(parts, ", "));
}

}  // namespace

void write_npy(const std::filesystem::path& path, const std::vector<NpyField>& fields,
               std::size_t rows, std::span<const std::byte> bytes) {
  constexpr std::size_t alignment = 64;  // of the data in the file, as in files by NumPy
  std::string text = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({},), }}",
                                 descr_of(fields), rows);
  const std::size_t preamble = 10;
  text.append(alignment - 1 - (preamble + text.size()) % alignment, ' ');
  text += '\n';
  std::string header = "\x93NUMPY\x01";
  header += '\0';
  header += static_cast<char>(text.size() % 256);
  header += static_cast<char>(text.size() / 256);
  header += text;
  int block = 0;
  write_blocks(path, [&]() -> std::string_view {
    switch (block++) {
      case 0:
        return header;
      case 1:
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
      default:
        return {};
    }
  });
}

}  // namespace groundray
