#include "apps/python/camera_image.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "apps/python/binding/pickle.h"
#include "apps/scene/frames.h"

namespace groundray::python {
namespace {

using Product = CameraProduct;

/// Moves the products of an image to channels.
class Channels {
 public:
  Channels(const CameraSpec& camera, CameraImage& into) : into_(into), camera_(camera) {}

  void add_stages(ImagerStages& stages) {
    if (stages.picture)
      std::visit([&](auto& pixels) { add("picture", std::move(pixels)); }, stages.picture->picture);
    add_requested(Product::Irradiance, "irradiance_w_m2", stages.irradiance_w_m2);
    add_requested(Product::Photons, "photons", stages.photons);
    add_requested(Product::Electrons, "electrons", stages.electrons);
    add_requested(Product::Raw, "raw_dn", stages.raw_dn);
  }

  void add_light(Exposure& light) {
    add_requested(Product::Radiance, "radiance_w_m2_sr", light.radiance);
    add_requested(Product::Radiance, "standard_error_w_m2_sr", light.standard_error);
    add_requested(Product::Radiance, "samples", light.samples);
    add("coverage", std::move(light.coverage));
  }

  void add_truth(ImageTruth& truth) {
    if (gives(camera_, Product::Truth)) {
      add("is_valid", std::move(truth.is_valid));
      add("range_m", std::move(truth.range_m));
      add("depth_m", std::move(truth.depth_m));
      add("position_m", std::move(truth.p_DQ));
      add("normal", std::move(truth.normal));
      add("shading_normal", std::move(truth.shading_normal));
      add("albedo", std::move(truth.albedo));
      add("incidence_rad", std::move(truth.incidence_rad));
      add("velocity_m_s", std::move(truth.velocity_m_s));
      add("label", std::move(truth.label));
      add("instance", std::move(truth.instance));
      add("material", std::move(truth.material));
    }
    add("bound_m", std::move(truth.bound_m));
    add_flow("flow_forward_px", "flow_forward_is_seen", truth.forward);
    add_flow("flow_backward_px", "flow_backward_is_seen", truth.backward);
  }

 private:
  template <typename Pixels>
  void add(const char* name, Pixels pixels) {
    if (pixels.width() > 0) into_.channels.push_back({name, std::move(pixels)});
  }

  template <typename Pixels>
  void add_requested(Product product, const char* name, Pixels& pixels) {
    if (gives(camera_, product)) add(name, std::move(pixels));
  }

  void add_flow(const char* name, const char* seen_name, Flow& flow) {
    add(name, std::move(flow.offset_px));
    add(seen_name, std::move(flow.is_seen));
  }

  CameraImage& into_;
  const CameraSpec& camera_;
};

// ----- pickling

using Pixels = decltype(CameraImage::Channel::pixels);

// Reads pixels of type T; returns false if the array has another type or form.
template <typename T>
bool read_pixels(nb::handle array, Pixels& into) {
  nb::ndarray<const T, nb::ndim<3>, nb::c_contig, nb::device::cpu> given;
  if (!nb::try_cast(array, given, false)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (given.shape(axis) > std::numeric_limits<int>::max()) return false;
  }
  Image<T> pixels(static_cast<int>(given.shape(1)), static_cast<int>(given.shape(0)),
                  static_cast<int>(given.shape(2)));
  std::copy_n(given.data(), given.size(), pixels.values().begin());
  into = std::move(pixels);
  return true;
}

template <typename... T>
bool read_any_pixels(nb::handle array, std::variant<Image<T>...>& into) {
  return (read_pixels<T>(array, into) || ...);
}

}  // namespace

CameraImage make_image(SceneState& state, std::size_t camera, std::int64_t frame,
                       const std::function<void()>& check) {
  const PlacedCamera& placed = state.simulation.cameras[camera];
  const Exposed time = exposed(placed, frame);
  CameraImage image{.frame = frame, .sensor = placed.spec.name, .begin = time.begin};
  const auto scene = state.frames.of(time);
  check();
  MadeImage made = groundray::make_image(state.simulation, camera, frame, *scene, check);
  Channels channels(placed.spec.camera, image);
  if (made.light) {
    image.labels = std::move(made.labels);
    image.exposure = made.exposure;
    if (auto stages = simulate_imager(state.simulation, camera, frame, made)) {
      image.saturated_share = stages->saturated_share;
      channels.add_stages(*stages);
    }
    channels.add_light(*made.light);
  }
  if (made.truth) channels.add_truth(*made.truth);
  return image;
}

nb::list state_of(nb::handle_t<CameraImage> self) {
  const auto& image = nb::cast<const CameraImage&>(self);
  nb::list channels;
  for (const CameraImage::Channel& channel : image.channels) {
    const AnyArray array = std::visit(
        [&](const auto& pixels) {
          const Shape shape{static_cast<std::size_t>(pixels.height()),
                            static_cast<std::size_t>(pixels.width()),
                            static_cast<std::size_t>(pixels.channels())};
          return view(pixels.values().data(), shape, self);
        },
        channel.pixels);
    channels.append(nb::make_tuple(channel.name, array));
  }
  nb::list state;
  state.append(channels);
  state.append(image.labels);
  state.append(image.frame);
  state.append(image.sensor);
  state.append(image.begin.count());
  state.append(image.exposure.exposure_s);
  state.append(image.exposure.gain);
  state.append(image.saturated_share);
  return state;
}

CameraImage restored_image(const nb::tuple& values) {
  constexpr std::size_t count = 8;
  PickledState state("Image", values, count);
  CameraImage image;
  for (const nb::handle each : state.next<nb::list>("channels")) {
    std::pair<std::string, nb::object> channel;
    if (!nb::try_cast(each, channel, false)) state.refuse("channels", "has no name and array");
    const auto& [name, array] = channel;
    image.channels.push_back({name, {}});
    if (!read_any_pixels(array, image.channels.back().pixels))
      state.refuse(name, "must be an array of height x width x channels");
  }
  image.labels = state.next<std::vector<std::uint16_t>>("labels");
  image.frame = state.next<std::int64_t>("frame");
  image.sensor = state.next<std::string>("sensor");
  image.begin = std::chrono::nanoseconds(state.next<std::int64_t>("begin_ns"));
  image.exposure.exposure_s = state.next<double>("exposure_s");
  image.exposure.gain = state.next<double>("gain");
  image.saturated_share = state.next<std::optional<double>>("saturated_share");
  return image;
}

}  // namespace groundray::python
