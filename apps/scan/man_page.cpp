#include "apps/scan/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace groundray {
namespace {

// Returns a text in which nothing is a request or an escape of roff.
std::string roff(std::string_view text) {
  std::string safe;
  bool is_line_start = true;
  for (const char c : text) {
    if (is_line_start && (c == '.' || c == '\'')) safe += "\\&";
    is_line_start = c == '\n';
    if (c == '\\')
      safe += "\\e";
    else if (c == '-')
      safe += "\\-";
    else
      safe += c;
  }
  return safe;
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string usage_of(const CommandText& command, const std::string& program) {
  const bool is_program = command.path == program;
  std::string text =
      fmt::format(".B {}\n", roff(is_program ? program : program + " " + command.path));
  for (const OptionText& option : command.options) {
    if (option.is_required)
      text += fmt::format("\\fB{}\\fR \\fI{}\\fR\n", roff(option.names.back()), roff(option.label));
  }
  text += "[\\fIoptions\\fR]\n";
  if (!command.commands.empty()) text += "\\fIcommand\\fR\n";
  for (const OptionText& argument : command.arguments)
    text += fmt::format("{}\\fI{}\\fR{}{}\n", argument.is_required ? "" : "[",
                        roff(argument.names.front()), argument.is_repeated ? " ..." : "",
                        argument.is_required ? "" : "]");
  return text;
}

std::string entry_of(const OptionText& option) {
  std::string names;
  for (const std::string& name : option.names)
    names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", roff(name));
  if (!option.label.empty()) names += fmt::format(" \\fI{}\\fR", roff(option.label));
  return fmt::format(".TP\n{}\n{}{}\n", names, roff(option.meaning),
                     option.is_required ? " (required)" : "");
}

std::string entries_of(const CommandText& command) {
  std::string text;
  for (const OptionText& argument : command.arguments) text += entry_of(argument);
  for (const OptionText& option : command.options) text += entry_of(option);
  return text;
}

std::string commands_of(const CommandText& program) {
  std::string text;
  for (const CommandText* command : all_commands(program)) {
    if (command == &program) continue;
    text += fmt::format(".SS {}\n{}\n.PP\n{}{}", roff(command->path), roff(command->meaning),
                        usage_of(*command, program.path), entries_of(*command));
  }
  return text;
}

std::string others_than(const std::string& program) {
  static constexpr std::array<std::string_view, 5> programs{
      "groundray", "groundray-export", "groundray-golden", "groundray-index", "groundray-view"};
  std::string text;
  for (const std::string_view each : programs) {
    if (each == program) continue;
    text += fmt::format("{}.BR {} (1)", text.empty() ? "" : " ,\n", roff(each));
  }
  return text + "\n";
}

// Returns the beginning of a program's description, without its name: "simulator of ...".
std::string summary_of(const CommandText& program) {
  std::string text = program.meaning.substr(0, program.meaning.find_first_of(".:"));
  for (const std::string& begin : {program.path + " ", std::string("is a ")})
    if (text.starts_with(begin)) text.erase(0, begin.size());
  return text;
}

}  // namespace

std::string man_page(const CommandText& program, const std::string& version,
                     const std::string& notes) {
  std::string text = fmt::format(".TH {} 1 \"\" \"{}\" \"User commands\"\n",
                                 roff(upper(program.path)), roff(version));
  text += fmt::format(".SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}", roff(program.path),
                      roff(summary_of(program)), usage_of(program, program.path));
  text += fmt::format(".SH DESCRIPTION\n{}\n.SH OPTIONS\n{}", roff(program.meaning),
                      entries_of(program));
  if (!program.commands.empty()) text += ".SH COMMANDS\n" + commands_of(program);
  if (!notes.empty()) text += fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(notes));
  return text + ".SH SEE ALSO\n" + others_than(program.path);
}

}  // namespace groundray
