#include "sensors/camera/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/math.h"
#include "core/quantile.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/picture.h"

namespace groundray {
namespace {

void check(const AutoExposureSpec& spec, double longest_s) {
  Violations broken("automatic exposure");
  broken.unless(spec.percentile > 0 && spec.percentile <= 100,
                "percentile = {} must be > 0 and at most 100", spec.percentile);
  broken.unless(spec.target > 0 && spec.target <= 1, "target = {} must be > 0 and at most 1",
                spec.target);
  broken.unless(spec.shortest_s > 0 && spec.shortest_s <= longest_s,
                "shortest_s = {} must be > 0 and at most the exposure time of {} s",
                spec.shortest_s, longest_s);
  broken.unless(spec.most_gain >= 1 && std::isfinite(spec.most_gain),
                "most_gain = {} must be 1 or more, and finite", spec.most_gain);
  broken.throw_if_any();
}

// Returns the level of the metered pixels: electrons per second of a pixel whose picture has the
// requested brightness.
double level_e_s(const CameraSpec& camera, std::span<const MeteredPixel> metered,
                 const ImageF& pupil_sr) {
  const ImagerSpec& imager = *camera.imager;
  const bool is_mono = imager.filter == ColorFilter::Mono;
  // Gains equalise the channels of a grey surface, so a picture's white is that of its most
  // efficient channel.
  const glm::dvec3 factors =
      RawDeveloper(camera.picture, imager).gains() * imager.quantum_efficiency;
  const double per_w_m2 = photons_per_w_m2(imager, 1);
  std::vector<double> levels;
  levels.reserve(metered.size());
  for (const MeteredPixel& at : metered) {
    const glm::dvec3 rgb = per_w_m2 * glm::max(glm::dvec3(at.radiance), glm::dvec3(0)) *
                           double{pupil_sr.at(at.pixel.x, at.pixel.y)[0]};
    const glm::dvec3 channels = is_mono ? glm::dvec3(luminance(rgb) * factors.g) : rgb * factors;
    levels.push_back(camera.shutter.automatic->metering == AutoExposureSpec::Metering::Mean
                         ? luminance(channels)
                         : std::max({channels.r, channels.g, channels.b}));
  }
  if (levels.empty()) return 0;
  if (camera.shutter.automatic->metering == AutoExposureSpec::Metering::Percentile)
    return quantile(std::move(levels), camera.shutter.automatic->percentile / 100);
  return std::accumulate(levels.begin(), levels.end(), 0.0) / static_cast<double>(levels.size());
}

}  // namespace

ExposureSetting choose_exposure(const CameraSpec& camera, std::span<const MeteredPixel> metered,
                                const ImageF& pupil_sr) {
  const double longest_s = camera.shutter.exposure_s;
  const AutoExposureSpec& automatic = *camera.shutter.automatic;
  const ImagerSpec& imager = *camera.imager;
  check(automatic, longest_s);
  const double level = level_e_s(camera, metered, pupil_sr);
  if (!(level > 0)) return {longest_s, automatic.most_gain};
  // White is where the pixel is full, or its digital number is the largest.
  const double top_e = (math::exp2(imager.bits) - 1 - imager.black_dn) / imager.gain_dn_e;
  const double white_e = std::min(imager.full_well_e, top_e);
  const double exposure_s =
      std::clamp(automatic.target * white_e / level, automatic.shortest_s, longest_s);
  // Once gain makes the largest digital number white, more gain makes the picture brighter.
  const double gain =
      std::clamp(automatic.target * top_e / (level * exposure_s), 1.0, automatic.most_gain);
  const bool is_reached = level * exposure_s >= automatic.target * white_e * (1 - 1e-9);
  return {exposure_s, is_reached ? 1 : gain};
}

}  // namespace groundray
