#include "sensors/camera/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

#include "core/appearance/normal_map.h"
#include "core/error.h"
#include "core/pack.h"

namespace groundray {
namespace {

// Height above a surface at which rays start: more than the error of the range and rounding, which
// could put them below.
template <typename Real>
Real lift_m(const Real& range_m) {
  return 1e-6 + 2e-9 * range_m;
}

// Balance heuristic: weight of a contribution sampled with density `own` that another strategy
// samples with density `other`. Camera rays, of density 0, have no other strategy.
double balance_heuristic(double own, double other) { return own > 0 ? own / (own + other) : 1.0; }

// Converts a density by area on a surface to a density by direction.
template <typename Real>
Real pdf_per_sr(const Real& pdf_per_m2, const Vec3<Real>& normal, const Vec3<Real>& direction,
                const Real& distance_m) {
  using std::abs;
  const Real cosine = abs(dot_of(normal, direction));
  return select(cosine > 0.0, pdf_per_m2 * distance_m * distance_m / cosine, Real(0.0));
}

// Turns shading normals that face away from the camera until they do not, so that surfaces are not
// black at grazing angles.
Vec3<Pack> towards_eye(const Vec3<Pack>& normal, const Vec3<Pack>& to_eye) {
  const Pack cosine = dot_of(normal, to_eye);
  const Vec3<Pack> turned = unit_of(normal + to_eye * (least_shading_cosine - cosine));
  return select(cosine >= least_shading_cosine, normal, turned);
}

}  // namespace

// Surface points of a pack of paths, all of one material.
struct PathTracer::Vertices {
  // Orthonormal axes of surfaces; z is `normal`. @see Duff et al., Building an orthonormal basis,
  // revisited, JCGT 6(1) (2017).
  struct Axes {
    Vec3<Pack> x, y, z;
    Axes() = default;
    explicit Axes(const Vec3<Pack>& normal) : z(normal) {
      const Pack sign = select(normal.z < 0.0, Pack(-1.0), Pack(1.0));
      const Pack a = -1.0 / (sign + normal.z), b = normal.x * normal.y * a;
      x = {1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
      y = {b, sign + normal.y * normal.y * a, -normal.y};
    }
    Vec3<Pack> into(const Vec3<Pack>& d) const {
      return {dot_of(d, x), dot_of(d, y), dot_of(d, z)};
    }
    Vec3<Pack> out_of(const Vec3<Pack>& d) const { return x * d.x + y * d.y + z * d.z; }
  };

  Vertices(std::span<const Workspace::Surface> surfaces, const Bsdf& surface, const Workspace& work)
      : count(surfaces.size()), bsdf(surface), numbers(PackOfWords(0u), PackOfWords(0u)) {
    std::array<const Ray*, pack_size> rays;
    std::array<const Hit*, pack_size> hits;
    std::array<const Workspace::Path*, pack_size> paths;
    std::array<const Workspace::Surface*, pack_size> seen;
    for (std::size_t lane = 0; lane < pack_size; ++lane) {
      seen[lane] = &surfaces[std::min(lane, count - 1)];
      rays[lane] = &work.rays[seen[lane]->path];
      hits[lane] = &work.hits[seen[lane]->path];
      paths[lane] = &work.paths[seen[lane]->path];
      samples[lane] = paths[lane]->sample;
      times[lane] = rays[lane]->time;
    }
    const Pack range_m = pack_of([&](std::size_t i) { return hits[i]->range_m; });
    const Vec3<Pack> direction = vectors_of([&](std::size_t i) { return rays[i]->direction; });
    at = vectors_of([&](std::size_t i) { return rays[i]->origin; }) + direction * range_m;
    facet = unit_of(vectors_of([&](std::size_t i) { return hits[i]->normal; }));
    offset_m = lift_m(range_m);
    far_m = pack_of([&](std::size_t i) { return rays[i]->far_m; });
    axes = Axes(towards_eye(
        unit_of(vectors_of([&](std::size_t i) { return seen[i]->shading_normal; })), -direction));
    to_eye = axes.into(-direction);
    tint = vectors_of([&](std::size_t i) { return seen[i]->tint; });
    throughput = vectors_of([&](std::size_t i) { return paths[i]->throughput; });
    const auto words = [&](auto get) {
      return PackOfWords([&](auto lane) { return get(paths[std::size_t{lane}]->numbers); });
    };
    numbers = {words([](const SobolPairs& n) { return n.seed(); }),
               words([](const SobolPairs& n) { return n.index(); }),
               words([](const SobolPairs& n) { return n.pairs(); })};
  }

  // Returns the origins of rays that leave to the side of a direction.
  Vec3<Pack> start(const Vec3<Pack>& direction) const {
    return at + facet * copysign(offset_m, dot_of(direction, facet));
  }
  // True where a direction is on the same side of the facet and of the shading normal; no other
  // light passes.
  Pack::mask_type lets_pass(const Vec3<Pack>& direction) const {
    return dot_of(direction, facet) * dot_of(direction, axes.z) > 0.0;
  }

  std::size_t count;  // of lanes in use; those beyond repeat the last
  const Bsdf& bsdf;
  std::array<std::uint32_t, pack_size> samples;
  std::array<std::chrono::nanoseconds, pack_size> times;
  Vec3<Pack> at, facet;
  Pack offset_m, far_m;
  Axes axes;          // z is the shading normal
  Vec3<Pack> to_eye;  // in `axes`
  Vec3<Pack> tint, throughput;
  SobolPairsOf<PackOfWords> numbers;
};

// Directions drawn to a light from a pack of surface points.
struct PathTracer::LightSamples {
  Vec3<Pack> direction;
  Vec3<Pack> radiance;
  Pack pdf_per_sr;  // 0 where there is none
  Pack far_m;       // length of the shadow rays
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

void PathTracer::trace(Workspace& work, std::span<glm::vec3> radiance,
                       std::span<std::uint16_t> labels) const {
  std::ranges::fill(radiance, glm::vec3(0));
  for (int rays = 1; rays <= depth_ && !work.paths.empty(); ++rays) {
    work.hits.resize(work.rays.size());
    scene_.trace(work.rays, work.hits, rays == 1 ? Batch::Alike : Batch::Scattered);
    for (std::size_t i = 0; rays == 1 && i < labels.size(); ++i)
      labels[i] = work.hits[i] ? scene_.truth_of(work.rays[i], work.hits[i]).label : 0;
    for (std::size_t k = 0; k < work.paths.size(); ++k) {
      Workspace::Path& path = work.paths[k];
      radiance[path.sample] += emitted(work.rays[k], work.hits[k], path);
    }
    if (rays == depth_) break;
    find_surfaces(work);
    for (Workspace::ShadowQueue* queue : {&work.of_sun, &work.of_others}) {
      queue->rays.clear();
      queue->lights.clear();
    }
    std::size_t begin = 0;
    for (const std::size_t end : work.ends) {
      for (; begin < end; begin = std::min(begin + pack_size, end))
        scatter(std::span(work.by_material).subspan(begin, std::min(pack_size, end - begin)), work);
    }
    add_light(work.of_sun, Batch::ShadowRays, radiance, work);
    add_light(work.of_others, Batch::Scattered, radiance, work);
    std::swap(work.paths, work.next_paths);
    std::swap(work.rays, work.next_rays);
    work.next_paths.clear();
    work.next_rays.clear();
  }
  work.paths.clear();
  work.rays.clear();
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
      path.pdf_per_sr,
      pdf_per_sr(drawn_per_m2, glm::dvec3(hit.normal), ray.direction, hit.range_m));
  return sum + path.throughput * glm::vec3(shines * share);
}

glm::dvec3 PathTracer::emitted_by_sky(const glm::dvec3& direction,
                                      double pdf_per_sr) const noexcept {
  if (!(pdf_per_sr > 0)) return sky_.radiance(direction);
  const double other = sky_.is_constant_dome() ? 0 : sky_.dome_pdf_per_sr(direction);
  return sky_.dome_radiance(direction) * balance_heuristic(pdf_per_sr, other);
}

// Looks up the surfaces that paths hit, ordered by material, so that packs of them share a BSDF.
void PathTracer::find_surfaces(Workspace& work) const {
  work.surfaces.clear();
  work.ends.assign(bsdfs_.size(), 0);
  for (std::uint32_t k = 0; k < work.paths.size(); ++k) {
    const Ray& ray = work.rays[k];
    const Hit& hit = work.hits[k];
    if (!hit) continue;
    if (hit.object == 0 && scene_.cover.empty()) {
      const std::uint16_t material = scene_.terrain.material;
      work.surfaces.push_back({glm::dvec3(hit.normal), glm::vec3(1), k, material});
      ++work.ends[material];
      continue;
    }
    const auto [seen, shading_normal] = scene_.look_at(ray, hit, 0, Filtering::Fast);
    std::uint32_t part = 0;
    if (seen.count > 1) {  // choose one layer, with a probability equal to its share
      double left = work.paths[k].numbers.next().x;
      while (part + 1 < seen.count && left >= static_cast<double>(seen.parts[part].share))
        left -= static_cast<double>(seen.parts[part++].share);
    }
    const auto& [material, share, tint] = seen.parts[part];
    work.surfaces.push_back({shading_normal, tint.color, k, material});
    ++work.ends[material];
  }
  std::exclusive_scan(work.ends.begin(), work.ends.end(), work.ends.begin(), std::size_t{0});
  work.by_material.resize(work.surfaces.size());
  for (const Workspace::Surface& surface : work.surfaces)
    work.by_material[work.ends[surface.material]++] = surface;
}

// Samples direct light at surface points and continues their paths.
void PathTracer::scatter(std::span<const Workspace::Surface> surfaces, Workspace& work) const {
  const Bsdf& bsdf = bsdfs_[surfaces.front().material];
  Vertices vertices(surfaces, bsdf, work);
  sample_direct(vertices, work);
  const auto drawn = bsdf.sample(vertices.to_eye, vertices.numbers.next(), vertices.tint);
  const Vec3<Pack> direction = vertices.axes.out_of(drawn.wi);
  const Vec3<Pack> origin = vertices.start(direction);
  const Vec3<Pack> throughput = vertices.throughput * drawn.weight;
  const auto goes_on =
      drawn.pdf_per_sr > 0.0 && vertices.lets_pass(direction) && largest_of(throughput) > 0.0;
  for (std::size_t lane = 0; lane < vertices.count; ++lane) {
    if (!goes_on[lane]) continue;
    work.next_paths.push_back({vertices.samples[lane],
                               static_cast<float>(drawn.pdf_per_sr[lane]),
                               glm::vec3(vector_at(throughput, lane)),
                               {vertices.numbers.seed()[lane], vertices.numbers.index()[lane],
                                vertices.numbers.pairs()[lane]}});
    work.next_rays.push_back({vector_at(origin, lane), vector_at(direction, lane),
                              vertices.far_m[lane], vertices.times[lane]});
  }
}

// Queues shadow rays to a light, with what they contribute if they are not occluded.
void PathTracer::enqueue(const Vertices& vertices, const LightSamples& light, Strategies strategies,
                         Workspace::ShadowQueue& queue) {
  using std::abs;
  const Vec3<Pack> wi = vertices.axes.into(light.direction);
  Pack density = light.pdf_per_sr;
  if (strategies == Strategies::Both)
    density += vertices.bsdf.pdf_per_sr(vertices.to_eye, wi, vertices.tint);
  const Vec3<Pack> weight =
      vertices.bsdf.eval(vertices.to_eye, wi, vertices.tint) * (abs(wi.z) / density);
  const Vec3<Pack> arrives = vertices.throughput * weight * light.radiance;
  const Vec3<Pack> origin = vertices.start(light.direction);
  const auto counts =
      light.pdf_per_sr > 0.0 && vertices.lets_pass(light.direction) && largest_of(arrives) > 0.0;
  for (std::size_t lane = 0; lane < vertices.count; ++lane) {
    if (!counts[lane]) continue;
    queue.rays.push_back({vector_at(origin, lane), vector_at(light.direction, lane),
                          light.far_m[lane], vertices.times[lane]});
    queue.lights.push_back({vertices.samples[lane], glm::vec3(vector_at(arrives, lane))});
  }
}

// Next-event estimation. The sun is sampled here alone: hardly any path hits its disc by chance,
// and no lobe of a BSDF is much narrower. A constant dome is omitted: no density samples it better
// than the BSDF's.
void PathTracer::sample_direct(Vertices& vertices, Workspace& work) const {
  if (const auto& sun = sky_.sun(); sun && sun->is_up()) {
    const auto drawn = sun->draw(vertices.numbers.next());
    const LightSamples to_sun{drawn.direction, drawn.radiance, Pack(1 / sun->solid_angle_sr()),
                              vertices.far_m};
    enqueue(vertices, to_sun, Strategies::LightAlone, work.of_sun);
  }
  if (!sky_.is_constant_dome()) {
    const Vec2<Pack> u = vertices.numbers.next();
    LightSamples to_dome{.far_m = vertices.far_m};
    for (std::size_t lane = 0; lane < pack_size; ++lane) {
      const auto [direction, density] = sky_.sample_dome({u.x[lane], u.y[lane]});
      set_vector(to_dome.direction, lane, direction);
      set_vector(to_dome.radiance, lane, sky_.dome_radiance(direction));
      to_dome.pdf_per_sr[lane] = density;
    }
    enqueue(vertices, to_dome, Strategies::Both, work.of_others);
  }
  if (emitters_.any_is_drawn()) sample_emitters(vertices, work);
}

void PathTracer::sample_emitters(Vertices& vertices, Workspace& work) const {
  using std::sqrt;
  const Vec2<Pack> which = vertices.numbers.next(), where = vertices.numbers.next();
  std::array<Emitters::Point, pack_size> drawn;
  for (std::size_t lane = 0; lane < pack_size; ++lane)
    drawn[lane] = emitters_.draw({which.x[lane], which.y[lane]}, {where.x[lane], where.y[lane]},
                                 vertices.times[lane]);
  const Vec3<Pack> point = vectors_of([&](std::size_t i) { return drawn[i].p_DQ; });
  const Vec3<Pack> from_start = point - vertices.start(point - vertices.at);
  const Pack distance_m = sqrt(dot_of(from_start, from_start));
  LightSamples light{.direction = from_start / distance_m,
                     .radiance = vectors_of([&](std::size_t i) {
                       const glm::dvec3& radiance = drawn[i].glow.radiance;
                       return air_ ? air_->through(radiance, distance_m[i], glm::dvec3(0))
                                   : radiance;
                     }),
                     // shadow rays end before the point, by more than the error of its range
                     .far_m = distance_m - lift_m(distance_m)};
  const Pack density = pdf_per_sr(pack_of([&](std::size_t i) { return drawn[i].glow.pdf_per_m2; }),
                                  vectors_of([&](std::size_t i) { return drawn[i].normal; }),
                                  light.direction, distance_m);
  // A point nearly in the facet's plane may be on the other side of it than its direction.
  const auto is_before =
      dot_of(point - vertices.at, vertices.facet) * dot_of(light.direction, vertices.facet) > 0.0 &&
      distance_m > 0.0;
  light.pdf_per_sr = select(is_before, density, Pack(0.0));
  enqueue(vertices, light, Strategies::Both, work.of_others);
}

}  // namespace groundray
