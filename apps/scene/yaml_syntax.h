#pragma once

#include <filesystem>
#include <string>
#include <string_view>

// Explains why a text is no YAML. Not installed.
namespace groundray::yaml {

/// Fault of syntax; line and column count from 1.
struct SyntaxFault {
  int line = 1;
  int column = 1;
  std::string words;
};

/// Returns the likely mistake behind a fault that yaml-cpp reports, and its place.
SyntaxFault explain(std::string_view text, const SyntaxFault& reported);

/// Returns true if the quote at a place is not closed: yaml-cpp takes the rest of the text for its
/// content. The column counts characters.
bool is_open_quote(std::string_view text, int line, int column);

/// Rejects files that are not text, such as rasters.
/// @throws Error that names the file.
void refuse_binary(std::string_view text, const std::filesystem::path& path);

}  // namespace groundray::yaml
