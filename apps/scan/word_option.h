#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace groundray {

/// What the words that an option takes stand for, in the order in which people read them.
template <typename Value>
using Words = std::vector<std::pair<std::string, Value>>;

/// Takes one of the words and nothing else, and hands on the text beside it.
CLI::Validator one_of(const Words<std::string>& texts);

/// Returns words as a usage line has them: a|b|c.
std::string listed(const Words<std::string>& texts);

/// Adds an option that takes one of some words; `held` gets the enumerator that it stands for.
template <typename Held, typename Value>
CLI::Option* add_words(CLI::App* app, const std::string& name, Held& held,
                       const std::string& meaning, const Words<Value>& words) {
  static_assert(std::is_enum_v<Value>);
  static_assert(std::is_same_v<Held, Value> || std::is_same_v<Held, std::optional<Value>>);
  Words<std::string> texts;  // CLI reads an enumerator's number
  for (const auto& [word, value] : words)
    texts.emplace_back(word, std::to_string(static_cast<std::underlying_type_t<Value>>(value)));
  return app->add_option(name, held, meaning)->transform(one_of(texts))->option_text(listed(texts));
}

}  // namespace groundray
