#include <fmt/ranges.h>

#include <span>

#include "apps/scene/readers/spec_io.h"

namespace groundray {
namespace {

std::string pair_text(const char* key, const glm::dvec2& pair) {
  return fmt::format("{}: [{}, {}]", key, pair.x, pair.y);
}

std::string scale_text(const PixelScale& scale) {
  return fmt::format("{}, {}, skew: {}", pair_text("focal_px", scale.focal_px),
                     pair_text("centre_px", scale.centre_px), scale.skew);
}

std::string coefficients_text(std::span<const double> k) {
  return fmt::format("coefficients: [{}]", fmt::join(k, ", "));
}

struct LensText {
  std::string operator()(const Pinhole& lens) const {
    return fmt::format("pinhole: {{{}}}", scale_text(lens.scale));
  }
  std::string operator()(const BrownConrady& lens) const {
    return fmt::format("brown_conrady: {{{}, {}}}", scale_text(lens.scale),
                       coefficients_text(lens.k));
  }
  std::string operator()(const KannalaBrandt& lens) const {
    return fmt::format("kannala_brandt: {{{}, {}}}", scale_text(lens.scale),
                       coefficients_text(lens.k));
  }
  std::string operator()(const FTheta& lens) const {
    const bool from_angle = lens.direction == FTheta::Polynomial::AngleToPixels;
    return fmt::format("f_theta: {{{}, polynomial: {}, {}, linear: [{}, {}, {}]}}",
                       pair_text("centre_px", lens.centre_px),
                       from_angle ? "angle_to_pixels" : "pixels_to_angle",
                       coefficients_text(lens.k), lens.linear.x, lens.linear.y, lens.linear.z);
  }
  std::string operator()(const Eucm& lens) const {
    return fmt::format("eucm: {{{}, alpha: {}, beta: {}}}", scale_text(lens.scale), lens.alpha,
                       lens.beta);
  }
  std::string operator()(const DoubleSphere& lens) const {
    return fmt::format("double_sphere: {{{}, xi: {}, alpha: {}}}", scale_text(lens.scale), lens.xi,
                       lens.alpha);
  }
  std::string operator()(const Mei& lens) const {
    return fmt::format("mei: {{{}, xi: {}, {}}}", scale_text(lens.scale), lens.xi,
                       coefficients_text(lens.k));
  }
  std::string operator()(const Equirectangular&) const { return "equirectangular: {}"; }
};

}  // namespace

std::string lens_text(const LensModel& lens) { return std::visit(LensText{}, lens); }

}  // namespace groundray
