#pragma once

#include <optional>

#include "core/model/model.h"
#include "terrain/assets/asset_random.h"

namespace groundray {

// Generators of the kinds. Parameters are those of AssetSpec and must be valid.

Model make_rock(double size_m, double detail, AssetRandom random);
Model make_stone(double size_m, double detail, AssetRandom random);
Model make_sphere_target(double diameter_m, double detail);

Model make_grass_tuft(double height_m, double detail, AssetRandom random);
Model make_shrub(double height_m, double leaf_area_index, double detail, AssetRandom random);
Model make_conifer(double height_m, double leaf_area_index, double detail, AssetRandom random);
Model make_broadleaf_tree(double height_m, double leaf_area_index, double detail,
                          AssetRandom random);

Model make_fence_post(double height_m, double diameter_m, double detail);
Model make_person_cylinder(double height_m, double diameter_m, double detail);
Model make_wire(double span_m, double sag_m, double diameter_m, double detail);
Model make_calibration_board(double width_m, double height_m, std::optional<double> square_m);

Model make_vehicle(double length_m);

/// Returns the number of squares along a length, from 1 to 1000, or nothing if squares of this side
/// do not fill it.
std::optional<int> squares_along(double length_m, double square_m);

}  // namespace groundray
