#include "apps/scan/cloud_blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/io/open_file.h"
#include "core/io/ply_header.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

// Position and size of the rows in a file, with the header for a block of them.
struct Layout {
  std::vector<std::string> head{};
  std::size_t digits = 0;
  std::uint64_t begin = 0;  // position of the first row, bytes
  std::uint64_t rows = 0;
  std::uint64_t row_bytes = 0;
};

// Returns the lines up to the one that begins with `key`; empty if there is none.
std::vector<std::string_view> lines_up_to(std::string_view text, std::string_view key) {
  std::vector<std::string_view> lines;
  while (true) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    lines.push_back(text.substr(0, end));
    if (lines.back().starts_with(key)) return lines;
    text.remove_prefix(end + 1);
  }
}

std::uint64_t bytes_of(const std::vector<std::string_view>& lines) {
  std::uint64_t bytes = 0;
  for (const std::string_view line : lines) bytes += line.size() + 1;
  return bytes;
}

std::uint64_t whole(std::string_view word) { return number_of<std::uint64_t>(word).value_or(0); }

Layout layout_of_floats(std::uint64_t file_bytes, std::size_t columns) {
  constexpr std::size_t kitti = 4;
  const std::uint64_t row_bytes = sizeof(float) * (columns == 0 ? kitti : columns);
  return {.head = {""}, .rows = file_bytes / row_bytes, .row_bytes = row_bytes};
}

Layout layout_of_npy(std::string_view head, std::uint64_t file_bytes) {
  constexpr std::size_t first = 10, later = 12;  // offset of the text, by version
  if (head.size() < later || !head.starts_with("\x93NUMPY")) return {};
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(head[i]));
  };
  Layout layout;
  layout.begin = (head[6] == 1 ? first : later) + byte(8) + (byte(9) << 8U);
  const std::string_view text = head.substr(0, layout.begin);
  constexpr std::string_view key = "'shape': (", in_order = "'fortran_order': False";
  const std::size_t number = text.find(key) + key.size();
  const std::size_t end = text.find_first_of(",)", number);
  const bool is_told = text.find(key) != std::string_view::npos && end != std::string_view::npos &&
                       text.find(in_order) != std::string_view::npos;
  if (!is_told || file_bytes < layout.begin) return {};
  layout.digits = end - number;
  layout.rows = whole(text.substr(number, layout.digits));
  layout.head = {std::string(text.substr(0, number)), std::string(text.substr(end))};
  if (layout.rows > 0) layout.row_bytes = (file_bytes - layout.begin) / layout.rows;
  return layout;
}

// Returns the size of a number; 0 for other types, such as lists.
std::uint64_t bytes_of_ply(std::string_view type) {
  static constexpr std::array<std::uint64_t, ply_type_count> bytes{4, 8, 1, 2, 4, 1, 2, 4};
  for (std::size_t i = 0; i < ply_type_count; ++i) {
    if (std::ranges::find(ply_type_names[i], type) != ply_type_names[i].end()) return bytes[i];
  }
  return 0;
}

// The points must be the first element; later elements are ignored.
Layout layout_of_ply(std::string_view head) {
  const auto lines = lines_up_to(head, "end_header");
  Layout layout{.begin = bytes_of(lines)};
  std::string before, after;
  int elements = 0;
  for (const std::string_view line : lines) {
    const auto words = words_of(line);
    if (words.size() < 2) continue;  // first and last line
    if (words[0] == "format" && !words[1].starts_with("binary")) return {};
    if (words[0] == "element" && ++elements == 1) {
      if (words[1] != "vertex" || words.size() < 3) return {};
      layout.rows = whole(words[2]);
      continue;
    }
    if (elements > 1) continue;
    if (elements == 1 && words[0] == "property") {
      const std::uint64_t bytes = bytes_of_ply(words[1]);
      if (bytes == 0) return {};
      layout.row_bytes += bytes;
    }
    (elements == 0 ? before : after) += std::string(line) + "\n";
  }
  layout.head = {"ply\n" + before + "element vertex ", "\n" + after + "end_header\n"};
  return layout;
}

Layout layout_of_pcd(std::string_view head) {
  const auto lines = lines_up_to(head, "DATA binary");
  Layout layout{.begin = bytes_of(lines)};
  std::string before;
  std::vector<std::string_view> sizes, counts;
  for (const std::string_view line : lines) {
    const auto words = words_of(line);
    if (words.size() < 2) continue;
    if (words[0] == "DATA" && words[1] != "binary") return {};  // compressed
    if (words[0] == "SIZE") sizes = words;
    if (words[0] == "COUNT") counts = words;
    if (words[0] == "POINTS") layout.rows = whole(words[1]);
    const bool is_replaced =
        words[0] == "WIDTH" || words[0] == "HEIGHT" || words[0] == "POINTS" || words[0] == "DATA";
    if (!is_replaced) before += std::string(line) + "\n";
  }
  for (std::size_t i = 1; i < sizes.size(); ++i)
    layout.row_bytes += whole(sizes[i]) * (i < counts.size() ? whole(counts[i]) : 1);
  layout.head = {before + "WIDTH ", "\nHEIGHT 1\nPOINTS ", "\nDATA binary\n"};
  return layout;
}

Layout layout_of(const std::string& ending, std::string_view head, std::uint64_t file_bytes,
                 std::size_t columns) {
  if (ending == ".bin") return layout_of_floats(file_bytes, columns);
  if (ending == ".npy") return layout_of_npy(head, file_bytes);
  if (ending == ".ply") return layout_of_ply(head);
  if (ending == ".pcd") return layout_of_pcd(head);
  return {};
}

}  // namespace

std::optional<CloudBlocks> CloudBlocks::open(const std::filesystem::path& path,
                                             std::vector<std::string> columns,
                                             std::size_t block_bytes) {
  constexpr std::size_t head_bytes = 1U << 16U;
  std::error_code fault;
  const std::uint64_t file_bytes = std::filesystem::file_size(path, fault);
  CloudBlocks blocks;
  blocks.file_ = open_stream(path);
  if (fault || !blocks.file_) return std::nullopt;
  std::string head(head_bytes, '\0');
  blocks.file_.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(blocks.file_.gcount()));
  blocks.file_.clear();
  Layout layout = layout_of(path.extension().string(), head, file_bytes, columns.size());
  if (layout.rows == 0 || layout.row_bytes == 0 || layout.begin > file_bytes) return std::nullopt;
  const std::uint64_t bytes = file_bytes - layout.begin;
  const bool has_rest = path.extension() == ".ply" || path.extension() == ".pcd";
  if (bytes / layout.row_bytes < layout.rows) return std::nullopt;
  if (!has_rest && bytes != layout.rows * layout.row_bytes) return std::nullopt;
  blocks.path_ = path;
  blocks.columns_ = std::move(columns);
  blocks.head_ = std::move(layout.head);
  blocks.digits_ = layout.digits;
  blocks.rows_ = layout.rows;
  blocks.row_bytes_ = static_cast<std::size_t>(layout.row_bytes);
  blocks.block_rows_ = std::max<std::uint64_t>(1, block_bytes / layout.row_bytes);
  blocks.file_.seekg(static_cast<std::streamoff>(layout.begin));
  return blocks;
}

std::optional<CloudFile> CloudBlocks::next() {
  const std::uint64_t rows = std::min(block_rows_, rows_ - rows_read_);
  if (rows == 0) return std::nullopt;
  std::string bytes = head_[0];
  for (std::size_t i = 1; i < head_.size(); ++i)
    bytes += fmt::format("{:>{}}", rows, digits_) + head_[i];
  const std::size_t begin = bytes.size(), count = static_cast<std::size_t>(rows) * row_bytes_;
  bytes.resize(begin + count);
  file_.read(bytes.data() + begin, static_cast<std::streamsize>(count));
  if (static_cast<std::size_t>(file_.gcount()) != count)
    throw Error("{}: it cannot be read from row {} on: was it changed during reading?",
                path_.string(), rows_read_);
  rows_read_ += rows;
  return parse_cloud(bytes, path_.string(), columns_);
}

}  // namespace groundray
