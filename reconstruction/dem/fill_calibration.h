#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "reconstruction/dem/fill_law.h"
#include "reconstruction/dem/hidden_piece.h"
#include "reconstruction/dem/plate_form.h"
#include "reconstruction/dem/plate_system.h"

// How well holes are filled, found out where the ground is known; private to this library.
namespace groundray {

/// Of holes alike: what fills them best, and how well.
struct FillTrial {
  std::optional<PlateForm> form;  ///< nothing if there was too little ground to try it
  std::optional<FillLaw> law;     ///< likewise; widened
  std::size_t samples = 0;        ///< that were hidden, filled and compared
  FillCover cover;                ///< of errors by laws from the other half of the trials; NaN if
                                  ///< either half is too small for a law
  double widened_by = 1;          ///< what sd was multiplied by for it
};

/// Tries how well holes like some are filled: hides pieces of their shape elsewhere, where the
/// ground is known, or for shadows what lines of sight alike would not see there, fills them by
/// each of several forms and compares. The best form is the one whose squared errors are least, by
/// the mean logarithm over pieces, unless those of the usual form are as small but for chance: a
/// thin plate, and one with the smoothness 5 for shadows. Laws of sd follow from the errors by
/// maximum likelihood; where errors of one half of the trials are larger than the law of the other
/// says, sd is widened.
/// @param holes  that are alike, all shadows or none; not empty.
/// @param form   to be tried alone, if given.
/// @param usual_roughness_m  of the whole raster.
FillTrial try_filling(const PlateRaster& raster, std::span<const TriedHole> holes,
                      const std::optional<PlateForm>& form, double usual_roughness_m);

}  // namespace groundray
