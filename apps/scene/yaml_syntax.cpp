#include "apps/scene/yaml_syntax.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"

namespace groundray::yaml {
namespace {

std::size_t indentation(std::string_view line) {
  return std::min(line.find_first_not_of(" -"), line.size());
}

bool is_blank(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == std::string_view::npos || line[first] == '#';
}

// Returns the position of the colon that ends a key; npos if there is none.
std::size_t colon_in(std::string_view line) {
  const std::size_t colon = line.find(": ");
  return colon == std::string_view::npos && line.ends_with(':') ? line.size() - 1 : colon;
}

std::string_view first_word(std::string_view line) {
  line.remove_prefix(indentation(line));
  return line.substr(0, line.find_first_of(" :#"));
}

// Lines of a text up to the fault, and the one after it.
class Lines {
 public:
  Lines(std::string_view text, int last) {
    TextLines lines(text);
    while (const auto line = lines.next()) {
      lines_.push_back(*line);
      if (std::ssize(lines_) > last) break;
    }
  }

  int count() const { return static_cast<int>(lines_.size()); }
  std::string_view operator[](int line) const {
    return line < 1 || line > count() ? std::string_view()
                                      : lines_[static_cast<std::size_t>(line - 1)];
  }
  // Returns the last line before `line` that is neither blank nor a comment; 0 if there is none.
  int before(int line) const {
    do --line;
    while (line > 0 && is_blank((*this)[line]));
    return std::max(line, 0);
  }

 private:
  std::vector<std::string_view> lines_;
};

std::optional<SyntaxFault> find_tab(const Lines& lines) {
  for (int line = 1; line <= lines.count(); ++line) {
    const std::size_t first = lines[line].find_first_not_of(' ');
    if (first == std::string_view::npos || lines[line][first] != '\t' || is_blank(lines[line]))
      continue;
    return SyntaxFault{line, static_cast<int>(first) + 1,
                       "tabs are not allowed in indentation: use spaces"};
  }
  return std::nullopt;
}

// Explains a key in a place where no key can be.
std::optional<SyntaxFault> explain_key(const Lines& lines, const SyntaxFault& reported) {
  const std::string_view here = lines[reported.line];
  if (const std::size_t colon = colon_in(here);
      colon != std::string_view::npos && colon + 1 < static_cast<std::size_t>(reported.column) - 1)
    return SyntaxFault{reported.line, reported.column,
                       "a value that contains ': ' must be in quotes"};
  const int line = lines.before(reported.line);
  const std::string_view above = lines[line];
  if (line == 0) return std::nullopt;
  const auto column = static_cast<int>(indentation(above)) + 1;
  if (colon_in(above) == std::string_view::npos) {
    const char* const missing =
        above.find(':') == std::string_view::npos ? "':'" : "a space after ':'";
    return SyntaxFault{line, column,
                       fmt::format("{} is missing after '{}'", missing, first_word(above))};
  }
  if (indentation(here) <= indentation(above)) return std::nullopt;
  return SyntaxFault{reported.line, static_cast<int>(indentation(here)) + 1,
                     fmt::format("'{}' is indented more than line {}, whose key has a value: align "
                                 "the two",
                                 first_word(here), line)};
}

// Returns the first bracket of the last ones that are open at a fault. Quotes and comments hide
// brackets; quotes count only where a value can begin.
std::optional<SyntaxFault> find_open_bracket(const Lines& lines, const SyntaxFault& reported) {
  struct Bracket {
    char open;
    int line, column;
  };
  std::vector<Bracket> open;
  for (int line = 1; line <= std::min(lines.count(), reported.line); ++line) {
    const std::string_view text = lines[line];
    char quote = 0, before = ' ';
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      if (line == reported.line && i + 1 >= static_cast<std::size_t>(reported.column)) break;
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if ((c == '"' || c == '\'') &&
                 std::string_view(" [{,").find(before) != std::string_view::npos) {
        quote = c;
      } else if (c == '#' && before == ' ') {
        break;
      } else if (c == '[' || c == '{') {
        open.push_back({c, line, static_cast<int>(i) + 1});
      } else if ((c == ']' || c == '}') && !open.empty()) {
        open.pop_back();
      }
      before = c;
    }
  }
  if (open.empty()) return std::nullopt;
  const auto [bracket, line, column] = open.back();
  return SyntaxFault{line, column,
                     fmt::format("this '{}' is not closed with '{}', or a comma is missing inside",
                                 bracket, bracket == '[' ? ']' : '}')};
}

}  // namespace

SyntaxFault explain(std::string_view text, const SyntaxFault& reported) {
  const Lines lines(text, reported.line);
  if (auto tab = find_tab(lines)) return *tab;
  const std::string_view words = reported.words;
  if (words == "illegal map value") {
    if (auto key = explain_key(lines, reported)) return *key;
  } else if (words.ends_with("flow not found")) {
    if (auto open = find_open_bracket(lines, reported)) return *open;
  } else if (words == "end of map not found" || words == "end of sequence not found") {
    return {reported.line, reported.column,
            "this does not continue the map or list around it: is it indented as the lines above, "
            "and is there no bracket or quote too many?"};
  } else if (words == "illegal flow end") {
    return {reported.line, reported.column,
            "a closing bracket too many, or a quote that is missing"};
  } else if (words == "unknown token") {
    return {reported.line, reported.column, "a value that begins with @, % or ` must be in quotes"};
  } else if (words.starts_with("unknown escape character")) {
    return {reported.line, reported.column,
            "'\\' begins an escape in double quotes: write '\\\\', or use single quotes"};
  } else if (words == "the referenced anchor is not defined") {
    return {reported.line, reported.column,
            "aliases (*name) are not allowed here: write the value out"};
  }
  return {reported.line, reported.column, fmt::format("not YAML: {}", words)};
}

bool is_open_quote(std::string_view text, int line, int column) {
  TextLines lines(text);
  for (int i = 1; i < line; ++i) lines.next();
  text = lines.rest();
  const auto begins_character = [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  };
  std::size_t place = 0;
  for (int left = column; place < text.size(); ++place)
    if (begins_character(text[place]) && --left == 0) break;
  if (place >= text.size() || (text[place] != '"' && text[place] != '\'')) return false;
  const char quote = text[place];
  for (std::size_t i = place + 1; i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;  // the next character is escaped
    } else if (text[i] == quote) {
      if (quote == '"' || i + 1 == text.size() || text[i + 1] != quote) return false;
      ++i;  // two single quotes stand for one
    }
  }
  return true;
}

void refuse_binary(std::string_view text, const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 4> rasters{".tif", ".tiff", ".hgt", ".img"};
  const bool is_raster = std::ranges::count(rasters, file_ending(path)) > 0;
  if (text.find('\0') == std::string_view::npos && !is_raster) return;
  throw Error(
      "{}: not YAML{}", path.string(),
      is_raster
          ? fmt::format(", but a raster by its name: `groundray info {}` describes it, and a scene "
                        "file names it at terrain.dem",
                        path.string())
          : ": it contains binary data; save text as UTF-8");
}

}  // namespace groundray::yaml
