#include "apps/python/camera_image.h"

#include <utility>
#include <variant>

#include "apps/scene/frames.h"

namespace groundray::python {
namespace {

using Product = CameraProduct;

/// Moves the products of an image to channels.
class Channels {
 public:
  explicit Channels(CameraImage& into) : into_(into), camera_(into.placed().spec.camera) {}

  void add_stages(ImagerStages& stages) {
    if (stages.picture)
      std::visit([&](auto& pixels) { add("picture", std::move(pixels)); }, *stages.picture);
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

}  // namespace

CameraImage make_image(const std::shared_ptr<SceneState>& state, std::size_t camera,
                       std::int64_t frame, const std::function<void()>& check) {
  CameraImage image{.frame = frame, .state = state, .camera = camera};
  const auto scene = state->frames.of(exposed(image.placed(), frame));
  check();
  MadeImage made = groundray::make_image(state->simulation, camera, frame, *scene, check);
  Channels channels(image);
  if (made.light) {
    image.labels = std::move(made.labels);
    if (auto stages = simulate_imager(state->simulation, camera, frame, made))
      channels.add_stages(*stages);
    channels.add_light(*made.light);
  }
  if (made.truth) channels.add_truth(*made.truth);
  return image;
}

}  // namespace groundray::python
