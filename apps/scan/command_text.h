#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace groundray {

/// Option or argument of a command.
struct OptionText {
  /// Kind of words that complete its value.
  enum class Value {
    None,   ///< a flag, which has no value
    Words,  ///< one of `words`
    Files,
    FilesAndNames,  ///< a file, or a name that the program knows
    Other           ///< a number, or a text that is no file
  };
  std::vector<std::string> names;  ///< "-o", "--output"; of an argument its only name: "SCENE"
  Value value = Value::None;
  std::string label;               ///< of the value: "FLOAT", "bash|zsh"; empty for a flag
  std::vector<std::string> words;  ///< accepted words
  std::string meaning;
  bool is_required = false, is_repeated = false;
};

/// Command of a program, with the options of all its groups.
struct CommandText {
  std::string path;  ///< name with those of the commands above it: "terrain mesh"; or the program's
  std::string meaning;
  std::vector<OptionText> options, arguments;
  std::vector<CommandText> commands;
};

/// Type name of an argument that is a file or a name that the program knows.
inline constexpr const char* file_or_name = "FILE or NAME";

/// Returns a program's commands and options: the one table of its completions and its manual page.
/// Hidden options are omitted.
CommandText command_text(const CLI::App& program);

/// Returns a command and all below it, each before those below it.
std::vector<const CommandText*> all_commands(const CommandText& program);

}  // namespace groundray
