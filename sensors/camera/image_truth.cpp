#include "sensors/camera/image_truth.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "core/elementary.h"
#include "core/error.h"
#include "core/pack.h"
#include "sensors/camera/observation.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Pixels of a row that are traced together: their rays stay in the cache; a multiple of packets.
constexpr int pixels_at_once = 256;

// Largest difference of ranges at which a ray towards a point hits that point rather than another.
// Both ranges are accurate to 1e-9, relative.
double same_range_m(double range_m) { return 1e-6 * range_m + 1e-6; }

template <typename T, typename V>
void put(Image<T>& image, int x, int y, const V& value) {
  const auto pixel = image.at(x, y);
  for (glm::length_t k = 0; k < V::length(); ++k)
    pixel[static_cast<std::size_t>(k)] = static_cast<T>(value[k]);
}

template <typename T>
void shape(Image<T>& image, glm::ivec2 size, int channels) {
  if (image.width() != size.x || image.height() != size.y || image.channels() != channels)
    image = Image<T>(size.x, size.y, channels);
}

void shape(Flow& flow, glm::ivec2 size, const std::optional<nanoseconds>& to) {
  if (!to) {
    flow = {};
    return;
  }
  shape(flow.offset_px, size, 2);
  shape(flow.is_seen, size, 1);
}

void shape(ImageTruth& truth, glm::ivec2 size, const TruthRequest& request) {
  shape(truth.is_valid, size, 1);
  for (ImageF* image : {&truth.range_m, &truth.depth_m, &truth.incidence_rad})
    shape(*image, size, 1);
  shape(truth.p_DQ, size, 3);
  for (ImageF* image : {&truth.normal, &truth.shading_normal, &truth.albedo, &truth.velocity_m_s})
    shape(*image, size, 3);
  for (auto* image : {&truth.label, &truth.instance, &truth.material}) shape(*image, size, 1);
  if (request.bounds)
    shape(truth.bound_m, size, 1);
  else
    truth.bound_m = {};
  shape(truth.forward, size, request.after);
  shape(truth.backward, size, request.before);
}

// Computes the truth of rows. Each thread has its own, to reuse the buffers.
class RowTruth {
 public:
  RowTruth(const Camera& camera, const Scene& scene, const Materials::InColour& materials,
           const Trajectory& X_DC)
      : camera_(camera), scene_(scene), materials_(materials), X_DC_(X_DC) {}

  void fill(int row, const TruthRequest& request, ImageTruth& into);

 private:
  void look(int first, int end, const Ray& from, const glm::dmat3& R_DC);
  void bound(int row, ImageF& into);
  void write_sky(int x, int y, ImageTruth& into) const;
  void write_incidence(int y, ImageF& into) const;
  void write_pixels(int y, ImageTruth& into) const;
  void write_surface(int x, int y, const Ray& ray, const Hit& hit, ImageTruth& into) const;
  glm::vec3 albedo_of(const Appearance& seen) const;
  void follow(int y, nanoseconds begin, Flow& flow);

  const Camera& camera_;
  const Scene& scene_;
  const Materials::InColour& materials_;
  const Trajectory& X_DC_;
  std::span<const glm::dvec3> directions_;  // viewing directions of the row, in C
  int first_ = 0, end_ = 0;                 // columns being processed
  // Pixels of these columns that have a viewing direction:
  std::vector<int> columns_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<double> bounds_m_;
  // Pixels whose points are imaged inside the other image:
  std::vector<int> seen_columns_;
  std::vector<Ray> seen_rays_;
  std::vector<Hit> seen_hits_;
  std::vector<double> seen_ranges_m_;
};

void RowTruth::look(int first, int end, const Ray& from, const glm::dmat3& R_DC) {
  first_ = first;
  end_ = end;
  rays_.clear();
  columns_.clear();
  for (int x = first; x < end; ++x) {
    const glm::dvec3& direction = directions_[static_cast<std::size_t>(x)];
    if (direction == glm::dvec3(0)) continue;
    rays_.push_back({from.origin, R_DC * direction, from.far_m, from.time});
    columns_.push_back(x);
  }
  hits_.resize(rays_.size());
  scene_.trace(rays_, hits_);
}

void RowTruth::fill(int row, const TruthRequest& request, ImageTruth& into) {
  const int width = camera_.spec().size_px.x;
  const auto pixels = static_cast<std::size_t>(width);
  directions_ = camera_.directions().subspan(static_cast<std::size_t>(row) * pixels, pixels);
  const nanoseconds time = request.begin + camera_.middle_of(row);
  const Pose X_DC = X_DC_.pose_at(time);
  const Ray from{.origin = X_DC.translation_m, .time = time};
  const glm::dmat3 R_DC = glm::mat3_cast(X_DC.rotation);
  for (int first = 0; first < width; first += pixels_at_once) {
    look(first, std::min(first + pixels_at_once, width), from, R_DC);
    write_pixels(row, into);
    if (request.bounds) bound(row, into.bound_m);
    if (request.after) follow(row, *request.after, into.forward);
    if (request.before) follow(row, *request.before, into.backward);
  }
}

// Writes the angle between each ray and the normal of the facet that it hit; NaN without a hit.
void RowTruth::write_incidence(int y, ImageF& into) const {
  for (std::size_t i = 0; i < rays_.size(); i += pack_size) {
    const auto at = [&](std::size_t lane) { return std::min(i + lane, rays_.size() - 1); };
    const Vec3<Pack> ray = vectors_of([&](std::size_t lane) { return rays_[at(lane)].direction; });
    const Vec3<Pack> normal = vectors_of([&](std::size_t lane) { return hits_[at(lane)].normal; });
    const Vec3<Pack> across = cross_of(ray, normal);
    const Pack angle_rad = angle_of(sqrt(dot_of(across, across)), abs(dot_of(ray, normal)));
    for (std::size_t lane = 0; lane < pack_size; ++lane)
      into.at(columns_[at(lane)], y)[0] = static_cast<float>(angle_rad[lane]);
  }
}

void RowTruth::write_pixels(int y, ImageTruth& into) const {
  int x = first_;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    while (x < columns_[i]) write_sky(x++, y, into);
    const Hit& hit = hits_[i];
    if (hit) {
      into.range_m.at(x, y)[0] = static_cast<float>(hit.range_m);
      into.depth_m.at(x, y)[0] =
          static_cast<float>(hit.range_m * directions_[static_cast<std::size_t>(x)].z);
      write_surface(x, y, rays_[i], hit, into);
    } else {
      write_sky(x, y, into);
    }
    into.is_valid.at(x++, y)[0] = 1;
  }
  while (x < end_) write_sky(x++, y, into);
  write_incidence(y, into.incidence_rad);
}

void RowTruth::bound(int row, ImageF& into) {
  bounds_m_.resize(rays_.size());
  scene_.rays.bound_errors(rays_, hits_, bounds_m_);
  for (int x = first_; x < end_; ++x) into.at(x, row)[0] = 0;
  for (std::size_t i = 0; i < rays_.size(); ++i)
    into.at(columns_[i], row)[0] = static_cast<float>(bounds_m_[i]);
}

void RowTruth::write_sky(int x, int y, ImageTruth& into) const {
  into.is_valid.at(x, y)[0] = 0;
  into.range_m.at(x, y)[0] = std::numeric_limits<float>::infinity();
  into.depth_m.at(x, y)[0] = std::numeric_limits<float>::infinity();
  put(into.p_DQ, x, y, glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
  for (ImageF* image : {&into.normal, &into.shading_normal, &into.albedo})
    put(*image, x, y, glm::vec3(nan));
  into.incidence_rad.at(x, y)[0] = nan;
  put(into.velocity_m_s, x, y, glm::vec3(0));
  for (auto* image : {&into.label, &into.instance, &into.material}) image->at(x, y)[0] = 0;
}

void RowTruth::write_surface(int x, int y, const Ray& ray, const Hit& hit, ImageTruth& into) const {
  const glm::dvec3 p_DQ = ray.origin + ray.direction * hit.range_m;
  const glm::dvec3 normal = glm::normalize(glm::dvec3(hit.normal));
  put(into.p_DQ, x, y, p_DQ);
  put(into.normal, x, y, normal);
  const bool is_bare = hit.object == 0 && scene_.cover.empty();  // no textures
  const SurfaceTruth surface = is_bare ? scene_.terrain : scene_.truth_of(ray, hit);
  if (is_bare) {
    put(into.shading_normal, x, y, normal);
    put(into.albedo, x, y, materials_.albedos[surface.material]);
  } else {
    const auto [seen, shading_normal] = scene_.look_at(ray, hit, 0, Filtering::Fast);
    put(into.shading_normal, x, y, shading_normal);
    put(into.albedo, x, y, albedo_of(seen));
  }
  put(into.velocity_m_s, x, y,
      hit.object == 0 ? glm::dvec3(0) : scene_.objects.velocity_m_s(hit.object, p_DQ, ray.time));
  into.label.at(x, y)[0] = surface.label;
  into.instance.at(x, y)[0] = surface.instance;
  into.material.at(x, y)[0] = surface.material + 1u;
}

glm::vec3 RowTruth::albedo_of(const Appearance& seen) const {
  glm::vec3 albedo(0);
  for (std::uint32_t i = 0; i < seen.count; ++i) {
    const Appearance::Part& part = seen.parts[i];
    albedo += part.share * materials_.albedo(part.material, part.tint.color);
  }
  return albedo;
}

void RowTruth::follow(int y, nanoseconds begin, Flow& flow) {
  for (int x = first_; x < end_; ++x) {
    put(flow.offset_px, x, y, glm::vec2(nan));
    flow.is_seen.at(x, y)[0] = 0;
  }
  seen_columns_.clear();
  seen_rays_.clear();
  seen_ranges_m_.clear();
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const glm::dvec2 pixel(columns_[i], y);
    const Mover point(scene_.objects, rays_[i], hits_[i]);
    const auto seen = observe(camera_, X_DC_, begin, point, y);
    if (!seen) continue;
    put(flow.offset_px, columns_[i], y, seen->pixel - pixel);
    if (!is_inside(camera_.spec().size_px, seen->pixel)) continue;
    const double far_m = std::numeric_limits<double>::infinity();
    seen_columns_.push_back(columns_[i]);
    seen_rays_.push_back(
        {seen->X_DC.translation_m, glm::normalize(seen->towards), far_m, seen->time});
    seen_ranges_m_.push_back(point.is_sky() ? far_m : glm::length(seen->towards));
  }
  seen_hits_.resize(seen_rays_.size());
  scene_.trace(seen_rays_, seen_hits_);
  for (std::size_t i = 0; i < seen_rays_.size(); ++i) {
    const double range_m = seen_ranges_m_[i], met_m = seen_hits_[i].range_m;
    const bool is_seen = std::isinf(range_m) ? std::isinf(met_m)
                                             : std::abs(met_m - range_m) <= same_range_m(range_m);
    flow.is_seen.at(seen_columns_[i], y)[0] = is_seen ? 1 : 0;
  }
}

void check_albedos(const Scene& scene, std::size_t albedos) {
  const auto check = [&](std::uint16_t material) {
    if (material >= albedos)
      throw Error(
          "truth of an image: the scene uses material {}, but there are {} albedos; there must be "
          "one for each of its materials",
          material, albedos);
  };
  if (scene.cover.empty()) check(scene.terrain.material);
  for (const CoverLayer& layer : scene.cover.layers()) check(layer.material);
  for (const ModelTruth& model : scene.models) std::ranges::for_each(model.materials, check);
}

}  // namespace

ImageTruth image_truth(const Camera& camera, const Scene& scene,
                       const Materials::InColour& materials, const Trajectory& X_DC,
                       const TruthRequest& request, ImageTruth buffers) {
  for (const auto& begin : {std::optional(request.begin), request.before, request.after}) {
    if (begin) camera.check_cover(X_DC, *begin);
  }
  check_albedos(scene, materials.albedos.size());
  ImageTruth truth = std::move(buffers);
  shape(truth, camera.spec().size_px, request);
  tbb::enumerable_thread_specific<RowTruth> rows(
      [&] { return RowTruth(camera, scene, materials, X_DC); });
  tbb::parallel_for(0, camera.spec().size_px.y,
                    [&](int row) { rows.local().fill(row, request, truth); });
  return truth;
}

}  // namespace groundray
