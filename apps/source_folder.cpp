#include "apps/source_folder.h"

namespace groundray {

// The one source that is compiled with a path: objects of all others are the same wherever the
// folder is, so that builds in several folders share them.
std::filesystem::path source_folder() { return GROUNDRAY_SOURCE_FOLDER; }

}  // namespace groundray
