#pragma once

#include "apps/golden/compare/images/image_layer.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Reports the differences between a layer and a reference of the same name, size and channels,
/// according to its kind, and adds pictures. Suspected misreadings are stated in the text. If no
/// pixel has a value in both, there are no errors: the section states so and, unless neither layer
/// has any value, fails.
void compare_layers(const ImageLayer& reference, const ImageLayer& other, Section& into);

}  // namespace groundray::golden
