#include "core/io/npy_io.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/python_literal.h"
#include "core/io/text_lines.h"
#include "core/io/zip_reader.h"

namespace groundray {
namespace {

constexpr std::size_t most_columns = 4096;

/// One field of a row.
struct RowField {
  std::string name;
  std::optional<NumberType> type;  // empty if the field does not hold numbers
  ByteOrder order = ByteOrder::Little;
  std::size_t item_bytes = 0;
  std::size_t count = 1;
  bool is_object = false;  // Python objects: a pickle follows the header

  std::size_t bytes() const { return item_bytes * count; }
};

/// Parses a type in NumPy's notation: "<f4", "|u1", "|V12", "<U3".
RowField field_of(std::string_view type) {
  constexpr std::string_view orders = "<>|=";
  const std::string_view fault = type.substr(0, 40);
  RowField field;
  if (type.empty() || orders.find(type[0]) == std::string_view::npos) {
    throw Error("{:?} is not a NumPy type", fault);
  }
  if (type[0] == '>') field.order = ByteOrder::Big;
  type.remove_prefix(1);
  if (type.starts_with('O')) {
    field.is_object = true;
    return field;
  }
  const std::string_view digits = type.substr(std::min<std::size_t>(1, type.size()));
  // The unit of a date follows its size: "M8[ns]".
  const auto bytes = number_of<std::size_t>(digits.substr(0, digits.find('[')));
  if (!bytes || *bytes > (1U << 30)) throw Error("{:?} is not a NumPy type", fault);
  field.item_bytes = type[0] == 'U' ? 4 * *bytes : *bytes;
  field.type = number_type_of(type[0], *bytes);
  return field;
}

std::size_t product_of(const std::vector<std::uint64_t>& shape) {
  constexpr std::uint64_t most = std::uint64_t{1} << 48;
  std::uint64_t product = 1;
  for (const std::uint64_t extent : shape) {
    if (extent > most || (extent != 0 && product > most / extent)) {
      throw Error("the shape has more than 2^48 numbers: is the header damaged?");
    }
    product *= extent;
  }
  return product;
}

std::vector<std::uint64_t> shape_of(const PythonLiteral* literal) {
  std::vector<std::uint64_t> shape;
  const auto* const list = literal == nullptr ? nullptr : literal->as<PythonLiteral::List>();
  if (list == nullptr) throw Error("the header must have a shape, a tuple of integers");
  for (const PythonLiteral& extent : *list) {
    const auto* const number = extent.as<std::int64_t>();
    if (number == nullptr || *number < 0) throw Error("the shape must contain integers >= 0");
    shape.push_back(static_cast<std::uint64_t>(*number));
  }
  return shape;
}

/// Parses ('name', type) or ('name', type, shape); the name may be a pair ('title', 'name').
RowField field_of(const PythonLiteral& entry) {
  const auto* const parts = entry.as<PythonLiteral::List>();
  if (parts == nullptr || parts->size() < 2) throw Error("descr must list names and types");
  const auto* name = (*parts)[0].as<std::string>();
  if (const auto* const pair = (*parts)[0].as<PythonLiteral::List>(); pair && pair->size() == 2) {
    name = (*pair)[1].as<std::string>();
  }
  const auto* const type = (*parts)[1].as<std::string>();
  if (name == nullptr || type == nullptr) {
    throw Error("descr has a nested record: save its members as fields");
  }
  RowField field = field_of(*type);
  field.name = *name;
  if (parts->size() > 2) {
    const auto* const extent = (*parts)[2].as<std::int64_t>();
    field.count = extent != nullptr && *extent >= 0 ? static_cast<std::size_t>(*extent)
                                                    : product_of(shape_of(&(*parts)[2]));
  }
  return field;
}

struct NpyHeader {
  std::vector<RowField> fields;  // a plain array has one field without a name
  bool is_structured = false, is_fortran = false;
  std::vector<std::uint64_t> shape;
};

NpyHeader parse_npy_header(std::string_view text) {
  const PythonLiteral dict = parse_python_literal(text);
  const PythonLiteral* const descr = dict.find("descr");
  const PythonLiteral* const fortran = dict.find("fortran_order");
  if (descr == nullptr || fortran == nullptr || fortran->as<bool>() == nullptr) {
    throw Error("the header must have descr, fortran_order and shape");
  }
  NpyHeader header;
  header.is_fortran = *fortran->as<bool>();
  header.shape = shape_of(dict.find("shape"));
  if (const auto* const type = descr->as<std::string>()) {
    header.fields.push_back(field_of(*type));
  } else if (const auto* const list = descr->as<PythonLiteral::List>()) {
    header.is_structured = true;
    for (const PythonLiteral& entry : *list) header.fields.push_back(field_of(entry));
  } else {
    throw Error("descr must be a type or a list of fields");
  }
  return header;
}

/// Parses the header and removes it from `bytes`, which then holds the numbers.
NpyHeader take_npy_header(std::string_view& bytes) {
  constexpr std::string_view magic = "\x93NUMPY";
  constexpr std::size_t preamble = 8;
  if (!bytes.starts_with(magic) || bytes.size() < preamble + 4) {
    throw Error("it does not begin with the NumPy signature: is it a .npy file?");
  }
  const auto version = static_cast<unsigned char>(bytes[magic.size()]);
  if (version < 1 || version > 3) throw Error("version {} of the format is not supported", version);
  std::array<unsigned char, 4> raw{};
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  bytes.substr(preamble).copy(reinterpret_cast<char*>(raw.data()), length_bytes);
  const std::size_t length = std::bit_cast<std::uint32_t>(raw);
  bytes.remove_prefix(preamble + length_bytes);
  if (length > bytes.size()) throw Error("the header is truncated");
  const NpyHeader header = parse_npy_header(bytes.substr(0, length));
  bytes.remove_prefix(length);
  return header;
}

/// Reorders items from Fortran order (first axis fastest) to C order (last axis fastest).
std::string in_c_order(std::string_view bytes, const std::vector<std::uint64_t>& shape,
                       std::size_t item_bytes) {
  std::string out;
  out.reserve(bytes.size());
  std::vector<std::uint64_t> at(shape.size());
  const std::size_t items = item_bytes == 0 ? 0 : bytes.size() / item_bytes;
  for (std::size_t item = 0; item < items; ++item) {
    std::size_t from = 0;
    for (std::size_t axis = shape.size(); axis-- > 0;) from = from * shape[axis] + at[axis];
    out += bytes.substr(from * item_bytes, item_bytes);
    for (std::size_t axis = shape.size(); axis-- > 0;) {
      if (++at[axis] < shape[axis]) break;
      at[axis] = 0;
    }
  }
  return out;
}

void add_fields(std::string_view bytes, const NpyHeader& header, std::size_t row_bytes,
                NpyArray& array) {
  const char* at = bytes.data();
  for (const RowField& field : header.fields) {
    const bool is_named = header.is_structured && field.count > 1;
    for (std::size_t i = 0; field.type && i < field.count; ++i) {
      const NumberRun run{at + i * field.item_bytes, row_bytes, *field.type, field.order};
      const std::string name = is_named ? fmt::format("{}_{}", field.name, i)
                               : header.is_structured || header.shape.size() < 2
                                   ? field.name
                                   : std::to_string(i);
      add_column(array.cloud, name, run, array.origins);
    }
    if (!field.type && !field.name.empty()) array.unread.push_back(field.name);
    at += field.bytes();
  }
}

/// Returns the reason why an intact file cannot be read as numbers, or nothing if it can.
std::optional<std::string> fault_of(const NpyHeader& header) {
  if (std::ranges::any_of(header.fields, &RowField::is_object)) return "it contains Python objects";
  const bool has_numbers =
      std::ranges::any_of(header.fields, [](const RowField& f) { return f.type.has_value(); });
  if (!has_numbers) return "it contains no numbers";
  return std::nullopt;
}

// Checks that as many bytes follow the header as it declares.
void check_size(std::size_t rows, std::size_t item_bytes, std::size_t bytes) {
  if (rows > std::numeric_limits<std::size_t>::max() / std::max<std::size_t>(item_bytes, 1) ||
      rows * item_bytes != bytes) {
    throw Error(
        "the header declares {} numbers or rows of {} bytes, but {} bytes follow: is it truncated?",
        rows, item_bytes, bytes);
  }
}

void check_columns(std::size_t columns) {
  constexpr const char* fix = "transpose it, or save it in parts";
  if (columns > most_columns) throw Error("a row has more than {} numbers: {}", most_columns, fix);
}

/// Reads the numbers that follow the header.
NpyArray parse_numbers(std::string_view bytes, NpyHeader header) {
  NpyArray array;
  array.shape = header.shape;
  array.is_structured = header.is_structured;
  std::size_t rows = product_of(header.shape), columns = 0, item_bytes = 0;
  for (const RowField& field : header.fields) {
    check_columns(columns += std::min(field.count, most_columns + 1));
    item_bytes += field.bytes();
  }
  if (item_bytes > (std::size_t{1} << 32)) throw Error("a row is longer than 4 GiB");
  check_size(rows, item_bytes, bytes.size());
  std::string reordered;
  if (header.is_fortran && header.shape.size() > 1) {
    reordered = in_c_order(bytes, header.shape, item_bytes);
    bytes = reordered;
  }
  std::size_t row_bytes = item_bytes;
  if (!header.is_structured && header.shape.size() > 1) {
    columns = header.fields[0].count = header.shape.back();
    rows = columns == 0 ? 0 : rows / columns;
    row_bytes *= columns;
  }
  check_columns(columns);
  array.cloud = PointCloud(rows);
  add_fields(bytes, header, row_bytes, array);
  return array;
}

void parse_member(std::string_view archive, const ZipMember& member, NpzFile& file) {
  constexpr std::string_view ending = ".npy";
  if (!member.name.ends_with(ending)) {
    file.unread.emplace_back(member.name, "it is not a .npy file");
    return;
  }
  const std::string name = member.name.substr(0, member.name.size() - ending.size());
  const std::string unpacked = unpack_member(archive, member);
  std::string_view bytes = unpacked;
  NpyHeader header = take_npy_header(bytes);
  if (const auto fault = fault_of(header)) {
    file.unread.emplace_back(name, *fault);
    return;
  }
  file.arrays.push_back(parse_numbers(bytes, std::move(header)));
  file.arrays.back().name = name;
}

std::string descr_of(const std::vector<NpyField>& fields) {
  if (fields.size() == 1 && fields[0].name.empty()) return fmt::format("'{}'", fields[0].type);
  std::vector<std::string> parts;
  for (const NpyField& field : fields)
    parts.push_back(fmt::format("('{}', '{}')", field.name, field.type));
  return fmt::format("[{}]", fmt::join(parts, ", "));
}

}  // namespace

NpyArray read_npy(const std::filesystem::path& path) {
  return parse_npy(read_text(path), path.string());
}

NpyArray parse_npy(std::string_view bytes, const std::string& name) {
  try {
    NpyHeader header = take_npy_header(bytes);
    if (const auto fault = fault_of(header)) throw Error("{}", *fault);
    return parse_numbers(bytes, std::move(header));
  } catch (const Error& rule) {
    throw Error("{}: {}", name, rule.what());
  }
}

NpzFile read_npz(const std::filesystem::path& path) {
  return parse_npz(read_text(path), path.string());
}

NpzFile parse_npz(std::string_view bytes, const std::string& name) {
  NpzFile file;
  std::string at = name;
  try {
    for (const ZipMember& member : zip_members(bytes)) {
      at = fmt::format("{}: {}", name, member.name);
      parse_member(bytes, member, file);
    }
  } catch (const Error& rule) {
    throw Error("{}: {}", at, rule.what());
  }
  return file;
}

RawNpy read_raw_npy(const std::filesystem::path& path) {
  try {
    const std::string text = read_text(path);
    std::string_view bytes = text;
    const NpyHeader header = take_npy_header(bytes);
    if (const auto fault = fault_of(header)) throw Error("{}", *fault);
    if (header.is_structured) throw Error("it is structured; save a plain array");
    const RowField& item = header.fields.front();
    check_size(product_of(header.shape), item.item_bytes, bytes.size());
    return {
        *item.type, item.order, header.shape,
        header.is_fortran ? in_c_order(bytes, header.shape, item.item_bytes) : std::string(bytes)};
  } catch (const Error& rule) {
    throw Error("{}: {}", path.string(), rule.what());
  }
}

namespace {

void write_file(const std::filesystem::path& path, std::string_view descr, std::string_view shape,
                std::span<const std::byte> bytes) {
  constexpr std::size_t alignment = 64;  // of the data in the file, as in files by NumPy
  std::string text =
      fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({}), }}", descr, shape);
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

}  // namespace

void write_npy(const std::filesystem::path& path, const std::vector<NpyField>& fields,
               std::size_t rows, std::span<const std::byte> bytes) {
  write_file(path, descr_of(fields), fmt::format("{},", rows), bytes);
}

void write_npy(const std::filesystem::path& path, std::string_view type,
               std::span<const std::uint64_t> shape, std::span<const std::byte> bytes) {
  write_file(path, fmt::format("'{}'", type),
             fmt::format("{}{}", fmt::join(shape, ", "), shape.size() == 1 ? "," : ""), bytes);
}

}  // namespace groundray
