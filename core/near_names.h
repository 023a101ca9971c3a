#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Likely intentions behind misspelled names, for messages. Not installed.
namespace groundray {

/// Returns the candidates that `word` probably means: equal except for the unit, else those that
/// fewest letters distinguish from it, else those that contain it as a part; at most three.
std::vector<std::string> near_names(std::string_view word,
                                    const std::vector<std::string>& candidates);

/// Returns "; did you mean 'x'?" or "; did you mean 'x' or 'y'?" for near names, or "".
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// Returns the reason why there is no file to read at a path, as the end of a message: it is a
/// folder, or does not exist. Names similar files of its folder.
std::string why_no_file(const std::filesystem::path& path);

}  // namespace groundray
