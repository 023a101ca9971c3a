#include "test/support/programs/closed_loop_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <utility>

#include "terrain/lod/pass.h"
#include "terrain/relief/fractal_field.h"
#include "terrain/terrain_scene.h"
#include "test/support/scans/solid.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::testing {
namespace {

using namespace std::chrono_literals;

constexpr int cells = 256;
constexpr double cell_m = 0.25, half_m = cells * cell_m / 2;
constexpr double eye_m = 1.9, clear_m = 3;
constexpr int boulders = 70, trunks = 40;
constexpr int most_poses = 10;
constexpr double radians_per_degree = std::numbers::pi / 180;

// Random streams, one per purpose.
enum class Draw : std::uint32_t { Ground, Boulder, Trunk, Pose, Visible, Mesh };

// Two uniform random numbers between 0 and 1.
glm::dvec2 uniform_draw(Seed seed, Draw draw, std::size_t index, std::uint32_t of = 0) {
  return random_uniform({seed, static_cast<std::uint32_t>(draw), of,
                         static_cast<std::uint32_t>(index), 0, RandomStream::Asset});
}

HeightGrid ground_of(Seed seed) {
  const std::vector<double> field = fractal_field(
      {.rms_m = 0.45, .hurst = 0.75, .shortest_m = 0.5, .longest_m = 64, .seed = seed},
      {cells, cells}, {cell_m, cell_m});
  constexpr std::size_t samples = cells + 1;
  std::vector<float> heights(samples * samples);
  for (std::size_t row = 0; row < samples; ++row) {
    for (std::size_t column = 0; column < samples; ++column)
      heights[row * samples + column] =
          static_cast<float>(field[(row % cells) * cells + column % cells]);
  }
  return {{cells + 1, cells + 1}, {-half_m, half_m}, {cell_m, -cell_m}, std::move(heights)};
}

// A ball with random waves on its surface.
Model boulder(Seed seed, std::size_t number) {
  constexpr int splits = 4, waves = 6;
  Model model =
      icosphere(0.35 + 0.9 * std::pow(uniform_draw(seed, Draw::Boulder, number).x, 2), splits);
  for (glm::dvec3& p_m : model.mesh.vertices_m) {
    const glm::dvec3 direction = glm::normalize(p_m);
    double swell = 1;
    for (std::uint32_t wave = 1; wave <= waves; ++wave) {
      const glm::dvec2 way = uniform_draw(seed, Draw::Boulder, number, 8 + 2 * wave);
      const glm::dvec2 size = uniform_draw(seed, Draw::Boulder, number, 9 + 2 * wave);
      const double up = 2 * way.x - 1, turn_rad = 2 * std::numbers::pi * way.y;
      const double across = std::sqrt(1 - up * up);
      const glm::dvec3 axis(across * std::cos(turn_rad), across * std::sin(turn_rad), up);
      swell += 0.12 * size.x / std::sqrt(wave) *
               std::sin((1 + wave) * glm::dot(axis, direction) + 6 * size.y);
    }
    p_m *= swell;
  }
  return model;
}

class SceneMaker {
 public:
  SceneMaker(Seed seed, int poses)
      : seed_(seed), grid_(ground_of(seed)), truth_(testing::mesh_of(grid_)) {
    for (int spread = 1; spread <= most_poses; ++spread) paths_.push_back(path(spread));
    poses_ = paths_[static_cast<std::size_t>(std::clamp(poses, 1, most_poses) - 1)];
  }

  ClosedLoopScene make() && {
    for (std::size_t i = 0; i < boulders; ++i) {
      Model model = boulder(seed_, i);
      const double buried = 0.5 * uniform_draw(seed_, Draw::Boulder, i, 1).x - 0.2;
      const double reach_m = glm::length(model.mesh.vertices_m.front());
      stand(std::move(model), Draw::Boulder, i, buried * reach_m);
    }
    for (std::size_t i = 0; i < trunks; ++i) {
      const glm::dvec2 size = uniform_draw(seed_, Draw::Trunk, i);
      stand(cylinder(0.1 + 0.2 * size.x, 4 + 4 * size.y, 32), Draw::Trunk, i, -0.4);
    }
    RayTracer rays({full_resolution_level(grid_)}, {0, 0, 0}, Tracing::Exact);
    std::vector<ModelScene> scenes;
    for (Model& model : models_)
      scenes.emplace_back(rays.device(), std::move(model), Tracing::Exact);
    ObjectTracer objects(rays.device(), std::move(scenes), std::move(placed_), {});
    return {Scene{.rays = std::move(rays),
                  .terrain = {.label = 1},
                  .materials = {},
                  .objects = std::move(objects),
                  .models = std::move(truths_),
                  .cover = {}},
            std::move(truth_), std::move(poses_)};
  }

 private:
  std::vector<Pose> path(int poses) const {
    const double apart_m = poses <= 5 ? 6 : 4;
    std::vector<Pose> X_DS;
    for (int k = 0; k < poses; ++k) {
      const double along_m = (k - 0.5 * (poses - 1)) * apart_m;
      const glm::dvec2 p(along_m, 4 * std::sin(along_m / 8));
      const auto number = static_cast<std::size_t>(k);
      const glm::dvec2 turn = uniform_draw(seed_, Draw::Pose, number);
      const double roll_rad = 0.1 * (uniform_draw(seed_, Draw::Pose, number, 1).x - 0.5);
      X_DS.push_back({rotation_from_yaw_pitch_roll(2 * std::numbers::pi * turn.x,
                                                   0.1 * (turn.y - 0.5), roll_rad),
                      glm::dvec3(p, grid_.height_m_at(p).value_or(0) + eye_m)});
    }
    return X_DS;
  }

  // True if an object at p would not block the sensor, for any number of poses.
  bool is_clear(glm::dvec2 p) const {
    for (const auto& poses : paths_) {
      for (const Pose& pose : poses) {
        if (glm::distance(p, glm::dvec2(pose.translation_m)) < clear_m) return false;
      }
    }
    return true;
  }

  void stand(Model model, Draw draw, std::size_t number, double above_m) {
    glm::dvec2 p;
    for (std::uint32_t attempt = 100;; ++attempt) {
      p = (2.0 * uniform_draw(seed_, draw, number, attempt) - 1.0) * (half_m - 2);
      if (is_clear(p)) break;
    }
    const glm::dvec3 p_DO(p, grid_.height_m_at(p).value_or(0) + above_m);
    const auto first = static_cast<unsigned>(truth_.vertices_m.size());
    for (const glm::dvec3& p_OQ : model.mesh.vertices_m) truth_.vertices_m.push_back(p_DO + p_OQ);
    for (const glm::uvec3& t : model.mesh.triangles) truth_.triangles.push_back(t + first);
    placed_.push_back({.p_DO = p_DO, .model = static_cast<std::uint32_t>(models_.size())});
    truths_.push_back(
        {.label = draw == Draw::Boulder ? std::uint16_t{2} : std::uint16_t{3}, .materials = {0}});
    models_.push_back(std::move(model));
  }

  Seed seed_;
  HeightGrid grid_;
  TriangleMesh truth_;
  std::vector<std::vector<Pose>> paths_;
  std::vector<Pose> poses_;
  std::vector<Model> models_;
  std::vector<ModelTruth> truths_;
  std::vector<PlacedObject> placed_;
};

// Stratified random points of a mesh: one in each of `count` strata of equal area.
std::vector<glm::dvec3> area_samples(const TriangleMesh& mesh, std::size_t count, Seed seed,
                                     Draw draw) {
  std::vector<double> until_m2;
  double area_m2 = 0;
  const auto corner = [&](unsigned vertex) { return mesh.vertices_m[vertex]; };
  for (const glm::uvec3& t : mesh.triangles) {
    area_m2 += glm::length(glm::cross(corner(t.y) - corner(t.x), corner(t.z) - corner(t.x))) / 2;
    until_m2.push_back(area_m2);
  }
  std::vector<glm::dvec3> samples(count);
  run_pass(run_in_parallel, count, [&](std::size_t i) {
    const double within = uniform_draw(seed, draw, i, 0).x;
    const double at_m2 = area_m2 * (static_cast<double>(i) + within) / static_cast<double>(count);
    const auto found = std::ranges::upper_bound(until_m2, at_m2);
    const auto triangle =
        std::min(static_cast<std::size_t>(found - until_m2.begin()), mesh.triangles.size() - 1);
    const glm::dvec2 place = uniform_draw(seed, draw, i, 1);
    const double root = std::sqrt(place.x);
    const glm::uvec3 t = mesh.triangles[triangle];
    samples[i] = (1 - root) * corner(t.x) + root * (1 - place.y) * corner(t.y) +
                 root * place.y * corner(t.z);
  });
  return samples;
}

bool sees(const ClosedLoopScene& scene, const Pose& X_DS, const glm::dvec3& p_D, double within_m) {
  constexpr double rounding_m = 1e-5;  // the truth's vertices are sums, the ground's are floats
  const glm::dvec3 to = p_D - X_DS.translation_m;
  const double distance_m = glm::length(to);
  if (distance_m > within_m) return false;
  const glm::dvec3 in_S = glm::conjugate(X_DS.rotation) * to;
  const double elevation_deg = std::asin(in_S.z / distance_m) / radians_per_degree;
  if (elevation_deg < ClosedLoopLidar::lowest_deg || elevation_deg > ClosedLoopLidar::highest_deg)
    return false;
  const Ray ray{X_DS.translation_m, to / distance_m};
  Hit hit;
  scene.scene.trace({&ray, 1}, {&hit, 1});
  return hit.range_m > distance_m - rounding_m;
}

double share(std::size_t part, std::size_t of) {
  return static_cast<double>(part) / static_cast<double>(of);
}

double share_within(const ClosestPoint& mesh, std::span<const glm::dvec3> points_m,
                    double tolerance_m) {
  std::vector<std::uint8_t> is_near(points_m.size());
  run_pass(run_in_parallel, points_m.size(), [&](std::size_t i) {
    is_near[i] = mesh.nearest(points_m[i]).distance_m <= tolerance_m ? 1 : 0;
  });
  return share(static_cast<std::size_t>(std::ranges::count(is_near, 1)), points_m.size());
}

}  // namespace

ClosedLoopScene closed_loop_scene(Seed seed, int poses) { return SceneMaker(seed, poses).make(); }

Lidar ClosedLoopLidar::lidar() const {
  SpinningPattern head{.rate_hz = 10, .firing_period_s = 0.1 / columns};
  for (int ring = 0; ring < rings; ++ring) {
    const double elevation_deg = lowest_deg + (highest_deg - lowest_deg) * ring / (rings - 1);
    head.beams.push_back({.elevation_rad = elevation_deg * radians_per_degree,
                          .ring = static_cast<std::uint16_t>(ring)});
  }
  LidarSpec spec;
  spec.model = "of the closed loop";
  spec.pattern = head;
  spec.gate = {0.5, 100};
  spec.range_noise_sigma_m = noise_m;
  return Lidar(spec);
}

std::vector<PointCloud> scans_of(const ClosedLoopScene& scene, const ClosedLoopLidar& lidar,
                                 Seed seed) {
  const Lidar head = lidar.lidar();
  std::vector<PointCloud> scans;
  for (std::size_t i = 0; i < scene.X_DS.size(); ++i) {
    const Trajectory still({{0s, scene.X_DS[i]}, {1s, scene.X_DS[i]}});
    scans.push_back(head.scan(scene.scene, still, 0, seed, static_cast<std::uint32_t>(i)).echoes);
  }
  return scans;
}

std::vector<glm::dvec3> visible_samples(const ClosedLoopScene& scene, double within_m,
                                        std::size_t samples, Seed seed) {
  const std::vector<glm::dvec3> all = area_samples(scene.truth, samples, seed, Draw::Visible);
  std::vector<std::uint8_t> is_seen(all.size());
  run_pass(run_in_parallel, all.size(), [&](std::size_t i) {
    is_seen[i] = std::ranges::any_of(
        scene.X_DS, [&](const Pose& X_DS) { return sees(scene, X_DS, all[i], within_m); });
  });
  std::vector<glm::dvec3> seen;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_seen[i] != 0) seen.push_back(all[i]);
  }
  return seen;
}

ClosedLoopScore score(const TriangleMesh& mesh, const ClosestPoint& truth,
                      std::span<const glm::dvec3> visible, double tolerance_m) {
  const ClosestPoint of_mesh(mesh);
  const std::vector<glm::dvec3> samples =
      area_samples(mesh, std::max<std::size_t>(visible.size(), 1), Seed{1}, Draw::Mesh);
  ClosedLoopScore score{.precision = share_within(truth, samples, tolerance_m),
                        .completeness = share_within(of_mesh, visible, tolerance_m)};
  const double sum = score.precision + score.completeness;
  score.f1 = sum > 0 ? 2 * score.precision * score.completeness / sum : 0;
  return score;
}

}  // namespace groundray::testing
