#pragma once

#include <string>

#include "apps/scene/world.h"

namespace groundray {

/// Returns what dataset.yaml says of a run itself (docs/formats.md): equal texts make equal frames.
/// @throws Error if an image of the sky cannot be read.
std::string run_header(const World& world);

}  // namespace groundray
