#include "core/model/ply_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

#include "core/error.h"

namespace groundray {
namespace {

template <typename Values>
double take(std::string_view& bytes, bool is_big) {
  using T = typename Values::value_type;
  std::array<char, sizeof(T)> raw;
  if (bytes.size() < raw.size()) throw Error("the last row is incomplete: is it truncated?");
  bytes.copy(raw.data(), raw.size());
  bytes.remove_prefix(raw.size());
  if (is_big) std::ranges::reverse(raw);
  return static_cast<double>(std::bit_cast<T>(raw));
}

template <std::size_t... I>
double take_any(std::size_t type, std::string_view& bytes, bool is_big,
                std::index_sequence<I...> /*all types*/) {
  double value = 0;
  ((type == I
        ? void(value = take<std::variant_alternative_t<I, PointCloud::AnyValues>>(bytes, is_big))
        : void()),
   ...);
  return value;
}

}  // namespace

double PlyValues::next(std::size_t type) {
  if (is_ascii_) return next_word();
  return take_any(type, bytes_, is_big_, std::make_index_sequence<ply_type_count>());
}

std::size_t PlyValues::next_count(std::size_t type, const std::string& element, std::uint64_t row) {
  const double count = next(type);
  if (!(count >= 0 && count <= static_cast<double>(bytes_left())) || count != std::floor(count))
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

PlyLayout ply_layout(TextLines& lines) {
  PlyLayout layout;
  for (auto line = lines.next(); line && *line != "end_header"; line = lines.next()) {
    const auto words = words_of(*line);
    if (words.empty()) continue;
    if (words[0] == "format") layout.format = words.at(1);
    if (words[0] == "obj_info") layout.infos.push_back(line->substr(line->find("obj_info") + 8));
    if (words[0] == "element") {
      layout.elements.push_back(
          {std::string(words.at(1)), *number_of<std::uint64_t>(words.at(2)), {}});
    }
    if (words[0] == "property") {
      PlyProperty property{std::string(words.back()), ply_type_of(words[words.size() - 2]), {}};
      if (words.at(1) == "list") property.count_type = ply_type_of(words.at(2));
      layout.elements.back().properties.push_back(property);
    }
  }
  return layout;
}

void check_rows(const PlyElement& element, const PlyValues& values) {
  if (element.rows <= values.bytes_left()) return;
  throw Error("{} rows of element {} do not fit in {} bytes: is it truncated?", element.rows,
              element.name, values.bytes_left());
}

}  // namespace groundray
