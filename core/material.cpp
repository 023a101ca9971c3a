#include "core/material.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

void check(const Lambertian& surface, Violations& broken) {
  const std::vector<SpectrumSample>& spectrum = surface.spectrum;
  broken.unless(!spectrum.empty(), "spectrum: there must be at least one sample");
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    const auto [wavelength_nm, reflectance] = spectrum[i];
    broken.unless(wavelength_nm > 0 && std::isfinite(wavelength_nm),
                  "spectrum[{}].wavelength_nm = {} must be positive and finite", i, wavelength_nm);
    broken.unless(i == 0 || spectrum[i - 1].wavelength_nm < wavelength_nm,
                  "spectrum[{}].wavelength_nm = {} must be greater than the one before: sort them",
                  i, wavelength_nm);
    broken.unless(reflectance >= 0 && reflectance <= 1,
                  "spectrum[{}].reflectance = {} must be in [0, 1]: is it in percent?", i,
                  reflectance);
  }
}

void check(const RetroReflector& surface, Violations& broken) {
  const double coefficient = surface.coefficient_cd_lx_m2;
  broken.unless(coefficient > 0 && std::isfinite(coefficient),
                "coefficient_cd_lx_m2 = {} must be positive and finite", coefficient);
}

double reflectance_at(const Material& material, const Lambertian& surface, double wavelength_nm) {
  const std::vector<SpectrumSample>& spectrum = surface.spectrum;
  const double first_nm = spectrum.front().wavelength_nm;
  const double last_nm = spectrum.back().wavelength_nm;
  if (!(first_nm <= wavelength_nm && wavelength_nm <= last_nm)) {
    throw Error("Material '{}': the spectrum reaches from {} to {} nm, but not to {} nm",
                material.name, first_nm, last_nm, wavelength_nm);
  }
  const auto above =
      std::ranges::lower_bound(spectrum, wavelength_nm, {}, &SpectrumSample::wavelength_nm);
  if (above->wavelength_nm == wavelength_nm) return above->reflectance;
  const auto below = above - 1;
  const double share =
      (wavelength_nm - below->wavelength_nm) / (above->wavelength_nm - below->wavelength_nm);
  return std::lerp(below->reflectance, above->reflectance, share);
}

}  // namespace

void check_material(const Material& material) {
  Violations broken("Material '" + material.name + "'");
  std::visit([&](const auto& surface) { check(surface, broken); }, material.reflection);
  broken.throw_if_any();
}

RetroBrdf retro_brdf(const Material& material, double wavelength_nm) {
  check_material(material);
  if (const auto* surface = std::get_if<Lambertian>(&material.reflection)) {
    return {.diffuse_per_sr = reflectance_at(material, *surface, wavelength_nm) / std::numbers::pi};
  }
  return {.retro_per_sr = std::get<RetroReflector>(material.reflection).coefficient_cd_lx_m2};
}

}  // namespace groundray
