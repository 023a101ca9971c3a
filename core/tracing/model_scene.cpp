#include "core/tracing/model_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/tracing/device.h"
#include "core/tracing/level_scene.h"

namespace groundray {
namespace {

Model checked_model(Model model) {
  check_model(model, "model");
  return model;
}

std::optional<Texture> texture_of(const ModelImage& image, Encoding encoding) {
  if (!image.exists()) return std::nullopt;
  return Texture(image.file.empty() ? image.pixels : read_image8(image.file), encoding,
                 Wrap::Repeat);
}

ModelScene::Impl::Textures textures_of(const ModelSurface& surface) {
  ModelScene::Impl::Textures all{texture_of(surface.albedo, Encoding::Srgb),
                                 texture_of(surface.normal, Encoding::Linear),
                                 texture_of(surface.opacity, Encoding::Linear)};
  if (all.opacity || (all.albedo && all.albedo->has_alpha())) all.least_alpha = surface.least_alpha;
  return all;
}

// Tests in double whether a ray passes through a cut-out of a triangle. One that the ray misses in
// double counts as opaque, since the ray may hit its neighbour.
CutOut cut_out_at(const ModelScene::Impl& model, std::uint32_t triangle,
                  const ModelRay& ray) noexcept {
  const glm::dvec3 edges = model.edges_of(triangle, ray);
  const bool passes = is_inside(edges) && !model.is_opaque(triangle, model.shares(edges));
  return passes ? CutOut::Transparent : CutOut::Opaque;
}

// Rejects hits where a cut-out is transparent: in double wherever floats are too coarse.
void filter_cut(const RTCFilterFunctionNArguments* arguments) {
  const auto& model = *static_cast<const ModelScene::Impl*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const ModelQuery*>(arguments->context);
  RTCRayN* const rays = arguments->ray;
  RTCHitN* const hits = arguments->hit;
  const unsigned count = arguments->N;
  unsigned lanes = 0;
  for (unsigned i = 0; i < count; ++i) lanes |= (arguments->valid[i] & 1u) << i;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(lanes));
    const ModelRay& ray = query.rays[RTCRayN_id(rays, count, i)];
    const unsigned primitive = RTCHitN_primID(hits, count, i);
    CutOut cut_out = model.cut_outs.at(
        primitive, ray.origin,
        {RTCHitN_u(hits, count, i),
         RTCHitN_v(hits, count, i),
         RTCRayN_tfar(rays, count, i),
         {RTCHitN_Ng_x(hits, count, i), RTCHitN_Ng_y(hits, count, i), RTCHitN_Ng_z(hits, count, i)},
         {RTCRayN_dir_x(rays, count, i), RTCRayN_dir_y(rays, count, i),
          RTCRayN_dir_z(rays, count, i)}});
    if (cut_out == CutOut::Unsure) cut_out = cut_out_at(model, model.cut[primitive], ray);
    arguments->valid[i] = -static_cast<int>(cut_out);
  }
}

Owned<RTCBuffer> vertices_of(const ModelScene::Impl& model) {
  const auto& vertices_m = model.model.mesh.vertices_m;
  Owned<RTCBuffer> buffer(rtcNewBuffer(
      handle(model.device), vertices_m.size() * sizeof(glm::vec3) + 16));  // Embree reads 16 bytes
  auto* const out =
      buffer == nullptr ? nullptr : static_cast<glm::vec3*>(rtcGetBufferData(buffer.get()));
  if (out == nullptr) throw Error("ray tracer: there is not enough memory for a model's vertices");
  std::ranges::transform(vertices_m, out, [&](const glm::dvec3& vertex_m) {
    return glm::vec3(vertex_m - model.centre_m);
  });
  return buffer;
}

void add_triangles(const ModelScene::Impl& model, const Owned<RTCBuffer>& vertices, unsigned id,
                   const std::vector<std::uint32_t>& triangles) {
  if (triangles.empty()) return;
  const Owned<RTCGeometry> geometry(
      rtcNewGeometry(handle(model.device), RTC_GEOMETRY_TYPE_TRIANGLE));
  rtcSetGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.get(),
                       0, sizeof(glm::vec3), model.model.mesh.vertices_m.size());
  auto* const corners = static_cast<glm::uvec3*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              sizeof(glm::uvec3), triangles.size()));
  if (corners == nullptr)
    throw Error("ray tracer: there is not enough memory for a model's triangles");
  std::ranges::transform(triangles, corners, [&](std::uint32_t triangle) {
    return model.model.mesh.triangles[triangle];
  });
  if (id == 1) {
    rtcSetGeometryUserData(geometry.get(), const_cast<ModelScene::Impl*>(&model));
    rtcSetGeometryIntersectFilterFunction(geometry.get(), filter_cut);
  }
  attach(model.scene.get(), geometry, id);
}

void triangle_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& model = *static_cast<const ModelScene::Impl*>(arguments->geometryUserPtr);
  const glm::uvec3& corners = model.model.mesh.triangles[arguments->primID];
  glm::dvec3 low = model.model.mesh.vertices_m[corners.x];
  glm::dvec3 high = low;
  for (int k = 1; k < 3; ++k) {
    low = glm::min(low, model.model.mesh.vertices_m[corners[k]]);
    high = glm::max(high, model.model.mesh.vertices_m[corners[k]]);
  }
  const glm::vec3 padded_low = glm::vec3(low - model.centre_m) - model.slack_m;
  const glm::vec3 padded_high = glm::vec3(high - model.centre_m) + model.slack_m;
  *arguments->bounds_o = {padded_low.x,  padded_low.y,  padded_low.z,  0,
                          padded_high.x, padded_high.y, padded_high.z, 0};
}

// Replaces `best` if the ray hits the triangle before it; returns whether it does.
bool take_nearer(const ModelScene::Impl& model, std::uint32_t triangle, const ModelRay& ray,
                 const glm::dvec3& edges, ModelCrossing& best) noexcept {
  if (!is_inside(edges)) return false;
  const ModelCrossing crossing{model.range_m(triangle, ray), triangle};
  if (!(crossing.t_m >= 0 && crossing < best)) return false;
  if (!model.is_opaque(triangle, model.shares(edges))) return false;
  best = crossing;
  return true;
}

// Intersects one triangle with each ray of a packet, in double.
void intersect_triangle(const RTCIntersectFunctionNArguments* arguments) {
  const auto& model = *static_cast<const ModelScene::Impl*>(arguments->geometryUserPtr);
  const auto& query = *reinterpret_cast<const ModelQuery*>(arguments->context);
  const std::uint32_t triangle = arguments->primID;
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    const ModelRay& ray = query.rays[lane];
    ModelCrossing& best = query.crossings[lane];
    if (!take_nearer(model, triangle, ray, model.edges_of(triangle, ray), best)) continue;
    float& far_m = RTCRayN_tfar(rays, arguments->N, i);
    far_m = std::min(far_m, far_float(best.t_m - query.enter_m[lane], model.slack_m));
  }
}

}  // namespace

ModelScene::Impl::Impl(const RayDevice& with, Model content, Tracing how)
    : device(with), model(checked_model(std::move(content))), tracing(how), stars(model.mesh) {
  for (const ModelSurface& surface : model.surfaces)
    textures.push_back(groundray::textures_of(surface));
  for (std::size_t i = 0; i < textures.size() && model.uv.empty(); ++i) {
    if (textures[i].least_alpha > 0) {
      throw Error(
          "model: its surface '{}' is cut out by an image, but the model has no uv: add uv, or "
          "remove the image's alpha",
          model.surfaces[i].name);
    }
  }
  find_means();
  const ModelBounds bounds = bounds_of(model.mesh);
  low_m = bounds.low_m;
  high_m = bounds.high_m;
  centre_m = (low_m + high_m) / 2.0;
  radius_m = glm::length(glm::max(glm::abs(low_m), glm::abs(high_m)));
  slack_m = static_cast<float>(16 * 0x1p-24 * glm::length(high_m - low_m));
  for (std::uint32_t i = 0; i < model.mesh.triangles.size(); ++i)
    (textures_of(i).least_alpha > 0 ? cut : solid).push_back(i);
  if (tracing == Tracing::Fast && !cut.empty()) {
    std::vector<FloatCutOuts::Source> sources;
    for (const Textures& worn : textures) {
      const bool cuts = worn.least_alpha > 0;
      sources.push_back({cuts ? &worn.cut_by() : nullptr, worn.least_alpha});
    }
    cut_outs = FloatCutOuts(model, cut, sources, glm::length(high_m - low_m));
  }
  scene = new_scene(device);
  if (tracing == Tracing::Exact) {
    attach_primitives(device, scene.get(), 0, model.mesh.triangles.size(), this, triangle_bounds,
                      intersect_triangle);
  } else {
    const auto vertices = vertices_of(*this);
    add_triangles(*this, vertices, 0, solid);
    add_triangles(*this, vertices, 1, cut);
  }
  commit(scene.get());
  check(device, "building a model");
}

namespace {

// Projects vertices along the ray, by a shear along the axis that dominates its direction. All
// triangles that share a vertex get the same rounded position.
struct Sheared {
  glm::length_t x, y, z;
  double x_slope, y_slope;
  explicit Sheared(const glm::dvec3& direction) {
    const glm::dvec3 size = glm::abs(direction);
    z = size.x > size.y && size.x > size.z ? 0 : size.y > size.z ? 1 : 2;
    x = (z + 1) % 3;
    y = (z + 2) % 3;
    x_slope = direction[x] / direction[z];
    y_slope = direction[y] / direction[z];
  }
  glm::dvec2 operator()(const glm::dvec3& p) const noexcept {
    return {p[x] - x_slope * p[z], p[y] - y_slope * p[z]};
  }
};

// Returns a x b with an exact sign: if the rounded products are equal, their rounding errors
// decide.
double cross(const glm::dvec2& a, const glm::dvec2& b) noexcept {
  const double plus = a.x * b.y, minus = a.y * b.x;
  if (plus != minus) return plus - minus;
  return std::fma(a.x, b.y, -plus) - std::fma(a.y, b.x, -minus);
}

}  // namespace

// Projected along the ray, the triangles round a vertex wind about the ray an integer number of
// times if every sign is exact. Therefore no ray passes between them, however the positions of the
// vertices are rounded.
// @see Woop, Benthin and Wald, Watertight ray/triangle intersection, JCGT 2(1) (2013).
glm::dvec3 ModelScene::Impl::edges_of(std::uint32_t triangle, const ModelRay& ray) const noexcept {
  const glm::uvec3& corners = model.mesh.triangles[triangle];
  const Sheared across(ray.direction);
  const glm::dvec2 a = across(model.mesh.vertices_m[corners.x] - ray.origin);
  const glm::dvec2 b = across(model.mesh.vertices_m[corners.y] - ray.origin);
  const glm::dvec2 c = across(model.mesh.vertices_m[corners.z] - ray.origin);
  return {cross(a, b), cross(b, c), cross(c, a)};
}

glm::dvec3 ModelScene::Impl::normal(std::uint32_t triangle) const noexcept {
  const glm::uvec3& corners = model.mesh.triangles[triangle];
  const glm::dvec3& a = model.mesh.vertices_m[corners.x];
  return glm::cross(model.mesh.vertices_m[corners.y] - a, model.mesh.vertices_m[corners.z] - a);
}

double ModelScene::Impl::range_m(std::uint32_t triangle, const ModelRay& ray) const noexcept {
  const glm::dvec3 n = normal(triangle);
  const glm::dvec3& a = model.mesh.vertices_m[model.mesh.triangles[triangle].x];
  return glm::dot(n, a - ray.origin) / glm::dot(n, ray.direction);
}

bool ModelScene::Impl::is_opaque(std::uint32_t triangle, const glm::dvec3& shares) const noexcept {
  const Textures& worn = textures_of(triangle);
  if (worn.least_alpha == 0) return true;
  const glm::dvec2 uv = uv_at(triangle, shares);
  const Texture& cut_by = worn.cut_by();
  const float alpha = cut_by.has_alpha() ? cut_by.alpha(uv) : cut_by.color(uv).x;
  return alpha >= worn.least_alpha;
}

ModelCrossing ModelScene::Impl::intersect(std::uint32_t triangle,
                                          const ModelRay& ray) const noexcept {
  const glm::dvec3 edges = edges_of(triangle, ray);
  if (!is_inside(edges)) return {};
  ModelCrossing best{range_m(triangle, ray), triangle};
  if (!(best && best.t_m >= 0)) return {};
  if (edges.x == 0 || edges.y == 0 || edges.z == 0) return meet_beside(triangle, ray);
  for (std::uint32_t i = stars.next_twin(triangle); i != triangle; i = stars.next_twin(i))
    take_nearer(*this, i, ray, edges_of(i, ray), best);
  return best;
}

// Embree's rounding is finer than the triangles: a triangle that the ray hits shares a corner with
// the one that Embree reports.
ModelCrossing ModelScene::Impl::meet_beside(std::uint32_t triangle,
                                            const ModelRay& ray) const noexcept {
  ModelCrossing best;
  for (int k = 0; k < 3; ++k) {
    for (const std::uint32_t other : stars.round(model.mesh.triangles[triangle][k]))
      take_nearer(*this, other, ray, edges_of(other, ray), best);
  }
  return best;
}

ModelScene::ModelScene(const RayDevice& device, Model model, Tracing tracing)
    : impl_(std::make_shared<Impl>(device, std::move(model), tracing)) {}

const Model& ModelScene::model() const noexcept { return impl_->model; }

}  // namespace groundray
