#include "core/io/ply_io.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_header.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

constexpr std::size_t block_bytes = 1 << 18;  // rows and columns of one block fit in the cache

/// Returns f(T{}) for the type T of index `type` in PointCloud::AnyValues.
template <std::size_t I = 0, typename F>
auto with_type(std::size_t type, const F& f) {
  if constexpr (I + 1 < ply_type_count) {
    if (type != I) return with_type<I + 1>(type, f);
  }
  return f(typename std::variant_alternative_t<I, PointCloud::AnyValues>::value_type{});
}

std::size_t type_bytes(std::size_t type) {
  return with_type(type, [](auto value) { return sizeof value; });
}

bool is_visible(std::string_view name) {
  return !name.empty() && std::ranges::all_of(name, [](char c) { return '!' <= c && c <= '~'; });
}

std::string header_of(const PointCloud& cloud, const std::vector<std::string>& comments) {
  PlyElement vertex{"vertex", cloud.rows(), {}};
  for (const auto& [name, values] : cloud.columns()) {
    vertex.properties.push_back({name, values.index(), std::nullopt});
  }
  return ply_header(comments, {vertex});
}

void gather_rows(const PointCloud& cloud, std::size_t first, std::size_t rows, std::size_t stride,
                 char* out) {
  for (const auto& [name, values] : cloud.columns()) {
    const auto copy = [&](const auto& column) {
      for (std::size_t i = 0; i < rows; ++i) {
        std::memcpy(out + i * stride, &column[first + i], sizeof column[0]);
      }
      out += sizeof column[0];
    };
    std::visit(copy, values);
  }
}

PlyFormat parse_format(const std::vector<std::string_view>& words) {
  if (words.size() == 3 && words[2] == "1.0") {
    if (words[1] == "ascii") return PlyFormat::Ascii;
    if (words[1] == "binary_little_endian") return PlyFormat::LittleEndian;
    if (words[1] == "binary_big_endian") return PlyFormat::BigEndian;
  }
  throw Error(
      "the format must be ascii, binary_little_endian or binary_big_endian, and the version 1.0");
}

PlyElement parse_element(const std::vector<std::string_view>& words) {
  if (words.size() != 3) throw Error("an element must have a name and a count");
  const auto rows = number_of<std::uint64_t>(words[2]);
  if (!rows) throw Error("the count {:?} must be an integer >= 0 and < 2^64", words[2]);
  return {std::string(words[1]), *rows, {}};
}

PlyProperty parse_property(const std::vector<std::string_view>& words) {
  if (words.size() == 3) return {std::string(words[2]), ply_type_of(words[1]), std::nullopt};
  if (words.size() != 5 || words[1] != "list") {
    throw Error("a property must be '<type> <name>' or 'list <type of count> <type> <name>'");
  }
  const std::size_t count_type = ply_type_of(words[2]);
  if (with_type(count_type, [](auto value) { return std::is_floating_point_v<decltype(value)>; })) {
    throw Error("the length of a list must be of an integer type, not {}", words[2]);
  }
  return {std::string(words[4]), ply_type_of(words[3]), count_type};
}

void add_property(PlyHeader& header, PlyProperty property) {
  if (header.elements.empty()) throw Error("a property must follow its element");
  PlyElement& element = header.elements.back();
  if (property.count_type && element.name == "vertex") {
    throw Error(
        "the property '{}' of element vertex is a list; a point must have single numbers only",
        property.name);
  }
  if (std::ranges::find(element.properties, property.name, &PlyProperty::name) !=
      element.properties.end()) {
    throw Error("the element {} has two properties '{}'", element.name, property.name);
  }
  element.properties.push_back(std::move(property));
}

void parse_ply_header_line(std::string_view line, PlyHeader& header) {
  const std::vector<std::string_view> words = words_of(line);
  const std::string_view keyword = words.empty() ? std::string_view() : words[0];
  if (keyword == "comment") {
    line.remove_prefix(line.find(keyword) + keyword.size());
    header.comments.emplace_back(line.substr(line.empty() ? 0 : 1));
  } else if (keyword == "format") {
    if (header.format) throw Error("the format is given twice");
    header.format = parse_format(words);
  } else if (keyword == "element") {
    PlyElement element = parse_element(words);
    if (std::ranges::find(header.elements, element.name, &PlyElement::name) !=
        header.elements.end()) {
      throw Error("the element '{}' is declared twice", element.name);
    }
    header.elements.push_back(std::move(element));
  } else if (keyword == "property") {
    add_property(header, parse_property(words));
  } else if (keyword == "obj_info") {
    header.infos.emplace_back(line.substr(line.find(keyword) + keyword.size()));
  } else {
    throw Error("{:?} must be format, element, property, comment, obj_info or end_header",
                keyword.substr(0, 40));
  }
}

/// Returns the smallest size of a row: lists are empty, and an ASCII value takes a digit and a
/// blank.
std::size_t least_row_bytes(const PlyElement& element, PlyFormat format) {
  std::size_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    bytes +=
        format == PlyFormat::Ascii ? 2 : type_bytes(property.count_type.value_or(property.type));
  }
  return bytes;
}

void check_fits(const PlyElement& element, PlyFormat format, std::size_t bytes) {
  const std::size_t row_bytes = least_row_bytes(element, format);
  if (row_bytes == 0 && element.rows > 0)
    throw Error("the element {} has no property", element.name);
  if (row_bytes > 0 && element.rows > bytes / row_bytes) {
    throw Error(
        "the element {} has {} rows of {} or more bytes each, but {} bytes are left: is the file "
        "truncated?",
        element.name, element.rows, row_bytes, bytes);
  }
}

template <typename T>
T load_property(const char* from, PlyFormat format) {
  std::array<char, sizeof(T)> bytes;
  std::copy_n(from, sizeof(T), bytes.begin());
  if (format == PlyFormat::BigEndian) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

void skip_binary(const PlyElement& element, PlyFormat format, std::string_view& bytes) {
  const auto drop = [&](std::uint64_t count, std::size_t size) {
    if (count > bytes.size() / size) throw Error("the element {} is truncated", element.name);
    bytes.remove_prefix(count * size);
  };
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    for (const PlyProperty& property : element.properties) {
      std::uint64_t count = 1;
      if (property.count_type) {
        const char* const at = bytes.data();
        drop(1, type_bytes(*property.count_type));
        const auto length = with_type(*property.count_type, [at, format](auto value) {
          return static_cast<std::int64_t>(load_property<decltype(value)>(at, format));
        });
        if (length < 0)
          throw Error("row {} of element {} has a list of {} numbers", row, element.name, length);
        count = static_cast<std::uint64_t>(length);
      }
      drop(count, type_bytes(property.type));
    }
  }
}

/// Adds a column for each property and returns pointers to their first values.
std::vector<void*> add_property_columns(const PlyElement& vertex, PointCloud& cloud) {
  std::vector<void*> columns;
  for (const PlyProperty& property : vertex.properties) {
    columns.push_back(with_type(property.type, [&](auto value) -> void* {
      return cloud.add<decltype(value)>(property.name).data();
    }));
  }
  return columns;
}

void scatter_rows(std::string_view bytes, PlyFormat format, const PlyElement& vertex,
                  const std::vector<void*>& columns) {
  const std::size_t stride = least_row_bytes(vertex, format);
  const std::size_t rows_per_block = block_bytes / (stride + 1) + 1;
  for (std::size_t first = 0; first < vertex.rows; first += rows_per_block) {
    const std::size_t end = std::min<std::size_t>(vertex.rows, first + rows_per_block);
    const char* from = bytes.data();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      from += with_type(vertex.properties[i].type, [&](auto value) {
        auto* const column = static_cast<decltype(value)*>(columns[i]);
        for (std::size_t row = first; row < end; ++row) {
          column[row] = load_property<decltype(value)>(from + row * stride, format);
        }
        return sizeof value;
      });
    }
  }
}

void parse_ply_rows(TextLines& lines, const PlyElement& vertex, const std::vector<void*>& columns) {
  for (std::size_t row = 0; row < vertex.rows; ++row) {
    const auto line = lines.next();
    if (!line || !lines.ended())
      throw Error("the last line lacks its line break: is the file truncated?");
    const std::vector<std::string_view> words = words_of(*line);
    if (words.size() != columns.size()) {
      throw Error("the row has {} values; it must have one for each of the {} properties",
                  words.size(), columns.size());
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
      with_type(vertex.properties[i].type, [&](auto value) {
        const auto number = number_of<decltype(value)>(words[i]);
        if (!number) {
          throw Error("{} = {:?} is not a number of type {}", vertex.properties[i].name,
                      words[i].substr(0, 40), ply_type_names[vertex.properties[i].type][0]);
        }
        static_cast<decltype(value)*>(columns[i])[row] = *number;
      });
    }
  }
}

PointCloud parse_ply_body(TextLines& lines, const PlyHeader& header) {
  const PlyFormat format = *header.format;
  std::string_view bytes = lines.rest();
  auto element = header.elements.begin();
  for (; element->name != "vertex"; ++element) {
    check_fits(*element, format, bytes.size());
    if (format != PlyFormat::Ascii) {
      skip_binary(*element, format, bytes);
      continue;
    }
    for (std::uint64_t row = 0; row < element->rows && lines.next(); ++row) continue;
    bytes = lines.rest();
  }
  check_fits(*element, format, bytes.size());
  PointCloud cloud(element->rows);
  const std::vector<void*> columns = add_property_columns(*element, cloud);
  if (format == PlyFormat::Ascii) {
    parse_ply_rows(lines, *element, columns);
    bytes = lines.rest();
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  } else {
    scatter_rows(bytes, format, *element, columns);
    bytes.remove_prefix(element->rows * least_row_bytes(*element, format));
  }
  const bool last =
      std::all_of(std::next(element), header.elements.end(), [](auto& e) { return e.rows == 0; });
  if (last && !bytes.empty())
    throw Error("{} bytes follow the last row: is the count wrong?", bytes.size());
  return cloud;
}

}  // namespace

PlyHeader parse_ply_header(TextLines& lines) {
  if (lines.next() != "ply" || !lines.ended())
    throw Error("the first line must be 'ply': is this a PLY file?");
  PlyHeader header;
  for (auto line = lines.next(); line != "end_header" || !lines.ended(); line = lines.next()) {
    if (!line || !lines.ended())
      throw Error("the header lacks its last line, end_header: is the file truncated?");
    parse_ply_header_line(*line, header);
  }
  if (!header.format) throw Error("the header must name a format");
  if (std::ranges::find(header.elements, "vertex", &PlyElement::name) == header.elements.end()) {
    throw Error("the header must have an element vertex");
  }
  return header;
}

double PlyValues::next(std::size_t type) {
  if (format_ == PlyFormat::Ascii) return next_word();
  return with_type(type, [this](auto value) {
    if (bytes_.size() < sizeof value) throw Error("the last row is incomplete: is it truncated?");
    value = load_property<decltype(value)>(&bytes_.front(), format_);
    bytes_.remove_prefix(sizeof value);
    return static_cast<double>(value);
  });
}

std::size_t PlyValues::next_count(std::size_t type, const std::string& element, std::uint64_t row) {
  const double count = next(type);
  if (!(count >= 0 && count <= static_cast<double>(bytes_.size())) || count != std::floor(count))
    throw Error("row {} of element {} has a list of {} numbers", row, element, count);
  return static_cast<std::size_t>(count);
}

double PlyValues::next_word() {
  constexpr std::string_view blanks = " \t\r\n";
  bytes_.remove_prefix(std::min(bytes_.find_first_not_of(blanks), bytes_.size()));
  const std::string_view word = bytes_.substr(0, bytes_.find_first_of(blanks));
  if (word.size() == bytes_.size())
    throw Error("the last line lacks its line break: is it truncated?");
  bytes_.remove_prefix(word.size());
  const auto value = number_of<double>(word);
  if (!value) throw Error("{:?} is not a number", word.substr(0, 40));
  return *value;
}

void PlyValues::check_rows(const PlyElement& element) const {
  if (element.rows <= bytes_.size()) return;
  throw Error("{} rows of element {} do not fit in {} bytes: is it truncated?", element.rows,
              element.name, bytes_.size());
}

void write_ply(const std::filesystem::path& path, const PointCloud& cloud,
               const std::vector<std::string>& comments) {
  Violations broken(path.string());
  broken.unless(cloud.rows() == 0 || !cloud.columns().empty(),
                "the cloud has {} rows but no column", cloud.rows());
  std::size_t stride = 0;
  for (const auto& [name, values] : cloud.columns()) {
    broken.unless(is_visible(name),
                  "the name of column {:?} must consist of visible ASCII characters", name);
    stride += type_bytes(values.index());
  }
  for (const std::string& comment : comments) {
    broken.unless(comment.find_first_of("\r\n") == std::string::npos,
                  "the comment {:?} must be one line", comment);
  }
  broken.throw_if_any();
  const std::size_t rows_per_block = block_bytes / (stride + 1) + 1;
  std::vector<char> block(rows_per_block * stride);
  std::string header = header_of(cloud, comments);
  std::size_t next_row = 0;
  bool begun = false;
  write_blocks(path, [&]() -> std::string_view {
    if (!std::exchange(begun, true)) return header;
    const std::size_t rows = std::min(rows_per_block, cloud.rows() - next_row);
    gather_rows(cloud, next_row, rows, stride, block.data());
    next_row += rows;
    return {block.data(), rows * stride};
  });
}

PlyFile read_ply(const std::filesystem::path& path) {
  return parse_ply(read_text(path), path.string());
}

PlyFile parse_ply(std::string_view bytes, const std::string& name) {
  TextLines lines(bytes);
  PlyHeader header;
  try {
    header = parse_ply_header(lines);
    PointCloud cloud = parse_ply_body(lines, header);
    return {std::move(cloud), std::move(header.comments)};
  } catch (const Error& rule) {
    if (header.format.value_or(PlyFormat::Ascii) != PlyFormat::Ascii)
      throw Error("{}: {}", name, rule.what());
    throw Error("{}:{}: {}", name, lines.number(), rule.what());
  }
}

}  // namespace groundray
