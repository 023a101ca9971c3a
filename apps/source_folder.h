#pragma once

#include <filesystem>

namespace groundray {

/// Returns the folder of the sources that this program was built from, where a program that is not
/// installed finds data/ and test/.
std::filesystem::path source_folder();

}  // namespace groundray
