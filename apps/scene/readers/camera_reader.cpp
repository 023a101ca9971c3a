#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/near_names.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/camera/picture.h"

namespace groundray::yaml {
namespace {

constexpr Rule efficiency_rule{[](double value) { return value > 0 && value <= 4; },
                               "must be > 0 and at most 4"};
constexpr Rule time_rule{[](double value) { return value >= 0 && value <= 1e9; },
                         "must be from 0 to 1e9"};
constexpr Rule exposure_rule{[](double value) { return value >= 1e-6 && value <= 3.6e6; },
                             "must be > 0: from 1e-6, a nanosecond, to 3.6e6, an hour"};
constexpr Rule percentile_rule{[](double value) { return value > 0 && value <= 100; },
                               "must be > 0 and at most 100"};
constexpr double grey_target = 0.18;  // mean level that makes a scene of average reflectance grey
constexpr Rule key_rule{[](double value) { return value > 0 && value < 1; },
                        "must be between 0 and 1"};
constexpr Rule row_rule{[](double value) { return value >= 0 && value <= 1e6; },
                        "must be from 0 to 1e6"};

// In the order of CameraProduct.
constexpr std::array<std::string_view, 13> products{
    "radiance", "truth",      "bound",   "flow",      "flow_flo", "flow_kitti", "boxes",
    "coverage", "irradiance", "photons", "electrons", "raw",      "picture"};
static_assert(products.size() == static_cast<std::size_t>(CameraProduct::Picture) + 1);

constexpr bool is_of_imager(CameraProduct product) { return product >= CameraProduct::Irradiance; }

void read_int(Map& map, std::string_view key, Need need, int& into, int low, int high,
              Faults& faults) {
  auto value = static_cast<std::uint32_t>(into);
  const Node* const at = map.read_whole(key, need, value);
  if (!at) return;
  if (value < static_cast<std::uint32_t>(low) || value > static_cast<std::uint32_t>(high)) {
    faults.add(*at, key, "is {}, but must be from {} to {}", value, low, high);
  } else {
    into = static_cast<int>(value);
  }
}

void read_automatic(const Node& node, std::optional<AutoExposureSpec>& into, Faults& faults) {
  if (node.text == "off") return into.reset();
  AutoExposureSpec automatic = into.value_or(AutoExposureSpec{});
  const auto metering_before = automatic.metering;
  Map map(node, "automatic", faults);
  map.read_choice("metering", Need::Optional, automatic.metering, {"percentile", "mean"});
  map.read_number("percentile", Need::Optional, automatic.percentile, percentile_rule);
  if (automatic.metering != metering_before) {
    automatic.target = automatic.metering == AutoExposureSpec::Metering::Mean
                           ? grey_target
                           : AutoExposureSpec{}.target;
  }
  map.read_number("target", Need::Optional, automatic.target, positive_share_rule);
  map.read_scaled("shortest_us", Need::Optional, 1e-6, automatic.shortest_s, positive);
  map.read_number("most_gain", Need::Optional, automatic.most_gain, at_least_one);
  map.close();
  into = automatic;
}

// An exposure time by itself is a fixed one, also where the camera's file has automatic exposure.
void read_shutter(Map map, ShutterSpec& shutter, Faults& faults) {
  const Node* const fixed =
      map.read_scaled("exposure_ms", Need::Optional, 1e-3, shutter.exposure_s, exposure_rule);
  map.read_scaled("row_us", Need::Optional, 1e-6, shutter.row_s, row_rule);
  if (const Node* const automatic = map.find("automatic", Need::Optional)) {
    read_automatic(*automatic, shutter.automatic, faults);
  } else if (fixed != nullptr) {
    shutter.automatic.reset();
  }
  map.close();
}

void read_aperture(Map map, std::optional<ApertureSpec>& into) {
  const Need need = into ? Need::Optional : Need::Required;
  ApertureSpec aperture = into.value_or(ApertureSpec{});
  map.read_number("f_number", need, aperture.f_number, positive);
  map.read_scaled("focal_length_mm", Need::Optional, 1e-3, aperture.focal_length_m, positive);
  map.read_number("focus_m", Need::Optional, aperture.focus_m, positive);
  map.read_number("transmission", Need::Optional, aperture.transmission, positive_share_rule);
  map.read_vector("vignetting", Need::Optional, aperture.vignetting);
  map.read_choice("pupil", Need::Optional, aperture.pupil, {"flat", "turning"});
  map.close();
  into = aperture;
}

void read_samples(Map& map, std::string_view key, int& into, Faults& faults) {
  int samples = into;
  read_int(map, key, Need::Optional, samples, 1, 1 << 20, faults);
  const Node* const at = map.find(key, Need::Optional);
  if (!std::has_single_bit(static_cast<unsigned>(samples))) {
    faults.add(*at, key, "is {}, but must be a power of 2: {} or {}", samples,
               std::bit_floor(static_cast<unsigned>(samples)),
               std::bit_ceil(static_cast<unsigned>(samples)));
  } else {
    into = samples;
  }
}

void read_sampling(Map map, SamplingSpec& sampling, Faults& faults) {
  read_samples(map, "samples", sampling.samples, faults);
  const bool grows = map.find("most_samples", Need::Optional) != nullptr;
  if (grows) {
    read_samples(map, "most_samples", sampling.most_samples, faults);
  } else {
    sampling.most_samples = std::max(sampling.samples, sampling.most_samples);
    if (map.find("samples", Need::Optional)) sampling.most_samples = sampling.samples;
  }
  if (sampling.most_samples < sampling.samples) {
    faults.add(map.node(), "most_samples", "is {}, but must be at least the {} of samples",
               sampling.most_samples, sampling.samples);
  }
  map.read_number("relative_error", Need::Optional, sampling.relative_error, not_negative);
  read_int(map, "depth", Need::Optional, sampling.depth, 1, 64, faults);
  map.close();
}

// Photons are those of 555 nm: a sensor with a wider band than the eye's may have more than one
// electron for each (docs/theory/camera_imager.md).
void read_efficiency(Map& map, Need need, glm::dvec3& into, Faults& faults) {
  constexpr std::string_view key = "quantum_efficiency";
  const Node* const node = map.find(key, need);
  if (!node) return;
  if (node->kind == Node::Kind::List) {
    map.read_vector(key, need, into, efficiency_rule);
  } else if (const auto value = number(*node, key, efficiency_rule, faults)) {
    into = glm::dvec3(*value);
  }
}

void read_imager(Map map, std::optional<ImagerSpec>& into, Faults& faults) {
  const Need need = into ? Need::Optional : Need::Required;
  ImagerSpec imager = into.value_or(ImagerSpec{});
  map.read_scaled("pixel_pitch_um", need, 1e-6, imager.pixel_pitch_m, positive);
  map.read_choice("filter", need, imager.filter, {"mono", "rggb", "bggr", "grbg", "gbrg"});
  read_efficiency(map, need, imager.quantum_efficiency, faults);
  map.read_number("full_well_e", need, imager.full_well_e, positive);
  map.read_number("read_noise_e", Need::Optional, imager.read_noise_e, not_negative);
  map.read_number("dark_current_e_s", Need::Optional, imager.dark_current_e_s, not_negative);
  map.read_number("reference_c", Need::Optional, imager.reference_c);
  map.read_number("temperature_c", Need::Optional, imager.temperature_c);
  map.read_number("doubling_k", Need::Optional, imager.doubling_k, positive);
  map.read_scaled("prnu_percent", Need::Optional, 1e-2, imager.prnu);
  map.read_number("dsnu_e", Need::Optional, imager.dsnu_e, not_negative);
  map.read_number("gain_dn_e", need, imager.gain_dn_e, positive);
  map.read_number("black_dn", Need::Optional, imager.black_dn, not_negative);
  read_int(map, "bits", need, imager.bits, 8, 16, faults);
  map.read_choice<bool>("noise", Need::Optional, imager.noise, {{"on", true}, {"off", false}});
  map.close();
  into = imager;
}

void read_tone_curve(const Node& node, std::optional<double>& key, Faults& faults) {
  if (node.text == "off") return key.reset();
  double value = key.value_or(grey_target);
  Map map(node, "tone_curve", faults);
  map.read_number("key", Need::Optional, value, key_rule);
  map.close();
  key = value;
}

void read_picture(Map map, PictureSpec& picture, Faults& faults) {
  map.read_choice("encoding", Need::Optional, picture.encoding, {"srgb", "linear"});
  std::uint8_t bits = 0;
  if (const Node* at = map.read_whole("bits", Need::Optional, bits)) {
    if (bits == 8 || bits == 16) {
      picture.bits = bits;
    } else {
      faults.add(*at, "bits", "is {}, but must be 8 or 16", bits);
    }
  }
  // Fixed gains and automatic white balance exclude each other: a scene's choice replaces the
  // file's.
  glm::dvec3 gains(1);
  const bool has_gains = map.read_vector("gains", Need::Optional, gains, positive) != nullptr;
  if (has_gains) picture.balances_white = false;
  const Node* const balance =
      map.read_choice<bool>("white_balance", Need::Optional, picture.balances_white,
                            {{"fixed", false}, {"automatic", true}});
  if (picture.balances_white) picture.gains.reset();
  if (has_gains && picture.balances_white) {
    faults.add(*balance, "white_balance", "is automatic, but 'gains' are set too: remove either");
  } else if (has_gains) {
    picture.gains = gains;
  }
  if (const Node* const curve = map.find("tone_curve", Need::Optional))
    read_tone_curve(*curve, picture.tone_key, faults);
  map.close();
}

void read_products(Map& map, std::vector<CameraProduct>& into, Faults& faults) {
  constexpr std::string_view key = "products";
  const Node* const node = map.find(key, Need::Optional);
  if (!node) return;
  std::vector<CameraProduct> chosen;
  for (const Node& item : map.list(key, Need::Optional)) {
    if (!is_text(item, key, faults)) continue;
    const auto product =
        static_cast<CameraProduct>(std::ranges::find(products, item.text) - products.begin());
    if (static_cast<std::size_t>(product) == products.size()) {
      faults.add(item, key, "has '{}', but may have {}{}", item.text, fmt::join(products, ", "),
                 suggestion(item.text, {products.begin(), products.end()}));
    } else if (std::ranges::count(chosen, product) > 0) {
      faults.add(item, key, "has '{}' twice", item.text);
    } else {
      chosen.push_back(product);
    }
  }
  if (node->kind == Node::Kind::List && node->items.empty())
    faults.add(*node, key, "is an empty list, but a camera needs at least one product");
  into = std::move(chosen);
}

// Reads the size of the image; by default, that of the calibration.
glm::ivec2 read_size(Map& root, glm::ivec2 calibrated_px, Faults& faults) {
  constexpr std::string_view key = "size_px";
  const bool known = calibrated_px.x > 0 && calibrated_px.y > 0;
  glm::dvec2 size(0);
  const Node* const at =
      root.read_vector(key, known ? Need::Optional : Need::Required, size, positive);
  if (!at) return calibrated_px;
  const double width = size.x, height = size.y;
  if (width != std::floor(width) || height != std::floor(height)) {
    faults.add(*at, key, "is [{}, {}], but must be whole numbers of pixels", width, height);
  } else if (width * height > static_cast<double>(most_image_pixels)) {
    faults.add(*at, key,
               "is [{}, {}], but an image has at most {} pixels: the rays of this one alone would "
               "take {:.3g} GiB",
               width, height, most_image_pixels, width * height * sizeof(PixelRay) / 0x1p30);
  } else if (known && size != glm::dvec2(calibrated_px)) {
    faults.add(*at, key, "is [{}, {}], but the calibration is of images of {} x {}", width, height,
               calibrated_px.x, calibrated_px.y);
  } else {
    return {static_cast<int>(width), static_cast<int>(height)};
  }
  return {};
}

// Reads the keys that camera files and scenes have in common.
void read_settings(Map& map, CameraSpec& camera, Faults& faults) {
  map.read_number("rate_hz", Need::Optional, camera.rate_hz, positive);
  map.read_scaled("first_ms", Need::Optional, 1e-3, camera.first_s, time_rule);
  if (auto shutter = map.map("shutter", Need::Optional))
    read_shutter(std::move(*shutter), camera.shutter, faults);
  if (auto aperture = map.map("aperture", Need::Optional))
    read_aperture(std::move(*aperture), camera.aperture);
  if (auto sampling = map.map("sampling", Need::Optional))
    read_sampling(std::move(*sampling), camera.sampling, faults);
  if (auto imager = map.map("imager", Need::Optional))
    read_imager(std::move(*imager), camera.imager, faults);
  if (auto picture = map.map("picture", Need::Optional))
    read_picture(std::move(*picture), camera.picture, faults);
  read_products(map, camera.products, faults);
}

}  // namespace

CameraSpec read_camera(const Node& node, const fs::path& path, Faults& faults) {
  CameraSpec camera;
  Map root(node, "", faults);
  if (const Node* at = root.find("groundray_lidar", Need::Optional)) {
    faults.add(*at, "groundray_lidar", "this is a lidar, not a camera: name it under 'lidars'");
    return camera;
  }
  check_version(root, "groundray_camera", faults);
  root.read_text("model", Need::Required, camera.model);
  CameraFileLens lens;
  if (const Node* at = root.find("lens", Need::Required)) lens = read_lens(*at, path, faults);
  camera.lens = lens.model;
  camera.size_px = read_size(root, lens.size_px, faults);
  read_settings(root, camera, faults);
  check_sources(root, faults);
  root.close();
  return camera;
}

void change_camera(Map& entry, CameraSpec& camera, Faults& faults) {
  read_settings(entry, camera, faults);
}

void check_rate(const Node& node, const CameraSpec& camera, Faults& faults) {
  const double period_s = 1 / camera.rate_hz;
  if (camera.shutter.exposure_s > period_s * (1 + 1e-9)) {
    faults.add(node, "shutter", "exposes for {:.6g} ms, but an image begins every {:.6g} ms",
               camera.shutter.exposure_s * 1e3, period_s * 1e3);
  }
  const double readout_s = camera.shutter.row_s * camera.size_px.y;
  if (readout_s > period_s * (1 + 1e-9)) {
    faults.add(node, "shutter",
               "reads {} rows of {:.6g} us in {:.6g} ms, but an image begins every {:.6g} ms",
               camera.size_px.y, camera.shutter.row_s * 1e6, readout_s * 1e3, period_s * 1e3);
  }
}

void complete_camera(const Node& node, CameraSpec& camera, Faults& faults) {
  const std::size_t before = faults.count();
  for (std::size_t i = 0; i < products.size(); ++i) {
    const auto product = static_cast<CameraProduct>(i);
    if (gives(camera, product) && is_of_imager(product) && !camera.imager)
      faults.add(node, "products", "has '{}', which needs an 'imager'", products[i]);
  }
  if (camera.shutter.automatic && !camera.imager) {
    faults.add(node, "shutter",
               "has 'automatic' exposure, which needs an 'imager' to tell which light is white");
  }
  if (camera.shutter.automatic &&
      camera.shutter.automatic->shortest_s > camera.shutter.exposure_s) {
    faults.add(node, "shutter", "has a shortest_us of {:.6g}, but exposes for at most {:.6g} ms",
               camera.shutter.automatic->shortest_s * 1e6, camera.shutter.exposure_s * 1e3);
  }
  if (camera.imager && !camera.aperture)
    faults.add(node, "imager", "needs an 'aperture', which determines how much light arrives");
  if (camera.imager && camera.picture.balances_white && camera.imager->filter == ColorFilter::Mono)
    faults.add(node, "picture", "has an automatic white_balance, but a mono imager has no colours");
  if (faults.count() > before) return;
  try {
    if (camera.aperture && camera.aperture->focal_length_m == 0) {
      if (!camera.imager) {
        throw Error(
            "the aperture needs focal_length_mm, or an imager, whose pixel pitch determines it");
      }
      const Lens lens(camera.lens, camera.size_px);
      camera.aperture->focal_length_m = lens.focal_px().value_or(0) * camera.imager->pixel_pitch_m;
    }
    const Camera works(camera);
    if (camera.imager) Imager(*camera.imager, camera.shutter.exposure_s);
    if (camera.imager && gives(camera, CameraProduct::Picture))
      RawDeveloper(camera.picture, *camera.imager);
  } catch (const Error& fault) {
    faults.add(node, "", "the camera is invalid: {}", fault.what());
  }
}

}  // namespace groundray::yaml
