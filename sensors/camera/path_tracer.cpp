#include "sensors/camera/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "core/appearance/normal_map.h"
#include "core/error.h"

namespace groundray {
namespace {

// Height above a surface at which rays start: more than the error of the range and rounding, which
// could put them below.
double lift_m(double range_m) { return 1e-6 + 2e-9 * range_m; }

bool is_dark(const glm::vec3& light) { return std::max({light.r, light.g, light.b}) <= 0; }

// Balance heuristic: weight of a contribution sampled with density `own` that another strategy
// samples with density `other`. Camera rays, of density 0, have no other strategy.
double balance_heuristic(double own, double other) { return own > 0 ? own / (own + other) : 1.0; }

// Converts a density by area on a surface to a density by direction.
double pdf_per_sr(double pdf_per_m2, const glm::dvec3& normal, const glm::dvec3& direction,
                  double distance_m) {
  const double cosine = std::abs(glm::dot(normal, direction));
  return cosine > 0 ? pdf_per_m2 * distance_m * distance_m / cosine : 0;
}

// Turns a shading normal that faces away from the camera until it does not, so that surfaces are
// not black at grazing angles.
glm::dvec3 towards_eye(const glm::dvec3& normal, const glm::dvec3& to_eye) {
  const double cosine = glm::dot(normal, to_eye);
  if (cosine >= least_shading_cosine) return normal;
  return glm::normalize(normal + (least_shading_cosine - cosine) * to_eye);
}

// BSDF of the surface that a path hits, tinted by its textures.
class Scatterer {
 public:
  Scatterer(std::span<const Bsdf> bsdfs, const Appearance& seen, SobolPairs& numbers) {
    std::uint32_t part = 0;
    if (seen.count > 1) {  // choose one layer, with a probability equal to its share
      double left = numbers.next().x;
      while (part + 1 < seen.count && left >= static_cast<double>(seen.parts[part].share))
        left -= static_cast<double>(seen.parts[part++].share);
    }
    const auto& [material, share, tint] = seen.parts[part];
    bsdf_ = &bsdfs[material];
    if (tint.color != glm::vec3(1)) bsdf_ = &tinted_.emplace(bsdf_->tinted(glm::dvec3(tint.color)));
  }
  Scatterer(const Scatterer&) = delete;
  Scatterer& operator=(const Scatterer&) = delete;

  const Bsdf& operator*() const { return *bsdf_; }

 private:
  const Bsdf* bsdf_;
  std::optional<Bsdf> tinted_;  // optional because a Bsdf is large and most surfaces have no tint
};

}  // namespace

// Surface point of a path.
struct PathTracer::Vertex {
  // Orthonormal axes of a surface; z is `normal`. @see Duff et al., Building an orthonormal basis,
  // revisited, JCGT 6(1) (2017).
  struct Axes {
    glm::dvec3 x, y, z;
    explicit Axes(const glm::dvec3& normal) : z(normal) {
      const double sign = std::copysign(1.0, normal.z);
      const double a = -1 / (sign + normal.z), b = normal.x * normal.y * a;
      x = {1 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
      y = {b, sign + normal.y * normal.y * a, -normal.y};
    }
    glm::dvec3 into(const glm::dvec3& d) const {
      return {glm::dot(d, x), glm::dot(d, y), glm::dot(d, z)};
    }
    glm::dvec3 out_of(const glm::dvec3& d) const { return d.x * x + d.y * y + d.z * z; }
  };

  Vertex(const Ray& ray, const Hit& hit, const glm::dvec3& shading_normal)
      : at(ray.origin + ray.direction * hit.range_m),
        facet(glm::normalize(glm::dvec3(hit.normal))),
        offset_m(lift_m(hit.range_m)),
        far_m(ray.far_m),
        time(ray.time),
        axes(towards_eye(shading_normal, -ray.direction)),
        to_eye(axes.into(-ray.direction)) {}

  // Returns the origin of a ray that leaves to the side of a direction.
  glm::dvec3 start(const glm::dvec3& direction) const {
    return at + facet * std::copysign(offset_m, glm::dot(direction, facet));
  }
  // True if a direction is on the same side of the facet and of the shading normal; no other light
  // passes.
  bool lets_pass(const glm::dvec3& direction) const {
    return glm::dot(direction, facet) * glm::dot(direction, axes.z) > 0;
  }
  std::optional<Ray> leave(const glm::dvec3& direction) const {
    if (!lets_pass(direction)) return std::nullopt;
    return Ray{start(direction), direction, far_m, time};
  }
  // Returns a shadow ray that ends before a point, by more than the error of its range.
  std::optional<Ray> leave_for(const glm::dvec3& point) const {
    const glm::dvec3 origin = start(point - at);
    const double distance_m = glm::distance(origin, point);
    const glm::dvec3 direction = (point - origin) / distance_m;
    if (!(distance_m > 0) || !lets_pass(direction)) return std::nullopt;
    return Ray{origin, direction, distance_m - lift_m(distance_m), time};
  }

  glm::dvec3 at, facet;
  double offset_m, far_m;
  std::chrono::nanoseconds time;
  Axes axes;          // z is the shading normal
  glm::dvec3 to_eye;  // in `axes`
};

PathTracer::PathTracer(const Scene& scene, const Sky& sky, int depth,
                       const std::optional<AerialPerspective>& air)
    : scene_(scene),
      sky_(sky),
      depth_(depth),
      air_(air),
      bsdfs_(scene.materials.in_colour().bsdfs),
      emitters_(scene) {
  if (depth < 1 || depth > 64) throw Error("depth = {} must be from 1 to 64", depth);
}

void PathTracer::trace(std::span<const Sample> samples, std::span<glm::vec3> radiance,
                       Workspace& work, std::span<std::uint16_t> labels) const {
  work.paths.clear();
  work.rays.clear();
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    work.paths.push_back({i, 0, glm::vec3(1), samples[i].numbers});
    work.rays.push_back(samples[i].ray);
    radiance[i] = glm::vec3(0);
  }
  for (int rays = 1; rays <= depth_ && !work.paths.empty(); ++rays) {
    work.hits.resize(work.rays.size());
    scene_.trace(work.rays, work.hits, rays == 1 ? Batch::Alike : Batch::Scattered);
    for (std::size_t i = 0; rays == 1 && i < labels.size(); ++i)
      labels[i] = work.hits[i] ? scene_.truth_of(work.rays[i], work.hits[i]).label : 0;
    work.next_paths.clear();
    work.next_rays.clear();
    for (Workspace::ShadowQueue* queue : {&work.of_sun, &work.of_others}) {
      queue->rays.clear();
      queue->lights.clear();
    }
    for (std::size_t k = 0; k < work.paths.size(); ++k) {
      Workspace::Path& path = work.paths[k];
      radiance[path.sample] += emitted(work.rays[k], work.hits[k], path);
      if (work.hits[k] && rays < depth_) scatter(work.rays[k], work.hits[k], path, work);
    }
    add_light(work.of_sun, Batch::ShadowRays, radiance, work);
    add_light(work.of_others, Batch::Scattered, radiance, work);
    std::swap(work.paths, work.next_paths);
    std::swap(work.rays, work.next_rays);
  }
}

// Adds unoccluded direct light.
void PathTracer::add_light(const Workspace::ShadowQueue& queue, Batch batch,
                           std::span<glm::vec3> radiance, Workspace& work) const {
  work.light_hits.resize(queue.rays.size());
  scene_.trace(queue.rays, work.light_hits, batch);
  for (std::size_t k = 0; k < queue.lights.size(); ++k) {
    const auto& [sample, arrives] = queue.lights[k];
    if (!work.light_hits[k]) radiance[sample] += arrives;
  }
}

// Returns emission and sky light that the path's own ray hits, MIS-weighted, and light that the air
// adds; attenuates the throughput by the air.
glm::vec3 PathTracer::emitted(const Ray& ray, const Hit& hit,
                              Workspace::Path& path) const noexcept {
  if (!hit) return path.throughput * glm::vec3(emitted_by_sky(ray.direction, path.pdf_per_sr));
  glm::vec3 sum(0);
  if (air_) {
    const glm::dvec3 added =
        air_->through(glm::dvec3(0), hit.range_m, sky_.horizon_radiance(ray.direction));
    sum += path.throughput * glm::vec3(added);
    path.throughput *= glm::vec3(air_->through(glm::dvec3(1), hit.range_m, glm::dvec3(0)));
  }
  if (!emitters_.any_shines()) return sum;
  const auto [shines, drawn_per_m2] = emitters_.glow_of(hit);
  const double share = balance_heuristic(
      path.pdf_per_sr, pdf_per_sr(drawn_per_m2, hit.normal, ray.direction, hit.range_m));
  return sum + path.throughput * glm::vec3(shines * share);
}

glm::dvec3 PathTracer::emitted_by_sky(const glm::dvec3& direction,
                                      double pdf_per_sr) const noexcept {
  if (!(pdf_per_sr > 0)) return sky_.radiance(direction);
  const double other = sky_.is_constant_dome() ? 0 : sky_.dome_pdf_per_sr(direction);
  return sky_.dome_radiance(direction) * balance_heuristic(pdf_per_sr, other);
}

// Next-event estimation. The sun is sampled here alone: hardly any path hits its disc by chance,
// and no lobe of a BSDF is much narrower. A constant dome is omitted: no density samples it better
// than the BSDF's.
void PathTracer::sample_direct(const Vertex& vertex, const Bsdf& bsdf, Workspace::Path& path,
                               Workspace& work) const {
  const auto enqueue = [&](Workspace::ShadowQueue& queue, const std::optional<Ray>& to_light,
                           const glm::dvec3& radiance, const auto& density) {
    if (!to_light) return;
    const glm::dvec3 wi = vertex.axes.into(to_light->direction);
    const glm::dvec3 weight = bsdf.eval(vertex.to_eye, wi) * (std::abs(wi.z) / density(wi));
    const glm::vec3 arrives = path.throughput * glm::vec3(weight * radiance);
    if (is_dark(arrives)) return;
    queue.rays.push_back(*to_light);
    queue.lights.push_back({path.sample, arrives});
  };
  const auto with_own = [&](double pdf_per_sr) {
    return [&, pdf_per_sr](const glm::dvec3& wi) {
      return pdf_per_sr + bsdf.pdf_per_sr(vertex.to_eye, wi);
    };
  };
  if (const auto& sun = sky_.sun(); sun && sun->is_up()) {
    const auto drawn = sun->sample(path.numbers.next());
    enqueue(work.of_sun, vertex.leave(drawn.direction), sun->radiance(drawn.direction),
            [&](const glm::dvec3&) { return drawn.pdf_per_sr; });
  }
  if (!sky_.is_constant_dome()) {
    const auto [direction, density] = sky_.sample_dome(path.numbers.next());
    if (density > 0)
      enqueue(work.of_others, vertex.leave(direction), sky_.dome_radiance(direction),
              with_own(density));
  }
  if (!emitters_.any_is_drawn()) return;
  const glm::dvec2 which = path.numbers.next();
  const auto [point, normal, glow] = emitters_.draw(which, path.numbers.next(), vertex.time);
  const auto ray = vertex.leave_for(point);
  if (!ray) return;
  const double distance_m = glm::distance(ray->origin, point);
  const double density = pdf_per_sr(glow.pdf_per_m2, normal, ray->direction, distance_m);
  if (!(density > 0)) return;
  enqueue(work.of_others, ray,
          air_ ? air_->through(glow.radiance, distance_m, glm::dvec3(0)) : glow.radiance,
          with_own(density));
}

void PathTracer::scatter(const Ray& ray, const Hit& hit, Workspace::Path path,
                         Workspace& work) const {
  const Vertex vertex(ray, hit, scene_.shading_normal_of(ray, hit, 0, Filtering::Fast));
  const Scatterer scatterer(bsdfs_, scene_.appearance_of(ray, hit, 0, Filtering::Fast),
                            path.numbers);
  const Bsdf& bsdf = *scatterer;
  sample_direct(vertex, bsdf, path, work);
  const auto [wi, weight, pdf_per_sr] = bsdf.sample(vertex.to_eye, path.numbers.next());
  if (!(pdf_per_sr > 0)) return;
  const auto onward = vertex.leave(vertex.axes.out_of(wi));
  path.throughput *= glm::vec3(weight);
  if (!onward || is_dark(path.throughput)) return;
  path.pdf_per_sr = static_cast<float>(pdf_per_sr);
  work.next_paths.push_back(path);
  work.next_rays.push_back(*onward);
}

}  // namespace groundray
