#pragma once

#include <filesystem>

namespace groundray {

/// Returns the source folder from which the program was built, where a program that is not
/// installed finds data/ and test/.
std::filesystem::path source_folder();

}  // namespace groundray
