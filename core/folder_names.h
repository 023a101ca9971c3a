#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

namespace groundray {

/// Returns the names in a folder, sorted; as many as could be read if `fault` is set. (Iterators of
/// libstdc++ end the program if there is not enough memory.)
std::vector<std::string> names_in(const std::filesystem::path& folder, std::error_code& fault);

}  // namespace groundray
