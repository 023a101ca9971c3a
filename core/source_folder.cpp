#include "core/own_folder.h"

namespace groundray {

// The only source that is compiled with a path: all other objects are independent of the folder, so
// that builds in several folders share them.
std::filesystem::path source_folder() { return GROUNDRAY_SOURCE_FOLDER; }

}  // namespace groundray
