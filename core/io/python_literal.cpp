#include "core/io/python_literal.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/error.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  PythonLiteral parse_all() {
    PythonLiteral literal = parse(0);
    skip_blanks();
    if (!text_.empty()) fail();
    return literal;
  }

 private:
  PythonLiteral parse(int depth) {
    constexpr int most_depth = 32;
    skip_blanks();
    if (text_.empty() || depth > most_depth) fail();
    switch (text_[0]) {
      case '\'':
      case '"':
        return {parse_text()};
      case '(':
        return parse_list(')', depth);
      case '[':
        return parse_list(']', depth);
      case '{':
        return parse_dict(depth);
      default:
        return parse_word();
    }
  }

  [[noreturn]] void fail() const {
    throw Error("the header cannot be read at {:?}", text_.substr(0, 40));
  }

  void skip_blanks() {
    text_.remove_prefix(std::min(text_.find_first_not_of(" \t\r\n"), text_.size()));
  }

  /// Removes `c` if it comes next; returns whether it did.
  bool takes(char c) {
    skip_blanks();
    if (!text_.starts_with(c)) return false;
    text_.remove_prefix(1);
    return true;
  }

  std::string parse_text() {
    const char quote = text_[0];
    std::string out;
    for (std::size_t i = 1; i < text_.size(); ++i) {
      if (text_[i] == quote) {
        text_.remove_prefix(i + 1);
        return out;
      }
      if (text_[i] == '\\') {  // the escaped character does not matter, but may be a quote
        if (++i == text_.size()) break;
      }
      out += text_[i];
    }
    fail();
  }

  /// Parses a list or tuple. A single value in parentheses is a tuple only if a comma follows it.
  PythonLiteral parse_list(char end, int depth) {
    text_.remove_prefix(1);
    PythonLiteral::List list;
    bool has_comma = false;
    while (!takes(end)) {
      if (!list.empty() && !has_comma) fail();
      list.push_back(parse(depth + 1));
      has_comma = takes(',');
    }
    if (end == ')' && list.size() == 1 && !has_comma) return std::move(list[0]);
    return {std::move(list)};
  }

  PythonLiteral parse_dict(int depth) {
    text_.remove_prefix(1);
    PythonLiteral::Dict dict;
    bool has_comma = true;
    while (!takes('}')) {
      if (!has_comma) fail();
      const PythonLiteral key = parse(depth + 1);
      if (key.as<std::string>() == nullptr || !takes(':')) fail();
      dict.keys.push_back(*key.as<std::string>());
      dict.values.push_back(parse(depth + 1));
      has_comma = takes(',');
    }
    return {std::move(dict)};
  }

  PythonLiteral parse_word() {
    const auto is_of_word = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '+' || c == '_';
    };
    const auto end = std::ranges::find_if_not(text_, is_of_word);
    const auto word = text_.substr(0, static_cast<std::size_t>(end - text_.begin()));
    PythonLiteral literal;
    if (word == "True" || word == "False") {
      literal.value = word == "True";
    } else if (const auto number = number_of<std::int64_t>(word)) {
      literal.value = *number;
    } else if (word != "None") {
      fail();
    }
    text_.remove_prefix(word.size());
    if (literal.as<std::int64_t>() != nullptr && text_.starts_with('L')) text_.remove_prefix(1);
    return literal;
  }

  std::string_view text_;
};

}  // namespace

const PythonLiteral* PythonLiteral::find(std::string_view key) const {
  const auto* dict = as<Dict>();
  if (dict == nullptr) return nullptr;
  const auto found = std::ranges::find(dict->keys, key);
  if (found == dict->keys.end()) return nullptr;
  return &dict->values[static_cast<std::size_t>(found - dict->keys.begin())];
}

PythonLiteral parse_python_literal(std::string_view text) { return Parser(text).parse_all(); }

}  // namespace groundray
