#pragma once

#include <filesystem>
#include <span>

#include "apps/groundray/dem/dem_report.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/dem/dem_truth.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Checks, before work that may take long, that results can be written. @throws Error if not.
void check_output(const DemOutput& output, std::span<const std::filesystem::path> inputs);

/// Sets the slope of each sample that has a height and, along rows and columns, a neighbour.
void set_slopes(DemLayers& layers);

/// Writes all that is asked for; either all files appear, each whole, or none. Sets the picture's
/// scale in the report.
/// @param truth  or null.
/// @throws Error as the functions for their forms.
void write_output(const DemOutput& output, const DemLayers& layers, const TruthComparison* truth,
                  DemReport& report);

}  // namespace groundray
