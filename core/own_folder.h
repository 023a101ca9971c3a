#pragma once

#include <filesystem>

namespace groundray {

/// Returns groundray's own folder, which has data/ and test/golden/: beside the installed program
/// or Python module, or else the source tree.
std::filesystem::path own_folder();

/// Returns the source tree from which this was built.
std::filesystem::path source_folder();

}  // namespace groundray
