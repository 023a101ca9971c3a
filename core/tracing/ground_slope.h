#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Returns the slope of the ground at `p` (D, metres) without the steps between facets, radians.
/// Each sample of the finest level there has the gradient between its two neighbours along each
/// axis, or, where one is missing or beyond the level, between the sample and the other; between
/// samples, gradients are interpolated bilinearly. Nothing outside the levels, and where a corner
/// of the cell has no gradient.
std::optional<double> ground_slope_rad(const RayTracer& ground, glm::dvec2 p) noexcept;

}  // namespace groundray
