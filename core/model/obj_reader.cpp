#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/text_lines.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

using Words = std::vector<std::string_view>;
using SoupSurface = PolygonSoup::Surface;

/// Returns the rest of a line after its first word, without surrounding blanks; names may contain
/// blanks.
std::string rest_of(std::string_view line, std::string_view first) {
  line.remove_prefix(static_cast<std::size_t>(first.data() - line.data()) + first.size());
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return std::string(line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin));
}

/// Returns the part of a name before " #", or all of it. Only the set of existing names decides
/// whether " #" begins a comment or belongs to the name.
std::string without_comment(const std::string& name) {
  constexpr std::string_view blanks = " \t";
  std::size_t hash = name.find('#');
  while (hash != std::string::npos && hash > 0 && blanks.find(name[hash - 1]) == blanks.npos) {
    hash = name.find('#', hash + 1);
  }
  if (hash == std::string::npos) return name;
  const std::string_view before = std::string_view(name).substr(0, hash);
  return std::string(before.substr(0, before.find_last_not_of(blanks) + 1));
}

/// Calls `take(line, words)` for each line with words, after joining continued lines and removing
/// comments from `words`. Adds file and line to its Errors.
template <typename Take>
void for_each_line(std::string_view text, const std::string& name, const Take& take) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // UTF-8
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  TextLines lines(text);
  std::string joined;
  try {
    while (const auto next = lines.next()) {
      joined = *next;
      while (joined.ends_with('\\')) {
        joined.back() = ' ';
        if (const auto more = lines.next()) joined += *more;
      }
      const std::string_view line = joined;
      Words words = words_of(line);
      words.erase(std::ranges::find_if(words, [](auto word) { return word.starts_with('#'); }),
                  words.end());
      if (!words.empty()) take(line, words);
    }
  } catch (const Error& rule) {
    throw Error("{}:{}: {}", name, lines.number(), rule.what());
  }
}

double number(std::string_view word) {
  // NaN and infinity as spelt by older Microsoft C libraries: 1.#QNAN, -1.#IND, 1.#INF.
  if (word.find(".#") != std::string_view::npos) return std::numeric_limits<double>::quiet_NaN();
  const auto value = number_of<double>(word);
  if (!value) throw Error("{:?} is not a number", word.substr(0, 40));
  return *value;
}

template <std::size_t N>
std::array<double, N> numbers(const Words& words) {
  if (words.size() <= N) throw Error("{} needs {} numbers", words[0], N);
  std::array<double, N> values;
  for (std::size_t i = 0; i < N; ++i) values[i] = number(words[i + 1]);
  return values;
}

/// Returns the number of words that an option of a map takes, itself included; 0 if it is not an
/// option. -o, -s and -t take one to three numbers.
std::size_t option_length(const Words& words, std::size_t at) {
  static constexpr std::array<std::string_view, 8> one{"-blendu", "-blendv", "-boost",   "-cc",
                                                       "-clamp",  "-bm",     "-imfchan", "-texres"};
  const std::string_view option = words[at];
  if (std::ranges::find(one, option) != one.end() || option == "-type") return 2;
  if (option == "-mm") return 3;
  if (option != "-o" && option != "-s" && option != "-t") return 0;
  std::size_t length = 1;
  while (length < 4 && at + length < words.size() && number_of<double>(words[at + length])) {
    ++length;
  }
  return length;
}

std::string map_name(std::string_view line, const Words& words) {
  std::size_t at = 1;
  while (at < words.size()) {
    const std::size_t length = option_length(words, at);
    if (length == 0) break;
    at += length;
  }
  if (at >= words.size()) throw Error("{} must name an image", words[0]);
  return rest_of(line, words[at - 1]);
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return out;
}

std::vector<SoupSurface> parse_mtl(std::string_view text, const std::string& name) {
  std::vector<SoupSurface> surfaces;
  for_each_line(text, name, [&](std::string_view line, const Words& words) {
    const std::string key = lower(words[0]);
    if (key == "newmtl") {
      surfaces.push_back({.looks = {.name = rest_of(line, words[0])}});
      return;
    }
    const bool is_known = key == "kd" || key == "map_kd" || key == "map_d" || key == "norm" ||
                          key == "map_kn" || key == "map_bump" || key == "bump";
    if (!is_known) return;
    if (surfaces.empty()) throw Error("{} must follow a newmtl", words[0]);
    SoupSurface& surface = surfaces.back();
    if (key == "kd") {
      // The file of a spectrum, or CIE XYZ: both are rare, and white is better than a guess.
      if (words.size() < 2 || words[1] == "spectral" || words[1] == "xyz") return;
      const double red = number(words[1]);
      const auto rgb = words.size() > 3 ? numbers<3>(words) : std::array{red, red, red};
      surface.looks.color = linear_color(glm::dvec3(rgb[0], rgb[1], rgb[2]));
    } else if (key == "map_kd") {
      surface.albedo = map_name(line, words);
    } else if (key == "map_d") {
      surface.opacity = map_name(line, words);
    } else if (key == "norm" || key == "map_kn" || surface.normal.empty()) {
      surface.normal = map_name(line, words);  // norm takes precedence over bump
    }
  });
  return surfaces;
}

class ObjReader {
 public:
  explicit ObjReader(const std::function<std::string(const std::string&)>& read_mtl)
      : read_mtl_(read_mtl) {}

  void take(std::string_view line, const Words& words) {
    const std::string_view key = words[0];
    if (key == "v") {
      const auto p = numbers<3>(words);
      soup_.positions.emplace_back(p[0], p[1], p[2]);
    } else if (key == "vt") {
      const double u = numbers<1>(words)[0];
      soup_.uv.emplace_back(u, words.size() > 2 ? number(words[2]) : 0);
    } else if (key == "vn") {
      const auto n = numbers<3>(words);
      soup_.normals.emplace_back(n[0], n[1], n[2]);
    } else if (key == "f" || key == "fo") {
      add_polygon(words);
    } else if (key == "usemtl") {
      use(rest_of(line, key));
    } else if (key == "mtllib") {
      add_library(rest_of(line, key), words);
    } else if (key == "l" || key == "p" || key == "curv" || key == "curv2" || key == "surf") {
      ++soup_.skipped;
    }
  }

  PolygonSoup soup() && {
    drop_comments();
    for (SoupSurface& surface : soup_.surfaces) {
      const auto found = library_.find(surface.looks.name);
      if (found != library_.end()) surface = found->second;
    }
    return std::move(soup_);
  }

 private:
  /// Converts a 1-based index to a 0-based one; -1 is the last element so far.
  static std::uint32_t index(std::string_view word, std::size_t count) {
    const auto value = number_of<std::int64_t>(word);
    if (!value || *value == 0)
      throw Error("{:?} must be an integer other than 0", word.substr(0, 40));
    const std::int64_t from_0 = *value > 0 ? *value - 1 : static_cast<std::int64_t>(count) + *value;
    constexpr std::int64_t beyond = PolygonSoup::none - 1;  // out of range of any array
    return static_cast<std::uint32_t>(from_0 < 0 ? beyond : std::min(from_0, beyond));
  }

  void add_polygon(const Words& words) {
    if (words.size() < 4) throw Error("{} needs 3 corners or more", words[0]);
    if (soup_.surfaces.empty()) use("default");
    soup_.polygons.push_back({soup_.corners.size(), words.size() - 1, surface_});
    for (auto word = words.begin() + 1; word != words.end(); ++word) {
      const std::size_t slash = std::min(word->find('/'), word->size());
      const std::size_t second = std::min(word->find('/', slash + 1), word->size());
      const std::size_t begin = std::min(slash + 1, second);
      const std::string_view uv = word->substr(begin, second - begin);
      const std::string_view normal = word->substr(std::min(second + 1, word->size()));
      PolygonSoup::Corner corner;
      corner.position = index(word->substr(0, slash), soup_.positions.size());
      if (!uv.empty()) corner.uv = index(uv, soup_.uv.size());
      if (!normal.empty()) corner.normal = index(normal, soup_.normals.size());
      soup_.corners.push_back(corner);
    }
  }

  void use(const std::string& name) {
    const auto [found, is_new] =
        numbers_.try_emplace(name, static_cast<std::uint32_t>(soup_.surfaces.size()));
    if (is_new) soup_.surfaces.push_back({.looks = {.name = name}});
    surface_ = found->second;
  }

  /// Renames all surfaces, now that the whole library has been read: the comment is removed from
  /// each name that the library does not contain in full. Surfaces that then have the same name
  /// become one.
  void drop_comments() {
    const auto in_full = library_;
    for (const auto& [name, surface] : in_full) {
      const auto [added, is_new] = library_.try_emplace(without_comment(name), surface);
      added->second.looks.name = added->first;
    }
    const std::vector<SoupSurface> named = std::exchange(soup_.surfaces, {});
    std::vector<std::uint32_t> number_now;
    numbers_.clear();
    for (const SoupSurface& surface : named) {
      const std::string& name = surface.looks.name;
      use(in_full.contains(name) ? name : without_comment(name));
      number_now.push_back(surface_);
    }
    for (auto& polygon : soup_.polygons) polygon.surface = number_now[polygon.surface];
  }

  void add(const std::string& name, const std::string& mtl) {
    read_.insert(name);
    for (SoupSurface& surface : parse_mtl(mtl, name)) {
      library_.try_emplace(surface.looks.name, surface);
    }
  }

  /// Adds a library, unless that has been done: only its first definitions count.
  void add_once(const std::string& name) {
    if (!read_.contains(name)) add(name, read_mtl_(name));
  }

  /// Adds one library, whose name may contain blanks, or several whose names do not.
  void add_library(const std::string& all, const Words& words) {
    const std::string name = without_comment(all);
    if (read_.contains(all)) return;
    if (name != all) {
      std::optional<std::string> mtl;
      try {
        mtl = read_mtl_(all);
      } catch (const Error&) {
        // No such file exists, so the rest is a comment.
      }
      if (mtl) return add(all, *mtl);
    }
    if (words.size() == 2 || name.find(".mtl ") == std::string::npos) {
      return add_once(name);
    }
    for (auto word = words.begin() + 1; word != words.end(); ++word) add_once(std::string(*word));
  }

  const std::function<std::string(const std::string&)>& read_mtl_;
  PolygonSoup soup_;
  std::map<std::string, std::uint32_t, std::less<>> numbers_;  // surface numbers by name
  std::map<std::string, SoupSurface, std::less<>> library_;
  std::set<std::string> read_;  // names of libraries
  std::uint32_t surface_ = 0;
};

}  // namespace

PolygonSoup parse_obj(std::string_view text, const std::string& name,
                      const std::function<std::string(const std::string&)>& read_mtl) {
  ObjReader reader(read_mtl);
  for_each_line(text, name,
                [&](std::string_view line, const Words& words) { reader.take(line, words); });
  return std::move(reader).soup();
}

}  // namespace groundray
