#include "apps/scan/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

// Scripts know a program's commands and options as they were printed; they run no program.
namespace groundray {
namespace {

using Value = OptionText::Value;

std::string function_of(const std::string& path) {
  std::string name = "_" + path;
  std::ranges::replace_if(
      name, [](char c) { return c == ' ' || c == '-'; }, '_');
  return name;
}

// Path of a command in the scripts: that of the program itself is empty.
std::string key_of(const CommandText& command, const CommandText& program) {
  return &command == &program ? "" : command.path;
}

std::vector<std::string> command_names(const std::vector<CommandText>& commands) {
  std::vector<std::string> names;
  for (const CommandText& command : commands)
    names.push_back(command.path.substr(command.path.rfind(' ') + 1));
  return names;
}

// Returns the assignment that completes a value in bash.
std::string bash_value(const OptionText& option, const std::vector<std::string>& names) {
  const auto words = [](const std::vector<std::string>& list) {
    return fmt::format("words='{}'", fmt::join(list, " "));
  };
  switch (option.value) {
    case Value::Words:
      return words(option.words);
    case Value::Files:
      return "files=1";
    case Value::FilesAndNames:
      return words(names) + " files=1";
    case Value::None:
    case Value::Other:
      break;
  }
  return "words=''";
}

// Returns the patterns of bash for the values of options, grouped by what completes them.
std::string bash_options(const CommandText& command, const std::string& key,
                         const std::vector<std::string>& names) {
  std::string text;
  for (const OptionText& option : command.options) {
    if (option.value == Value::None) continue;
    std::vector<std::string> patterns;
    for (const std::string& name : option.names)
      patterns.push_back(fmt::format("'{} {}'", key, name));
    text += fmt::format("    {}) {} ;;\n", fmt::join(patterns, "|"), bash_value(option, names));
  }
  return text;
}

// Returns the pattern of bash for words that are no values of options.
std::string bash_words(const CommandText& command, const std::string& key,
                       const std::vector<std::string>& names) {
  std::vector<std::string> options;
  for (const OptionText& option : command.options)
    for (const std::string& name : option.names) options.push_back(name);
  std::string value =
      command.arguments.empty() ? "words=''" : bash_value(command.arguments.front(), names);
  if (!command.commands.empty())
    value = fmt::format("words='{}'", fmt::join(command_names(command.commands), " "));
  return fmt::format("    '{}') options='{}'; {} ;;\n", key, fmt::join(options, " "), value);
}

// Texts within brackets and after colons, in which both have a meaning.
std::string zsh_text(std::string_view text) {
  std::string quoted;
  for (const char c : text) {
    if (c == '\'') {
      quoted += "'\\''";
      continue;
    }
    if (c == '[' || c == ']' || c == ':' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted;
}

std::string zsh_action(const OptionText& option, const std::vector<std::string>& names) {
  switch (option.value) {
    case Value::Words:
      return fmt::format("({})", fmt::join(option.words, " "));
    case Value::Files:
      return "_files";
    case Value::FilesAndNames:
      return fmt::format("{{_alternative \"files\\:file\\:_files\" \"names\\:name\\:({})\"}}",
                         fmt::join(names, " "));
    case Value::None:
    case Value::Other:
      break;
  }
  return " ";
}

std::string zsh_option(const OptionText& option, const std::vector<std::string>& names) {
  const std::string repeat = option.is_repeated ? "*" : "";
  const std::string others =
      option.is_repeated ? "" : fmt::format("({})", fmt::join(option.names, " "));
  const std::string value =
      option.value == Value::None
          ? ""
          : fmt::format(":{}:{}", zsh_text(option.label), zsh_action(option, names));
  std::string lines;
  for (const std::string& name : option.names)
    lines += fmt::format(" \\\n    '{}{}{}[{}]{}'", repeat, others, name, zsh_text(option.meaning),
                         value);
  return lines;
}

std::string zsh_commands(const CommandText& command) {
  std::string list;
  const std::vector<std::string> names = command_names(command.commands);
  for (std::size_t i = 0; i < names.size(); ++i)
    list += fmt::format("    '{}:{}'\n", names[i], zsh_text(command.commands[i].meaning));
  return list;
}

std::string zsh_function(const CommandText& command, const std::string& name,
                         const std::string& program, const std::vector<std::string>& names) {
  std::string text = fmt::format("{}() {{\n", name);
  const bool has_commands = !command.commands.empty();
  if (has_commands) {
    text += fmt::format("  local context state line\n  local -a commands=(\n{}  )\n",
                        zsh_commands(command));
  }
  text += fmt::format("  _arguments {}", has_commands ? "-C" : "-s -S");
  for (const OptionText& option : command.options) text += zsh_option(option, names);
  if (has_commands) {
    text += " \\\n    '1:command:{_describe command commands}' \\\n    '*::argument:->arguments'\n";
    text += "  [[ $state == arguments ]] || return\n  case $line[1] in\n";
    const std::vector<std::string> below = command_names(command.commands);
    for (std::size_t i = 0; i < below.size(); ++i)
      text += fmt::format("    {}) {} ;;\n", below[i],
                          function_of(program + " " + command.commands[i].path));
    return text + "  esac\n}\n";
  }
  for (const OptionText& argument : command.arguments)
    text += fmt::format(" \\\n    '{}:{}:{}'", argument.is_repeated ? "*" : "",
                        zsh_text(argument.names.front()), zsh_action(argument, names));
  return text + "\n}\n";
}

}  // namespace

std::string bash_completion(const CommandText& program, const std::vector<std::string>& names) {
  std::vector<std::string> known;
  std::string values, words;
  for (const CommandText* command : all_commands(program)) {
    const std::string key = key_of(*command, program);
    if (!key.empty()) known.push_back(fmt::format("'{}'", key));
    values += bash_options(*command, key, names);
    words += bash_words(*command, key, names);
  }
  const std::string walk =
      known.empty() ? ""
                    : fmt::format(
                          "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
                          "    word=\"${{command:+$command }}${{COMP_WORDS[i]}}\"\n"
                          "    case $word in\n      {}) command=$word ;;\n    esac\n  done\n",
                          fmt::join(known, "|"));
  return fmt::format(
      R"sh(# bash completion of {0}, printed by `{0} --completion bash`
{1}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}
  local command='' options='' words='' files='' word i
  if [[ $current == '=' ]]; then
    current=''
  elif [[ $previous == '=' ]]; then
    previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
{2}  COMPREPLY=()
  case "$command $previous" in
{3}    *)
      case $command in
{4}      esac
      ;;
  esac
  if [[ $current == -* && -n $options ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  if [[ -n $files ]]; then
    compopt -o filenames 2>/dev/null
    mapfile -t -O "${{#COMPREPLY[@]}}" COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -F {1} {0}
)sh",
      program.path, function_of(program.path), walk, values, words);
}

std::string zsh_completion(const CommandText& program, const std::vector<std::string>& names) {
  std::string text = fmt::format(
      "#compdef {0}\n# zsh completion of {0}, printed by `{0} --completion zsh`\n", program.path);
  for (const CommandText* command : all_commands(program)) {
    const bool is_program = command == &program;
    const std::string path = is_program ? program.path : program.path + " " + command->path;
    text += zsh_function(*command, function_of(path), program.path, names);
  }
  return text + fmt::format("{} \"$@\"\n", function_of(program.path));
}

}  // namespace groundray
