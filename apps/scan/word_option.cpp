#include "apps/scan/word_option.h"

#include <algorithm>

namespace groundray {
namespace {

// Joins words as in "a", "a or b", "a, b or c".
std::string said(const Words<std::string>& texts) {
  std::string all;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (i > 0) all += i + 1 == texts.size() ? " or " : ", ";
    all += texts[i].first;
  }
  return all;
}

}  // namespace

CLI::Validator one_of(const Words<std::string>& texts) {
  const auto exchange = [texts](std::string& word) {
    const auto found =
        std::ranges::find_if(texts, [&](const auto& text) { return text.first == word; });
    if (found == texts.end()) return "'" + word + "' must be " + said(texts);
    word = found->second;
    return std::string();
  };
  return {exchange, ""};
}

std::string listed(const Words<std::string>& texts) {
  std::string all;
  for (const auto& text : texts) all += (all.empty() ? "" : "|") + text.first;
  return all;
}

}  // namespace groundray
