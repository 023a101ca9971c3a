#pragma once

#include "test/device/kernel_device.h"

namespace groundray::testing {

/// Returns the kernels that are part of this program.
KernelCode embedded_kernels();

}  // namespace groundray::testing
