#include "sensors/camera/picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
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
      bits_(imager.bits),
      gains_(spec.gains.value_or(grey_gains(imager))) {
  Violations broken("picture");
  broken.unless(spec.bits == 8 || spec.bits == 16, "bits = {} must be 8 or 16", spec.bits);
  for (glm::length_t i = 0; i < 3; ++i) {
    broken.unless(gains_[i] > 0 && std::isfinite(gains_[i]), "gain {} must be positive and finite",
                  gains_[i]);
  }
  const double white = white_dn(imager);
  broken.unless(
      white >= 1,
      "a full well of {} e is less than one digital number above black at {} DN/e: raise gain_dn_e",
      imager.full_well_e, imager.gain_dn_e);
  broken.throw_if_any();
  const double raised = math::exp2(16 - bits_), top = highest_code(spec.bits);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const double gain = gains_[static_cast<glm::length_t>(channel)] / white;
    codes_[channel].resize(raised_values);
    for (std::size_t i = 0; i < raised_values; ++i) {
      const double dn = static_cast<double>(i) / raised - imager.black_dn;
      const double linear = std::clamp(gain * dn, 0.0, 1.0);
      const bool is_srgb = spec.encoding == PictureSpec::Encoding::Srgb;
      const double value = is_srgb ? srgb_of_linear(linear) : linear;
      codes_[channel][i] = static_cast<std::uint16_t>(std::round(top * value));
    }
  }
}

template <typename T>
Image<T> RawDeveloper::encoded(const Image16& colors) const {
  Image<T> picture(colors.width(), colors.height(), colors.channels());
  const auto channels = static_cast<std::size_t>(colors.channels());
  for (std::size_t i = 0; i < colors.values().size(); ++i) {
    const auto& codes = codes_[channels == 1 ? 1 : i % channels];
    picture.values()[i] = static_cast<T>(codes[colors.values()[i]]);
  }
  return picture;
}

Picture RawDeveloper::develop(const Image16& raw) const {
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
  const auto top = static_cast<std::uint16_t>(highest_code(bits_));
  for (std::uint16_t& value : colors.values())
    value = static_cast<std::uint16_t>(std::min(value, top) << (16 - bits_));
  if (is_mosaic) colors = demosaiced(std::move(colors), filter_);
  if (spec_.bits == 8) return encoded<std::uint8_t>(colors);
  return encoded<std::uint16_t>(colors);
}

}  // namespace groundray
