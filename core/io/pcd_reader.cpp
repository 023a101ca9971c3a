#include "core/io/pcd_reader.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/memory.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::size_t most_numbers = 4096;  // per point; the longest known descriptor has 1344

struct PcdField {
  std::string name;
  NumberType type = NumberType::Float32;
  std::size_t count = 1;

  std::size_t bytes() const { return count * size_of(type); }
};

enum class DataForm { Text, Binary, Compressed };

struct PcdHeader {
  std::vector<std::string_view> names, types;
  std::vector<std::size_t> sizes, counts;
  std::optional<std::uint64_t> width, height, points;
  Pose X_FS;
  std::optional<DataForm> form;
};

std::vector<std::size_t> numbers_of(const Words& words) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto number = number_of<std::size_t>(words[i]);
    if (!number) throw Error("{} {:?} must be an integer >= 0", words[0], words[i].substr(0, 40));
    numbers.push_back(*number);
  }
  return numbers;
}

std::uint64_t one_number_of(const Words& words) {
  if (words.size() != 2) throw Error("{} must be followed by one number", words[0]);
  return numbers_of(words)[0];
}

Pose viewpoint_of(const Words& words) {
  std::array<double, 7> values{};
  if (words.size() != 1 + values.size()) throw Error("VIEWPOINT must be tx ty tz qw qx qy qz");
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto value = number_of<double>(words[i + 1]);
    if (!value || !std::isfinite(*value)) {
      throw Error("VIEWPOINT: {:?} is not a finite number", words[i + 1].substr(0, 40));
    }
    values[i] = *value;
  }
  const auto [x, y, z, qw, qx, qy, qz] = values;
  const glm::dquat rotation(qw, qx, qy, qz);
  constexpr double most_off = 1e-3;  // tolerance for files with few decimals
  if (std::abs(glm::length(rotation) - 1) > most_off) {
    throw Error("VIEWPOINT: the quaternion has a norm of {:.4g}; it must be 1, qw first",
                glm::length(rotation));
  }
  return {.rotation = glm::normalize(rotation), .translation_m = {x, y, z}};
}

DataForm data_form_of(const Words& words) {
  if (words.size() == 2) {
    if (words[1] == "ascii") return DataForm::Text;
    if (words[1] == "binary") return DataForm::Binary;
    if (words[1] == "binary_compressed") return DataForm::Compressed;
  }
  throw Error("DATA must be ascii, binary or binary_compressed");
}

void parse_pcd_header_line(const Words& words, PcdHeader& header) {
  const std::string_view key = words[0];
  if (key == "FIELDS" || key == "COLUMNS") {
    header.names.assign(words.begin() + 1, words.end());
  } else if (key == "SIZE") {
    header.sizes = numbers_of(words);
  } else if (key == "TYPE") {
    header.types.assign(words.begin() + 1, words.end());
  } else if (key == "COUNT") {
    header.counts = numbers_of(words);
  } else if (key == "WIDTH") {
    header.width = one_number_of(words);
  } else if (key == "HEIGHT") {
    header.height = one_number_of(words);
  } else if (key == "POINTS") {
    header.points = one_number_of(words);
  } else if (key == "VIEWPOINT") {
    header.X_FS = viewpoint_of(words);
  } else if (key == "DATA") {
    header.form = data_form_of(words);
  } else if (key != "VERSION") {
    throw Error("{:?} must be a key of a PCD header or #: is this a PCD file?", key.substr(0, 40));
  }
}

PcdHeader parse_pcd_header(TextLines& lines) {
  PcdHeader header;
  while (!header.form) {
    const auto line = lines.next();
    if (!line || !lines.ended()) {
      throw Error("the header lacks its last line, DATA: is this a complete PCD file?");
    }
    const Words words = words_of(*line);
    if (!words.empty() && !words[0].starts_with('#')) parse_pcd_header_line(words, header);
  }
  return header;
}

NumberType field_type_of(std::string_view type, std::size_t size) {
  const bool is_known = type == "F" || type == "I" || type == "U";
  const auto found = is_known ? number_type_of(static_cast<char>(type[0] - 'A' + 'a'), size)
                              : std::optional<NumberType>();
  if (found && *found != NumberType::Float16) return *found;
  throw Error("TYPE {:?} of SIZE {} is not supported; use I or U of 1, 2, 4, 8, or F of 4, 8",
              type.substr(0, 40), size);
}

/// Returns the fields. Each line must have a value for each field, or may be omitted where old
/// files omit it.
std::vector<PcdField> fields_of(const PcdHeader& header) {
  const std::size_t n = header.names.size();
  if (n == 0) throw Error("the header must have FIELDS");
  const auto check = [n](const char* key, std::size_t count) {
    if (count != 0 && count != n) {
      throw Error("{} has {} values; it must have one for each of the {} FIELDS", key, count, n);
    }
  };
  check("SIZE", header.sizes.size());
  check("TYPE", header.types.size());
  check("COUNT", header.counts.size());
  std::vector<PcdField> fields;
  std::size_t numbers = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const NumberType type = field_type_of(header.types.empty() ? "F" : header.types[i],
                                          header.sizes.empty() ? 4 : header.sizes[i]);
    const std::size_t count = header.counts.empty() ? 1 : header.counts[i];
    if (count > most_numbers - numbers) {
      throw Error("a point has more than {} numbers by COUNT: is the header damaged?",
                  most_numbers);
    }
    numbers += count;
    fields.push_back({std::string(header.names[i]), type, count});
  }
  return fields;
}

/// Sets the width, the height and the number of points.
void settle_size(const PcdHeader& header, PcdFile& file) {
  const std::uint64_t points = header.points.value_or(header.width.value_or(0));
  file.height = header.height.value_or(1);
  file.width = header.width.value_or(points);
  if (!header.points && !header.width) throw Error("the header must have WIDTH or POINTS");
  constexpr std::uint64_t most = std::uint64_t{1} << 32;
  if (file.width > most || file.height > most) {
    throw Error("WIDTH {} and HEIGHT {} must be below 2^32", file.width, file.height);
  }
  const std::uint64_t size =
      file.width > 0 && file.height > std::numeric_limits<std::uint64_t>::max() / file.width
          ? std::numeric_limits<std::uint64_t>::max()
          : file.width * file.height;
  if (header.points && size != *header.points) {
    throw Error("POINTS {} must be WIDTH {} times HEIGHT {}", *header.points, file.width,
                file.height);
  }
  file.cloud = PointCloud(size);
}

void append_number(std::string_view word, const PcdField& field, std::string& out) {
  with_number_type(field.type, [&]<typename T>(T /*of the type*/) {
    const auto value = number_of<T>(word);
    if (!value) {
      throw Error("{} = {:?} is not a number of its TYPE and SIZE", field.name, word.substr(0, 40));
    }
    out.append(reinterpret_cast<const char*>(&*value), sizeof *value);
  });
}

/// Returns text rows in the layout of a binary file.
std::string parse_pcd_rows(TextLines& lines, const std::vector<PcdField>& fields,
                           std::size_t rows) {
  std::size_t numbers = 0, stride = 0;
  for (const PcdField& field : fields) {
    numbers += field.count;
    stride += field.bytes();
  }
  if (numbers > 0 && rows > lines.rest().size() / numbers) {
    throw Error("{} points do not fit in {} bytes: is the file truncated?", rows,
                lines.rest().size());
  }
  std::string bytes;
  bytes.reserve(rows * stride);
  for (std::size_t row = 0; row < rows;) {
    const auto line = lines.next();
    if (!line) throw Error("there are {} points instead of {}: is it truncated?", row, rows);
    const Words words = words_of(*line);
    if (words.empty()) continue;
    if (words.size() != numbers) {
      throw Error("the row has {} values; a point has {}", words.size(), numbers);
    }
    auto word = words.begin();
    for (const PcdField& field : fields) {
      for (std::size_t i = 0; i < field.count; ++i) append_number(*word++, field, bytes);
    }
    ++row;
  }
  if (lines.rest().find_first_not_of(" \t\r\n") != std::string_view::npos) {
    throw Error("more rows follow the last of {} points: is POINTS wrong?", rows);
  }
  return bytes;
}

/// Adds the columns of points that are stored one after the other or, if compressed, field by
/// field.
void add_field_columns(std::string_view bytes, const std::vector<PcdField>& fields, DataForm form,
                       PcdFile& file) {
  std::size_t stride = 0;
  for (const PcdField& field : fields) stride += field.bytes();
  const std::size_t rows = file.cloud.rows();
  const char* at = bytes.data();
  for (const PcdField& field : fields) {
    const bool is_apart = form == DataForm::Compressed;
    for (std::size_t i = 0; i < field.count && field.name != "_"; ++i) {
      const NumberRun run{.first = at + i * size_of(field.type),
                          .step_bytes = is_apart ? field.bytes() : stride,
                          .type = field.type};
      const std::string name = field.count == 1 ? field.name : fmt::format("{}_{}", field.name, i);
      add_column(file.cloud, name, run, file.origins);
    }
    at += field.bytes() * (is_apart ? rows : 1);
  }
}

/// Accepts only zeros after the points; PCL has written such padding.
void check_filling(std::string_view bytes) {
  if (bytes.find_first_not_of('\0') != std::string_view::npos) {
    throw Error("{} bytes follow the last point: is the header wrong?", bytes.size());
  }
}

/// Returns the unpacked points of a compressed file, which begins with the packed and the unpacked
/// size.
std::string unpack(std::string_view bytes, std::size_t expected) {
  std::array<std::uint32_t, 2> sizes{};
  if (bytes.size() < sizeof sizes) throw Error("there are no compressed points: is it truncated?");
  bytes.copy(reinterpret_cast<char*>(sizes.data()), sizeof sizes);
  bytes.remove_prefix(sizeof sizes);
  if (sizes[0] > bytes.size()) {
    throw Error("the file declares {} bytes of compressed points but has {}: is it truncated?",
                sizes[0], bytes.size());
  }
  if (sizes[1] != expected) {
    throw Error("the compressed points have {} bytes unpacked; the header requires {}", sizes[1],
                expected);
  }
  check_filling(bytes.substr(sizes[0]));
  return unpack_lzf(bytes.substr(0, sizes[0]), expected);
}

void parse_pcd_body(TextLines& lines, const PcdHeader& header, PcdFile& file) {
  const std::vector<PcdField> fields = fields_of(header);
  settle_size(header, file);
  std::size_t stride = 0;
  for (const PcdField& field : fields) stride += field.bytes();
  const std::size_t rows = file.cloud.rows();
  if (stride == 0 || rows > std::numeric_limits<std::size_t>::max() / 2 / stride) {
    throw Error("{} points of {} bytes are too many: is the header damaged?", rows, stride);
  }
  if (*header.form == DataForm::Text) {
    return add_field_columns(parse_pcd_rows(lines, fields, rows), fields, DataForm::Text, file);
  }
  const std::string_view bytes = lines.rest();
  if (*header.form == DataForm::Compressed) {
    const std::string unpacked = rows == 0 ? "" : unpack(bytes, rows * stride);
    return add_field_columns(unpacked, fields, DataForm::Compressed, file);
  }
  if (rows * stride > bytes.size()) {
    throw Error("{} points of {} bytes need {} bytes, but the file has {}: is it truncated?", rows,
                stride, rows * stride, bytes.size());
  }
  check_filling(bytes.substr(rows * stride));
  add_field_columns(bytes, fields, DataForm::Binary, file);
}

constexpr const char* damaged = "the compressed points are damaged: {}";

/// Consumes bytes from the front.
class LzfSource {
 public:
  explicit LzfSource(std::string_view bytes) : bytes_(bytes) {}

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
  require_memory("the compressed points", "their unpacked bytes", static_cast<double>(size));
  std::string out;
  out.reserve(size);
  for (LzfSource source(packed); !source.is_empty();) {
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

PcdFile read_pcd(const std::filesystem::path& path) {
  return parse_pcd(read_text(path), path.string());
}

PcdFile parse_pcd(std::string_view bytes, const std::string& name) {
  TextLines lines(bytes);
  PcdHeader header;
  try {
    header = parse_pcd_header(lines);
    PcdFile file;
    file.X_FS = header.X_FS;
    parse_pcd_body(lines, header, file);
    return file;
  } catch (const Error& rule) {
    if (header.form.value_or(DataForm::Text) != DataForm::Text)
      throw Error("{}: {}", name, rule.what());
    throw Error("{}:{}: {}", name, lines.number(), rule.what());
  }
}

}  // namespace groundray
