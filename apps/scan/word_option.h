#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace groundray {

/// Words that an option accepts, with their values, in the order of display.
template <typename Value>
using Words = std::vector<std::pair<std::string, Value>>;

/// Returns a transformation that accepts only the given words, and replaces a word by its text.
CLI::Validator one_of(const Words<std::string>& texts);

/// Returns the words in the form of a usage line: a|b|c.
std::string listed(const Words<std::string>& texts);

/// Adds an option that accepts the given words; sets `held` to the enumerator of the word.
template <typename Held, typename Value>
CLI::Option* add_words(CLI::App* app, const std::string& name, Held& held,
                       const std::string& meaning, const Words<Value>& words) {
  static_assert(std::is_enum_v<Value>);
  static_assert(std::is_same_v<Held, Value> || std::is_same_v<Held, std::optional<Value>>);
  Words<std::string> texts;  // CLI11 reads the number of an enumerator
  for (const auto& [word, value] : words)
    texts.emplace_back(word, std::to_string(static_cast<std::underlying_type_t<Value>>(value)));
  return app->add_option(name, held, meaning)->transform(one_of(texts))->option_text(listed(texts));
}

}  // namespace groundray
