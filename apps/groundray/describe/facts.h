#pragma once

#include <string>
#include <utility>
#include <vector>

namespace groundray {

/// Description of a file or preset: a name of at most nine letters, and a text, for each line. An
/// empty name continues the line before.
using Facts = std::vector<std::pair<std::string, std::string>>;

/// Prints facts on standard output, one per line.
void print_facts(const Facts& facts);

}  // namespace groundray
