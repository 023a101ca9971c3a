#include "sensors/camera/picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/image/srgb.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr std::size_t raised_values = std::size_t{1} << 16;

// Returns the gains with which grey surfaces in light of equal red, green and blue appear grey. The
// smallest is 1, so that pixels with all channels saturated are white.
glm::dvec3 grey_gains(const ImagerSpec& imager) {
  const glm::dvec3& share = imager.quantum_efficiency;
  if (imager.filter == ColorFilter::Mono) return glm::dvec3(1);
  return std::max({share.r, share.g, share.b}) / share;
}

double highest_code(int bits) { return math::exp2(bits) - 1; }

// Returns the digital numbers from black to saturation, of the pixel or of its number.
double white_dn(const ImagerSpec& imager) {
  const double full_dn = std::round(imager.black_dn + imager.gain_dn_e * imager.full_well_e);
  return std::min(full_dn, highest_code(imager.bits)) - imager.black_dn;
}

int conversion_of(ColorFilter filter) {
  switch (filter) {
    case ColorFilter::Rggb:
      return cv::COLOR_BayerRGGB2RGB;
    case ColorFilter::Bggr:
      return cv::COLOR_BayerBGGR2RGB;
    case ColorFilter::Grbg:
      return cv::COLOR_BayerGRBG2RGB;
    default:
      return cv::COLOR_BayerGBRG2RGB;
  }
}

template <typename T>
Image<T> encoded(const Image16& colors, const std::array<std::vector<std::uint16_t>, 3>& codes) {
  Image<T> picture(colors.width(), colors.height(), colors.channels());
  const auto channels = static_cast<std::size_t>(colors.channels());
  for (std::size_t i = 0; i < colors.values().size(); ++i) {
    const auto& code = codes[channels == 1 ? 1 : i % channels];
    picture.values()[i] = static_cast<T>(code[colors.values()[i]]);
  }
  return picture;
}

Image16 demosaiced(Image16 mosaic, ColorFilter filter) {
  Image16 colors(mosaic.width(), mosaic.height(), 3);
  const cv::Mat from(mosaic.height(), mosaic.width(), CV_16UC1, mosaic.values().data());
  cv::Mat to(mosaic.height(), mosaic.width(), CV_16UC3, colors.values().data());
  cv::cvtColor(from, to, conversion_of(filter));
  return colors;
}

}  // namespace

RawDeveloper::RawDeveloper(const PictureSpec& spec, const ImagerSpec& imager)
    : spec_(spec),
      filter_(imager.filter),
      raised_(math::exp2(16 - imager.bits)),
      black_dn_(imager.black_dn),
      white_dn_(white_dn(imager)),
      gains_(spec.gains.value_or(grey_gains(imager))) {
  Violations broken("picture");
  broken.unless(spec.bits == 8 || spec.bits == 16, "bits = {} must be 8 or 16", spec.bits);
  for (glm::length_t i = 0; i < 3; ++i) {
    broken.unless(gains_[i] > 0 && std::isfinite(gains_[i]), "gain {} must be positive and finite",
                  gains_[i]);
  }
  broken.unless(
      white_dn_ >= 1,
      "a full well of {} e is less than one digital number above black at {} DN/e: raise gain_dn_e",
      imager.full_well_e, imager.gain_dn_e);
  broken.unless(!spec.balances_white || !spec.gains,
                "gains are set, but an automatic white balance chooses them: remove either");
  broken.unless(!spec.balances_white || imager.filter != ColorFilter::Mono,
                "a mono imager has no colours for an automatic white balance: remove it");
  const double key = spec.tone_key.value_or(0.18);
  broken.unless(key > 0 && key < 1, "the tone curve's key = {} must be between 0 and 1", key);
  broken.throw_if_any();
  fixed_ = codes(gains_, 1);
}

double RawDeveloper::linear(std::size_t raised) const noexcept {
  return (static_cast<double>(raised) / raised_ - black_dn_) / white_dn_;
}

RawDeveloper::Codes RawDeveloper::codes(const glm::dvec3& gains, double lift) const {
  Codes all;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    all[channel].resize(raised_values);
    for (std::size_t i = 0; i < raised_values; ++i) {
      const double x = std::clamp(gains[static_cast<glm::length_t>(channel)] * linear(i), 0.0, 1.0);
      const double toned = x * (lift + x) / (1 + lift * x);
      const bool is_srgb = spec_.encoding == PictureSpec::Encoding::Srgb;
      const double value = is_srgb ? srgb_of_linear(toned) : toned;
      all[channel][i] = static_cast<std::uint16_t>(std::round(highest_code(spec_.bits) * value));
    }
  }
  return all;
}

// Returns gains that make the light of the image grey, estimated as the sixth-power mean of each
// channel over all pixels without one that is nearly saturated. The smallest is 1.
// @see Finlayson, Trezzi, Shades of gray and colour constancy (2004).
glm::dvec3 RawDeveloper::balanced_gains(const Image16& colors) const {
  constexpr double saturated = 0.99, most = 2;
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < colors.values().size(); i += 3) {
    glm::dvec3 x;
    for (glm::length_t c = 0; c < 3; ++c)
      x[c] = std::max(linear(colors.values()[i + static_cast<std::size_t>(c)]), 0.0);
    if (std::max({x.r, x.g, x.b}) >= saturated) continue;
    const glm::dvec3 cubed = x * x * x;
    sum += cubed * cubed;
  }
  if (!(sum.g > 0)) return gains_;
  glm::dvec3 gains(1);
  for (const glm::length_t c : {0, 2}) {
    const double wanted = math::pow(sum.g / sum[c], 1.0 / 6);
    const double fixed = gains_[c] / gains_.g;
    gains[c] = std::clamp(wanted, fixed / most, fixed * most);
  }
  return gains / std::min({gains.r, gains.g, gains.b});
}

// Returns the slope of the tone curve at black that lifts the log-mean luminance to the key, in its
// linear part.
double RawDeveloper::lift(const Image16& colors, const glm::dvec3& gains) const {
  constexpr double darkest = 1e-3;  // keeps the logarithm finite
  const auto channels = static_cast<std::size_t>(colors.channels());
  double sum = 0;
  for (std::size_t i = 0; i < colors.values().size(); i += channels) {
    glm::dvec3 x;
    for (glm::length_t c = 0; c < 3; ++c) {
      const std::size_t at = channels == 1 ? i : i + static_cast<std::size_t>(c);
      x[c] =
          std::clamp((channels == 1 ? gains.g : gains[c]) * linear(colors.values()[at]), 0.0, 1.0);
    }
    sum += math::log(std::max(luminance(x), darkest));
  }
  const double mean =
      math::exp(sum * static_cast<double>(channels) / static_cast<double>(colors.values().size()));
  return std::max(*spec_.tone_key / mean, 1.0);
}

DevelopedPicture RawDeveloper::develop(const Image16& raw) const {
  const bool is_mosaic = filter_ != ColorFilter::Mono;
  if (raw.channels() != 1) {
    throw Error("picture: a raw image must have 1 channel, but has {}", raw.channels());
  }
  if (is_mosaic && (raw.width() < 3 || raw.height() < 3)) {
    throw Error("picture: a mosaic of {} x {} px lacks some colours; it must have at least 3 x 3",
                raw.width(), raw.height());
  }
  // Scaled to 16 bits, interpolated colours are rounded to less than a digital number. Black is
  // subtracted after interpolation, so that noise below black is averaged rather than clipped.
  Image16 colors = raw;
  const auto raised = static_cast<unsigned>(raised_);
  const auto top = static_cast<std::uint16_t>(raised_values / raised - 1);
  for (std::uint16_t& value : colors.values())
    value = static_cast<std::uint16_t>(std::min(value, top) * raised);
  if (is_mosaic) colors = demosaiced(std::move(colors), filter_);
  DevelopedPicture developed{.picture = {}, .gains = gains_, .lift = 1};
  if (spec_.balances_white) developed.gains = balanced_gains(colors);
  if (spec_.tone_key) developed.lift = lift(colors, developed.gains);
  const bool is_fixed = developed.gains == gains_ && developed.lift == 1;
  const Codes own = is_fixed ? Codes{} : codes(developed.gains, developed.lift);
  const Codes& all = is_fixed ? fixed_ : own;
  if (spec_.bits == 8) {
    developed.picture = encoded<std::uint8_t>(colors, all);
  } else {
    developed.picture = encoded<std::uint16_t>(colors, all);
  }
  return developed;
}

}  // namespace groundray
