#include "core/near_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <ranges>
#include <system_error>
#include <utility>

#include "core/folder_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_names = 3;

// Returns a key without the units at its end.
std::string_view without_unit(std::string_view key) {
  constexpr std::array<std::string_view, 25> units{
      "m",  "km",  "cm",  "mm",  "um",   "nm",  "ft",  "s",   "ms",  "us", "ns", "min", "h",
      "hz", "khz", "rpm", "rad", "mrad", "deg", "kmh", "kph", "mph", "px", "w",  "kt"};
  for (auto cut = key.rfind('_'); cut != std::string_view::npos && cut > 0; cut = key.rfind('_')) {
    if (std::ranges::count(units, key.substr(cut + 1)) == 0) break;
    key = key.substr(0, cut);
  }
  return key;
}

// Returns the Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

// Returns the names of a folder's files and folders, sorted; none if it cannot be read. Those with
// control characters are left out, and so are all after the first 10,000.
std::vector<std::string> printable_names(const fs::path& folder) {
  constexpr std::size_t most = 10'000;
  std::error_code fault;
  std::vector<std::string> names = names_in(folder, fault);
  std::erase_if(names, [](const std::string& name) {
    return std::ranges::any_of(name, [](unsigned char c) { return std::iscntrl(c) != 0; });
  });
  if (names.size() > most) names.resize(most);
  return names;
}

// Lists the names of one extension, if they are few.
std::string files_like(const fs::path& path, const std::vector<std::string>& names) {
  constexpr std::size_t most = 5;
  std::vector<std::string_view> alike;
  for (const std::string& name : names) {
    if (path.has_extension() && fs::path(name).extension() == path.extension())
      alike.push_back(name);
  }
  if (alike.empty() || alike.size() > most) return "";
  return fmt::format("; the {} files there: {}", path.extension().string(), fmt::join(alike, ", "));
}

}  // namespace

std::vector<std::string> near_names(std::string_view word,
                                    const std::vector<std::string>& candidates) {
  const std::string_view stem = without_unit(word);
  std::vector<std::string> near;
  std::size_t best = 1 + stem.size() / 3;  // farther apart, it is a different word
  for (const std::string& candidate : candidates) {
    const std::string_view other = without_unit(candidate);
    if (other == stem) return {candidate};
    if (other.size() > stem.size() + best || stem.size() > other.size() + best) continue;
    const std::size_t distance = edit_distance(stem, other);
    if (distance > best) continue;
    if (distance < best) near.clear();
    best = distance;
    near.push_back(candidate);
  }
  if (near.empty() && stem.size() > 2) {
    std::ranges::copy_if(candidates, std::back_inserter(near), [&](const std::string& candidate) {
      return candidate.find(stem) != std::string::npos;
    });
  }
  if (near.size() > most_names) near.resize(most_names);
  return near;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  const std::vector<std::string> near = near_names(word, candidates);
  if (near.empty()) return "";
  std::string list = fmt::format("'{}'", near.front());
  for (std::size_t i = 1; i < near.size(); ++i)
    list += fmt::format("{}'{}'", i + 1 < near.size() ? ", " : " or ", near[i]);
  return fmt::format("; did you mean {}?", list);
}

std::string why_no_file(const fs::path& path) {
  std::error_code ignored;
  if (path.empty()) return "the name is empty";
  if (path.string().find("://") != std::string::npos)
    return "it is an address, but must be a file: download it first";
  if (fs::is_directory(path, ignored)) return "it is a folder, but must be a file";
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (!fs::is_directory(folder, ignored))
    return fmt::format("there is no such file or folder, nor the folder {}", folder.string());
  const std::vector<std::string> names = printable_names(folder);
  const std::string near = suggestion(path.filename().string(), names);
  return "there is no such file or folder" + (near.empty() ? files_like(path, names) : near);
}

}  // namespace groundray
