#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"

// Strict YAML reader for specifications and programs, not installed. It keeps the position of each
// value, and records every fault of a file instead of stopping at the first.
namespace groundray::yaml {

/// Value and its position in the file; line and column count from 1.
struct Node {
  enum class Kind { Null, Plain, Quoted, List, Map };
  Kind kind = Kind::Null;
  int line = 1;
  int column = 1;
  std::string text;         ///< text of a Plain or Quoted scalar
  std::vector<Node> items;  ///< items of a List; keys and values of a Map, alternating
};

/// Returns the text of a file of at most 16 MiB.
/// @throws Error if the file cannot be read or is larger.
std::string read_file(const std::filesystem::path& path);

/// Returns the single document of a text. Aliases are rejected: a few lines of them can represent
/// gigabytes.
/// @throws Error with `path` and position if the text is not YAML, is empty, has two documents or
///         aliases, or is deeper than 32 levels.
Node parse(const std::string& text, const std::filesystem::path& path);

/// Returns a value as shown in messages: short, and on one line.
std::string shown(const Node& node);

/// Faults of one file.
class Faults {
 public:
  explicit Faults(std::filesystem::path path) : path_(std::move(path)) {}

  /// Records a fault of the value of `key`, which is at `node`; an empty key represents the whole
  /// file.
  template <typename... Args>
  void add(const Node& node, std::string_view key, fmt::format_string<Args...> format,
           Args&&... args) {
    note(node, key, fmt::format(format, std::forward<Args>(args)...));
  }

  /// Throws the recorded faults, if there are any.
  /// @throws Error with a line for each fault, in the order of the file; those after the first 200
  ///         are only counted.
  void throw_if_any();

  std::size_t count() const { return faults_.size(); }

  /// Returns a value's position for later messages: path:line:column.
  std::string place(const Node& node) const;

 private:
  struct Fault {
    int line;
    int column;
    std::string message;
  };
  void note(const Node& node, std::string_view key, const std::string& message);

  std::filesystem::path path_;
  std::vector<Fault> faults_;
};

/// Condition on a number, and its words in messages.
struct Rule {
  bool (*holds)(double value);
  const char* words;
};
inline constexpr Rule any_number{[](double) { return true; }, ""};
inline constexpr Rule positive{[](double value) { return value > 0; }, "must be > 0"};
inline constexpr Rule not_negative{[](double value) { return value >= 0; }, "must be >= 0"};
inline constexpr Rule at_least_one{[](double value) { return value >= 1; }, "must be 1 or more"};
/// Fraction of a whole.
inline constexpr Rule share_rule{[](double value) { return value >= 0 && value <= 1; },
                                 "must be from 0 to 1"};
/// Positive fraction of a whole.
inline constexpr Rule positive_share_rule{[](double value) { return value > 0 && value <= 1; },
                                          "must be > 0 and at most 1"};

enum class Need { Required, Optional };

/// Map of a file while it is read. Each read_ function marks its key as known. If the key is
/// present and its value valid, it sets `into` and returns the value's node; otherwise it changes
/// nothing, records any fault and returns null. Call `close` at the end, or `close_partly`.
class Map {
 public:
  /// @param node  value of any kind; if it is not a map, that is a fault and the map has no keys.
  Map(const Node& node, std::string_view key, Faults& faults);

  /// Returns the value of a key; null if it is missing.
  const Node* find(std::string_view key, Need need);

  const Node* read_number(std::string_view key, Need need, double& into, Rule rule = any_number);
  const Node* read_number(std::string_view key, Need need, std::optional<double>& into,
                          Rule rule = any_number);
  /// Reads a number whose unit is `scale` times that of `into`. The rule applies to the number in
  /// the file.
  const Node* read_scaled(std::string_view key, Need need, double scale, double& into,
                          Rule rule = not_negative);
  /// Reads a list of exactly as many numbers as `into` holds.
  const Node* read_numbers(std::string_view key, Need need, std::span<double> into,
                           Rule rule = any_number);
  template <glm::length_t n>
  const Node* read_vector(std::string_view key, Need need, glm::vec<n, double>& into,
                          Rule rule = any_number) {
    return read_numbers(key, need, std::span<double>(&into.x, n), rule);
  }
  /// Reads a text: any scalar that is not empty.
  const Node* read_text(std::string_view key, Need need, std::string& into);
  /// Reads a whole number in [0, max of T].
  template <std::unsigned_integral T>
  const Node* read_whole(std::string_view key, Need need, T& into) {
    std::uint64_t value = into;
    const Node* node = read_whole(key, need, value, std::numeric_limits<T>::max());
    into = static_cast<T>(value);
    return node;
  }
  /// Reads one of several words.
  template <typename T>
  const Node* read_choice(std::string_view key, Need need, T& into,
                          std::initializer_list<std::pair<std::string_view, T>> choices) {
    std::vector<std::string> words;
    for (const auto& [word, value] : choices) words.emplace_back(word);
    std::size_t index = 0;
    const Node* node = read_choice(key, need, index, words);
    if (node) into = (choices.begin() + index)->second;
    return node;
  }
  /// Reads one of the words of an enumeration's values, which are given in the order of the values.
  template <typename T>
    requires std::is_enum_v<T>
  const Node* read_choice(std::string_view key, Need need, T& into,
                          const std::vector<std::string>& words) {
    std::size_t index = 0;
    const Node* node = read_choice(key, need, index, words);
    if (node) into = static_cast<T>(index);
    return node;
  }
  /// Returns the items of a list; none if it is missing or not a list.
  std::span<const Node> list(std::string_view key, Need need);
  /// Returns the map at a key; nullopt if it is missing.
  std::optional<Map> map(std::string_view key, Need need);

  /// Records keys that were never queried, and required keys that are missing.
  void close();
  /// Records required keys that are missing; keys that were never queried are left to other
  /// readers.
  void close_partly();

  const Node& node() const { return node_; }

 private:
  const Node* read_whole(std::string_view key, Need need, std::uint64_t& into, std::uint64_t max);
  const Node* read_choice(std::string_view key, Need need, std::size_t& index,
                          const std::vector<std::string>& words);

  const Node& node_;
  Faults& faults_;
  std::vector<std::string> known_;    // queried keys
  std::vector<std::string> absent_;   // queried keys that are missing
  std::vector<std::string> missing_;  // required keys that are missing
};

/// Returns the number that a value represents; otherwise records a fault and returns nullopt.
std::optional<double> number(const Node& node, std::string_view key, Rule rule, Faults& faults);
/// Reads a list of exactly as many numbers as `into` holds; otherwise records a fault, changes
/// nothing and returns false.
bool numbers(const Node& node, std::string_view key, std::span<double> into, Rule rule,
             Faults& faults);
/// Returns true if a value is a text that is not empty; records a fault otherwise.
bool is_text(const Node& node, std::string_view key, Faults& faults);

/// Reads the version of a format at `key`; records a fault unless it is 1.
void check_version(Map& root, std::string_view key, Faults& faults);

}  // namespace groundray::yaml
