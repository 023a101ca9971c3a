#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace groundray {

/// Iterates over the lines of a text and counts them from 1; LF or CRLF ends a line.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : text_(text) {}

  /// Returns the next line without its line ending, or nothing after the last line.
  std::optional<std::string_view> next() {
    if (offset_ == text_.size()) return std::nullopt;
    const std::size_t end = text_.find('\n', offset_);
    ended_ = end != std::string_view::npos;
    std::string_view line = text_.substr(offset_, end - offset_);
    offset_ = ended_ ? end + 1 : text_.size();
    ++number_;
    if (ended_ && line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  /// Returns the number of the line that next() returned last.
  std::size_t number() const { return number_; }

  /// Returns whether that line had a line ending; if not, the text may be truncated.
  bool ended() const { return ended_; }

  /// Returns all text after that line.
  std::string_view rest() const { return text_.substr(offset_); }

 private:
  std::string_view text_;
  std::size_t offset_ = 0;
  std::size_t number_ = 0;
  bool ended_ = true;
};

/// Returns the words of a line, separated by blanks and tabs.
inline std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view blanks = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(blanks); begin != std::string_view::npos;) {
    const std::size_t end = line.find_first_of(blanks, begin);
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(blanks, end);
  }
  return words;
}

/// Returns the number that `word` spells in full, whatever the locale; nothing if it is malformed
/// or T cannot hold it.
template <typename T>
std::optional<T> number_of(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  T value{};
  const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (fault != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

}  // namespace groundray
