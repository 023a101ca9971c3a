#pragma once

#include <optional>

#include "core/geometry/mesh.h"

namespace groundray::testing {

/// Returns the published mesh of the Stanford bunny; nothing without the shared data.
std::optional<TriangleMesh> stanford_bunny();

/// Reason to skip a test that needs the bunny.
inline constexpr const char* no_bunny =
    "there is no mesh/stanford_bunny_scans/bun_zipper.ply.gz; set GROUNDRAY_SHARED_DATA";

}  // namespace groundray::testing
