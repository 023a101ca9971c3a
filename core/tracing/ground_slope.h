#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Returns the slope of the ground at `p` (D, metres) without the steps between facets, radians.
/// Each sample of the finest level there has the gradient of central differences, at the window's
/// boundary and beside missing samples of one-sided ones; between samples, gradients are
/// interpolated bilinearly. Nothing outside the levels and in cells with a missing sample.
std::optional<double> ground_slope_rad(const RayTracer& ground, glm::dvec2 p) noexcept;

}  // namespace groundray
