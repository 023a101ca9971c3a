#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"

// A strict reader of YAML for the specs and the programs, not installed: it knows where each value
// stands, and notes every fault of a file instead of stopping at the first.
namespace groundray::yaml {

/// A value and where it stands in its file; line and column count from 1.
struct Node {
  enum class Kind { Null, Plain, Quoted, List, Map };
  Kind kind = Kind::Null;
  int line = 1;
  int column = 1;
  std::string text;         ///< of a Plain or Quoted scalar
  std::vector<Node> items;  ///< of a List; of a Map, key and value by turns
};

/// Returns the text of a file of at most 16 MiB. @throws Error if it cannot.
std::string read_file(const std::filesystem::path& path);

/// Returns the one document of a text. Aliases are refused: a few lines of them can stand for
/// gigabytes.
/// @throws Error with `path` and position if the text is not YAML, empty, of two documents or
/// deeper than 32 levels.
Node parse(const std::string& text, const std::filesystem::path& path);

/// Returns a value as a message shows it: short, and on one line.
std::string shown(const Node& node);

/// The faults found in one file.
class Faults {
 public:
  explicit Faults(std::filesystem::path path) : path_(std::move(path)) {}

  /// Notes a fault of the value of `key`, which stands at `node`; an empty key stands for the whole
  /// file.
  template <typename... Args>
  void add(const Node& node, std::string_view key, fmt::format_string<Args...> format,
           Args&&... args) {
    note(node, key, fmt::format(format, std::forward<Args>(args)...));
  }

  /// @throws Error with a line for each fault, in the order of the file, if there is any; after 200
  ///         it only counts them.
  void throw_if_any();

  std::size_t count() const { return faults_.size(); }

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

/// What a number must obey, and the words for it.
struct Rule {
  bool (*holds)(double value);
  const char* words;
};
inline constexpr Rule any_number{[](double) { return true; }, ""};
inline constexpr Rule positive{[](double value) { return value > 0; }, "must be > 0"};
inline constexpr Rule not_negative{[](double value) { return value >= 0; }, "must be >= 0"};
inline constexpr Rule at_least_one{[](double value) { return value >= 1; }, "must be 1 or more"};
/// A share of a whole.
inline constexpr Rule share_rule{[](double value) { return value >= 0 && value <= 1; },
                                 "must be from 0 to 1"};
/// A share of a whole that is not nothing.
inline constexpr Rule positive_share_rule{[](double value) { return value > 0 && value <= 1; },
                                          "must be > 0 and at most 1"};

enum class Need { Required, Optional };

/// One map of a file while it is read. Each read_ function makes its key known; if the key is there
/// and its value sound, it sets `into` and returns the value's node, else it changes nothing, notes
/// what is wrong and returns null. Call `close` at the end, or `close_partly`.
class Map {
 public:
  /// @param node  a value of any kind; if it is no map, that is a fault and the map has no keys.
  Map(const Node& node, std::string_view key, Faults& faults);

  /// Returns the value of a key; null if it is not there.
  const Node* find(std::string_view key, Need need);

  const Node* read_number(std::string_view key, Need need, double& into, Rule rule = any_number);
  /// Reads a number in a unit that is `scale` times that of `into`. The rule is of the number.
  const Node* read_scaled(std::string_view key, Need need, double scale, double& into,
                          Rule rule = not_negative);
  /// Reads a list of exactly as many numbers as `into` holds.
  const Node* read_numbers(std::string_view key, Need need, std::span<double> into,
                           Rule rule = any_number);
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
  /// Reads one of a few words.
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
  /// Returns the items of a list; none if it is missing or no list.
  std::span<const Node> list(std::string_view key, Need need);
  /// Returns the map at a key; nothing if it is missing.
  std::optional<Map> map(std::string_view key, Need need);

  /// Notes the keys that nothing asked for and those that are missing.
  void close();
  /// Notes those that are missing alone: what nothing asked for is for others.
  void close_partly();

  const Node& node() const { return node_; }

 private:
  const Node* read_whole(std::string_view key, Need need, std::uint64_t& into, std::uint64_t max);
  const Node* read_choice(std::string_view key, Need need, std::size_t& index,
                          const std::vector<std::string>& words);

  const Node& node_;
  Faults& faults_;
  std::vector<std::string> known_;    // keys that were asked for
  std::vector<std::string> absent_;   // those of them that are not there
  std::vector<std::string> missing_;  // those of them that must be
};

/// Returns the number that a value spells; else notes the fault.
std::optional<double> number(const Node& node, std::string_view key, Rule rule, Faults& faults);
/// Reads a list of exactly as many numbers as `into` holds; else notes the fault and changes
/// nothing.
bool numbers(const Node& node, std::string_view key, std::span<double> into, Rule rule,
             Faults& faults);
/// Returns whether a value is a text that is not empty; else notes the fault.
bool is_text(const Node& node, std::string_view key, Faults& faults);

/// Reads the version of a format at `key`; notes a fault unless it is 1.
void check_version(Map& root, std::string_view key, Faults& faults);

/// Returns the candidate that was probably meant by `word`: the same but for the unit, or a few
/// letters off.
std::optional<std::string> nearest(std::string_view word,
                                   const std::vector<std::string>& candidates);
/// Returns "; did you mean 'x'?" for the nearest candidate, or nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace groundray::yaml
