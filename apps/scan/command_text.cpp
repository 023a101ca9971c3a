#include "apps/scan/command_text.h"

#include <CLI/CLI.hpp>
#include <string_view>

namespace groundray {
namespace {

std::vector<std::string> split_words(std::string_view listed) {
  std::vector<std::string> words;
  while (!listed.empty()) {
    const std::size_t bar = listed.find('|');
    words.emplace_back(listed.substr(0, bar));
    listed.remove_prefix(bar == std::string_view::npos ? listed.size() : bar + 1);
  }
  return words;
}

// Returns the label of a value without the rules for numbers: "FLOAT" for "FLOAT:POSITIVE".
std::string label_of(const std::string& type) {
  const bool is_number =
      type.starts_with("FLOAT:") || type.starts_with("INT:") || type.starts_with("UINT:");
  return is_number ? type.substr(0, type.find(':')) : type;
}

OptionText option_text(const CLI::Option& option) {
  OptionText text{.names = {},
                  .label = {},
                  .words = {},
                  .meaning = option.get_description(),
                  .is_required = option.get_required(),
                  .is_repeated = option.get_items_expected_max() > 1};
  if (option.get_positional()) {
    text.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
  }
  if (option.get_items_expected_max() == 0) return text;
  const std::string type = option.get_type_name();
  text.words = split_words(option.get_option_text());
  text.label = text.words.empty() ? label_of(type) : option.get_option_text();
  text.value = !text.words.empty()    ? OptionText::Value::Words
               : type == "TEXT"       ? OptionText::Value::Files
               : type == file_or_name ? OptionText::Value::FilesAndNames
                                      : OptionText::Value::Other;
  return text;
}

// Adds the options of a command or of one of its groups, which are nameless commands.
void add_options(const CLI::App& command, CommandText& text) {
  for (const CLI::Option* option : command.get_options()) {
    const bool is_of_group = command.get_name().empty() && option == command.get_help_ptr();
    if (option->get_group().empty() || is_of_group) continue;
    (option->get_positional() ? text.arguments : text.options).push_back(option_text(*option));
  }
  for (const CLI::App* group : command.get_subcommands({}))
    if (group->get_name().empty()) add_options(*group, text);
}

CommandText text_below(const CLI::App& command, std::string path) {
  CommandText text{.path = std::move(path),
                   .meaning = command.get_description(),
                   .options = {},
                   .arguments = {},
                   .commands = {}};
  add_options(command, text);
  for (const CLI::App* each : command.get_subcommands({})) {
    if (each->get_name().empty()) continue;
    const std::string above = command.get_parent() == nullptr ? "" : text.path + " ";
    text.commands.push_back(text_below(*each, above + each->get_name()));
  }
  return text;
}

}  // namespace

CommandText command_text(const CLI::App& program) {
  return text_below(program, program.get_name());
}

std::vector<const CommandText*> all_commands(const CommandText& program) {
  std::vector<const CommandText*> all{&program};
  for (const CommandText& command : program.commands) {
    for (const CommandText* each : all_commands(command)) all.push_back(each);
  }
  return all;
}

}  // namespace groundray
