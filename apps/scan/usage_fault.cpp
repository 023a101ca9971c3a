#include "apps/scan/usage_fault.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>
#include <string>
#include <vector>

#include "apps/scan/command_text.h"
#include "apps/scan/completion.h"
#include "apps/scan/man_page.h"
#include "apps/scan/word_option.h"
#include "core/io/print_error.h"
#include "core/near_names.h"

namespace groundray {
namespace {

// Returns the innermost command that was given.
const CLI::App& given_command(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

std::vector<std::string> names_of_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> names_of_commands(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* each : command.get_subcommands({})) {
    if (!each->get_name().empty()) names.push_back(each->get_name());  // groups have none
  }
  return names;
}

// Returns the fault that comes first: CLI11 reports missing arguments before unknown ones.
std::string words_for(const CLI::App& app, const CLI::ParseError& fault) {
  const CLI::App& command = given_command(app);
  const std::vector<std::string> unknown = app.remaining(true);
  const auto is_option = [](const std::string& word) {
    return word.size() > 1 && word.starts_with('-');
  };
  const std::vector<std::string> commands = names_of_commands(command);
  const std::string list = fmt::format("the commands are {}", fmt::join(commands, ", "));
  if (unknown.empty() && !commands.empty() && fault.get_name() == "RequiredError")
    return "a command is missing; " + list;
  if (unknown.empty()) {
    static const std::regex without_value("(--?[^ ]+): 1 required .* missing");
    return std::regex_replace(fault.what(), without_value, "$1 needs a value");
  }
  if (!commands.empty() && !is_option(unknown.front()))
    return fmt::format("there is no command '{}'{}; {}", unknown.front(),
                       suggestion(unknown.front(), commands), list);
  const auto option = std::ranges::find_if(unknown, is_option);
  if (option == unknown.end()) return fmt::format("'{}' is one argument too many", unknown.front());
  const std::string name = option->substr(0, option->find('='));
  return fmt::format("there is no option {}{}", name, suggestion(name, names_of_options(command)));
}

// Adds the options that print texts about the program; CLI11 ends parsing as for the version.
void add_text_options(CLI::App& app, const std::function<std::vector<std::string>()>& names) {
  const Words<std::string> shells{{"bash", "bash"}, {"zsh", "zsh"}};
  const auto complete = [&app, names](const std::string& shell) {
    const CommandText text = command_text(app);
    const auto known = names ? names() : std::vector<std::string>();
    throw CLI::CallForVersion(
        shell == "bash" ? bash_completion(text, known) : zsh_completion(text, known), 0);
  };
  app.add_option_function<std::string>("--completion", complete,
                                       "Print a script that completes command lines in this shell")
      ->transform(one_of(shells))
      ->option_text(listed(shells));
  app.add_flag_callback(
      "--man",
      [&app] {
        throw CLI::CallForVersion(man_page(command_text(app), app.version(), app.get_footer()), 0);
      },
      "Print the manual page, for `man -l -`");
}

// Returns what the program is, its commands by their groups, and the notes at the end of its help.
std::string first_screen(const CLI::App& app) {
  const auto commands = app.get_subcommands({});
  std::size_t width = 0;
  std::vector<std::string> groups;
  for (const CLI::App* command : commands) {
    width = std::max(width, command->get_name().size());
    if (std::ranges::find(groups, command->get_group()) == groups.end())
      groups.push_back(command->get_group());
  }
  std::string text = app.get_description() + "\n";
  for (const std::string& group : groups) {
    text += fmt::format("\n{}:\n", group);
    for (const CLI::App* command : commands) {
      if (command->get_group() == group)
        text +=
            fmt::format("  {:<{}}  {}\n", command->get_name(), width, command->get_description());
    }
  }
  return fmt::format("{}\n{}\n\na command is missing: {} COMMAND --help describes its options\n",
                     text, app.get_footer(), app.get_name());
}

}  // namespace

std::optional<int> parse_arguments(CLI::App& app, int count, const char* const* arguments,
                                   const std::function<std::vector<std::string>()>& names) {
  constexpr int done = 0, wrong_usage = 2;
  if (count == 1 && app.get_require_subcommand_min() > 0) {
    print_error("{}", first_screen(app));
    return wrong_usage;
  }
  add_text_options(app, names);
  for (int i = 1; i < count; ++i) {
    if (arguments[i][0] != '\0') continue;
    print_error("argument {} is empty: is a variable of the shell not set?\n", i);
    return wrong_usage;
  }
  try {
    app.parse(count, arguments);
  } catch (const CLI::ParseError& fault) {
    if (fault.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      app.exit(fault);
      return done;
    }
    print_error("{}\nRun with --help for more information.\n", words_for(app, fault));
    return wrong_usage;
  }
  return std::nullopt;
}

}  // namespace groundray
