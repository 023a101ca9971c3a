#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "reconstruction/dem/fill/fill_error_model.h"
#include "reconstruction/dem/fill/holdout_mask.h"
#include "reconstruction/dem/thin_plate/thin_plate_energy.h"
#include "reconstruction/dem/thin_plate/thin_plate_system.h"

// Hold-out tests of fills on known ground; private to this library.
namespace groundray {

/// Hold-out test of one kind of holes: best form and error model.
struct FillTrial {
  std::optional<ThinPlateEnergy> form;  ///< nothing if too little ground was known
  std::optional<FillErrorModel> model;  ///< likewise; widened
  std::size_t samples = 0;              ///< number hidden, filled and compared
  FillCover cover;  ///< of errors by models from the other half of the trials; NaN if either half
                    ///< is too small for a model
  double widened_by = 1;  ///< factor on sd that followed from it
};

/// Tests how well holes of one kind are filled: hides pieces of their shape on known ground
/// elsewhere, or, for shadows, the samples that similar lines of sight would leave in shadow there,
/// fills them by several forms, chooses the best one and fits the error model to its errors.
/// @param holes  similar holes, all shadows or none; not empty.
/// @param form  the only form to test, if given.
/// @param usual_roughness_m  roughness of the whole raster.
/// @see docs/theory/dem_fill.md
FillTrial try_filling(const ThinPlateRaster& raster, std::span<const TriedHole> holes,
                      const std::optional<ThinPlateEnergy>& form, double usual_roughness_m);

}  // namespace groundray
