#include "apps/python/camera_image.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "sensors/camera/image_truth.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/irradiance.h"
#include "sensors/camera/path_tracer.h"
#include "sensors/camera/picture.h"

namespace groundray::python {
namespace {

using Product = CameraProduct;

bool gives_any(const CameraSpec& camera, std::initializer_list<Product> products) {
  return std::ranges::any_of(products, [&](Product product) { return gives(camera, product); });
}

/// Makes one image, product by product.
class Making {
 public:
  Making(const SceneState& state, const Scene& scene, const std::function<void()>& check,
         CameraImage& into)
      : world_(state.world),
        scene_(scene),
        check_(check),
        into_(into),
        placed_(into.placed()),
        camera_(placed_.spec.camera),
        key_{.seed = world_.spec.seed,
             .sensor = static_cast<std::uint32_t>(world_.lidars.size() + into.camera),
             .frame = static_cast<std::uint32_t>(into.frame)} {}

  void make() {
    if (needs_light(camera_)) take_light();
    if (gives_any(camera_, {Product::Truth, Product::Bound, Product::Flow, Product::FlowFlo,
                            Product::FlowKitti}))
      take_truth();
  }

 private:
  template <typename Pixels>
  void add(const char* name, Pixels pixels) {
    if (pixels.width() > 0) into_.channels.push_back({name, std::move(pixels)});
  }

  void take_light() {
    if (gives(camera_, Product::Coverage)) into_.labels = labels_of(scene_);
    const PathTracer tracer(scene_, *world_.sky, camera_.sampling.depth, world_.air);
    Exposure light =
        placed_.camera.expose(tracer, placed_.X_DC, begin(0), key_, into_.labels, check_);
    check_();
    if (camera_.imager) take_stages(light.radiance);
    if (gives(camera_, Product::Radiance)) {
      add("radiance_w_m2_sr", std::move(light.radiance));
      add("standard_error_w_m2_sr", std::move(light.standard_error));
      add("samples", std::move(light.samples));
    }
    add("coverage", std::move(light.coverage));
  }

  // What the sensor makes of light.
  void take_stages(const ImageF& radiance) {
    if (!gives_any(camera_, {Product::Irradiance, Product::Photons, Product::Electrons,
                             Product::Raw, Product::Picture}))
      return;
    const Imager imager(*camera_.imager, camera_.shutter.exposure_s);
    ImageF light = irradiance(radiance, placed_.pupil_sr);
    ImageF photons = imager.photons(light);
    ImageF electrons = imager.electrons(photons, key_);
    Image16 raw = imager.digital(electrons, key_);
    if (gives(camera_, Product::Picture)) {
      Picture picture = RawDeveloper(camera_.picture, *camera_.imager).develop(raw);
      std::visit([&](auto& pixels) { add("picture", std::move(pixels)); }, picture);
    }
    if (gives(camera_, Product::Irradiance)) add("irradiance_w_m2", std::move(light));
    if (gives(camera_, Product::Photons)) add("photons", std::move(photons));
    if (gives(camera_, Product::Electrons)) add("electrons", std::move(electrons));
    if (gives(camera_, Product::Raw)) add("raw_dn", std::move(raw));
  }

  void take_truth() {
    TruthRequest request{.begin = begin(0), .bounds = gives(camera_, Product::Bound)};
    const bool both_ways = gives(camera_, Product::Flow);
    if (both_ways && into_.frame > 0) request.before = begin(-1);
    if ((both_ways || gives_any(camera_, {Product::FlowFlo, Product::FlowKitti})) &&
        into_.frame + 1 < static_cast<std::int64_t>(placed_.begins.size()))
      request.after = begin(1);
    ImageTruth truth = image_truth(placed_.camera, scene_, world_.content.materials.in_colour(),
                                   placed_.X_DC, request);
    if (gives(camera_, Product::Truth)) add_truth(truth);
    add("bound_m", std::move(truth.bound_m));
    add_flow("flow_forward_px", "flow_forward_is_seen", truth.forward);
    add_flow("flow_backward_px", "flow_backward_is_seen", truth.backward);
  }

  void add_truth(ImageTruth& truth) {
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

  void add_flow(const char* name, const char* seen_name, Flow& flow) {
    add(name, std::move(flow.offset_px));
    add(seen_name, std::move(flow.is_seen));
  }

  // Of the image so many after this one.
  std::chrono::nanoseconds begin(std::int64_t after) const {
    return placed_.begins[static_cast<std::size_t>(into_.frame + after)];
  }

  const World& world_;
  const Scene& scene_;
  const std::function<void()>& check_;
  CameraImage& into_;
  const PlacedCamera& placed_;
  const CameraSpec& camera_;
  RandomKey key_;
};

}  // namespace

CameraImage make_image(const std::shared_ptr<SceneState>& state, std::size_t camera,
                       std::int64_t frame, const std::function<void()>& check) {
  CameraImage image{.frame = frame, .state = state, .camera = camera};
  const auto scene = state->frames.of(exposed(image.placed(), frame));
  check();
  Making(*state, *scene, check, image).make();
  return image;
}

}  // namespace groundray::python
