#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "apps/groundray/describe/file_facts.h"
#include "apps/scan/python_module.h"
#include "apps/scene/interruption.h"
#include "core/error.h"

namespace groundray {

Facts bag_facts(const std::filesystem::path& file) {
  const std::string printed =
      run_python_module("groundray.foreign.bag", {std::filesystem::absolute(file).string()}, file,
                        {.check = stop_if_interrupted});
  constexpr std::size_t name_width = 10;  // as print_facts writes lines, and the module, too
  Facts facts;
  for (std::string_view rest = printed; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    if (line.size() < name_width)
      throw Error("{}: groundray.foreign.bag printed '{}': is it of another version?",
                  file.string(), line);
    std::string_view name = line.substr(0, name_width);
    name = name.substr(0, name.find(' '));
    facts.emplace_back(name, line.substr(name_width));
  }
  return facts;
}

}  // namespace groundray
