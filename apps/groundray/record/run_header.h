#pragma once

#include <string>

#include "apps/scene/simulation.h"

namespace groundray {

/// Returns the part of dataset.yaml that describes the run (docs/reference/formats.md). Runs with
/// equal texts make equal frames.
/// @throws Error if an image of the sky cannot be read.
std::string run_header(const Simulation& simulation);

}  // namespace groundray
