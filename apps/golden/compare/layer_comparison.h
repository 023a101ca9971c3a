#pragma once

#include "apps/golden/compare/image_layer.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Tells how a layer differs from a reference of the same name, size and channels, as its kind is,
/// and draws both and the difference. What seems to be misread is said in the
/// text. If no pixel has a value in both, there are no errors: the section says so and, unless
/// neither has any value, fails.
void compare_layers(const ImageLayer& reference, const ImageLayer& other, Section& into);

}  // namespace groundray::golden
