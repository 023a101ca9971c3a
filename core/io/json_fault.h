#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace groundray {

/// Returns what is wrong with a JSON file, in words for its author: nlohmann's own messages name
/// its exceptions and functions.
inline std::string fault_in_words(const nlohmann::json::exception& fault) {
  constexpr int no_such_key = 403;
  std::string_view why = fault.what();
  if (const auto* parse = dynamic_cast<const nlohmann::json::parse_error*>(&fault)) {
    why = why.substr(0, why.find("; last read"));  // what follows is the file's own text
    const char* reason = "";
    if (why.find("unexpected end of input") != why.npos || why.find("missing closing") != why.npos)
      reason = "; was the file cut short?";
    if (why.find("UTF-8") != why.npos) reason = ": it is not UTF-8";
    return fmt::format("its JSON is invalid at byte {}{}", parse->byte, reason);
  }
  why.remove_prefix(why.find(' ') + 1);  // "[json.exception.out_of_range.403] "
  if (fault.id == no_such_key)           // "key 'a' not found"
    return fmt::format("{} is missing", why.substr(0, why.rfind(" not found")));
  if (why.starts_with("cannot use "))  // "cannot use at() with string"
    return fmt::format("a {} stands where an object or a list must be",
                       why.substr(why.rfind(' ') + 1));
  return std::string(why);
}

}  // namespace groundray
