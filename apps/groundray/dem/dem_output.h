#pragma once

#include <filesystem>
#include <span>

#include "apps/groundray/dem/dem_report.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/dem/dem_truth.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Checks, before long computations, that the results can be written.
/// @throws Error if not.
void check_output(const DemOutput& output, std::span<const std::filesystem::path> inputs);

/// Sets the slope of each sample that has a height and at least one neighbour both along its row
/// and along its column.
void set_slopes(DemLayers& layers);

/// Writes all requested results: either all files appear, each complete, or none. Sets the
/// picture's scale in the report.
/// @param truth  comparison with the truth, or null.
/// @throws Error as the writers of the formats.
void write_output(const DemOutput& output, const DemLayers& layers, const TruthComparison* truth,
                  DemReport& report);

}  // namespace groundray
