#include "apps/scan/usage_fault.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>
#include <string>
#include <vector>

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
  if (unknown.empty() && !commands.empty()) return "a command is missing; " + list;
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

}  // namespace

std::optional<int> parse_arguments(CLI::App& app, int count, const char* const* arguments) {
  constexpr int done = 0, wrong_usage = 2;
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
