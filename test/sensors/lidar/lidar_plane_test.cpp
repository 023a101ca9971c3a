// Echoes of planes at any incidence, against integrals over the whole beam.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <vector>

#include "core/appearance/materials.h"
#include "sensors/lidar/lidar.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"

namespace groundray::lidar_plane_test {
namespace {

using namespace std::chrono_literals;
using Profile = BeamSpec::Profile;

constexpr double pi = std::numbers::pi;
constexpr double c_m_s = speed_of_light_m_per_s;
constexpr double pulse_energy_j = 1e-7, aperture_m = 0.025, reflectance = 0.4;

const Material grey{"grey", Lambertian{{{300, reflectance}, {2500, reflectance}}}};

Scene scene_of(const HeightGrid& ground, const Material& material = grey) {
  return {RayTracer({full_resolution_level(ground)}, {0, 0, 0}, Tracing::Fast),
          {.label = 3, .instance = 4, .material = 0},
          {material}};
}

HeightGrid flat_ground() {
  return {{2, 2}, {-20'000, -20'000}, {40'000, 40'000}, std::vector<float>(4, 0.0f)};
}

// A pulse in the x-z plane, from height and depression that give a range and an incidence.
struct Aim {
  double range_m, incidence_rad;
  double roll_rad = 0;  // of the beam about its axis
};

glm::dvec3 direction_of(const Aim& aim) {
  return {std::sin(aim.incidence_rad), 0, -std::cos(aim.incidence_rad)};
}

glm::dquat rotation_of(const Aim& aim) { return glm::angleAxis(aim.roll_rad, direction_of(aim)); }

LidarSpec lidar_of(const BeamSpec& beam, double fwhm_s) {
  LidarSpec spec;
  spec.model = "test";
  spec.gate = {0.1, 2e4};
  spec.beam = beam;
  LightSpec& light = spec.light.emplace();
  light.wavelength_nm = 905;
  light.optics = {.pulse_energy_j = pulse_energy_j, .aperture_diameter_m = aperture_m};
  light.pulse = {.fwhm_s = fwhm_s};
  light.receiver.timing = ReceiverSpec::Timing::CentreOfGravity;
  light.receiver.threshold_w = 1e-15;
  light.receiver.returns = ReceiverSpec::Returns::All;
  return spec;
}

LidarScan scan_of(LidarSpec spec, const Aim& aim, const Scene& scene, double y_m = 0) {
  spec.pattern =
      TablePattern{.period_s = 1, .shots = {{.elevation_rad = aim.incidence_rad - pi / 2}}};
  const Pose pose{rotation_of(aim), {0, y_m, aim.range_m * std::cos(aim.incidence_rad)}};
  return Lidar(spec).scan(scene, Trajectory({{0s, pose}, {2s, pose}}), 0, Seed{7}, 0);
}

PointCloud echoes_of(const LidarSpec& spec, const Aim& aim, const Scene& scene, double y_m = 0) {
  return scan_of(spec, aim, scene, y_m).echoes;
}

// Return of a part of the beam.
struct BeamReturn {
  double range_m = 0, energy_j = 0;
};

// Returns of a plane. `retro_cos` is the BRDF times the cosine.
class PlaneReturns {
 public:
  PlaneReturns(const Aim& aim, std::function<double(double)> retro_cos)
      : aim_(aim), retro_cos_(std::move(retro_cos)), axis_(direction_of(aim)) {
    h_ = rotation_of(aim) * glm::dvec3(0, 1, 0);
    v_ = glm::cross(axis_, h_);
  }
  // Adds a sub-ray from an offset and with a slope across the axis.
  void add(double weight, const glm::dvec2& offset_m, const glm::dvec2& slope) {
    const glm::dvec3 d = glm::normalize(axis_ + slope.x * h_ + slope.y * v_);
    const double height_m =
        aim_.range_m * std::cos(aim_.incidence_rad) + offset_m.x * h_.z + offset_m.y * v_.z;
    weights_ += weight;
    if (d.z >= 0) return;
    const double range_m = height_m / -d.z;
    returns_.push_back({range_m, weight * retro_cos_(-d.z) / (range_m * range_m)});
  }
  double centroid_m() const {
    double sum = 0, moment_m = 0;
    for (const auto& [range_m, energy] : returns_) {
      sum += energy;
      moment_m += energy * (range_m - aim_.range_m);
    }
    return aim_.range_m + moment_m / sum;
  }
  // Returns the energies by the radar equation.
  std::vector<BeamReturn> returns() const {
    std::vector<BeamReturn> all = returns_;
    for (BeamReturn& part : all)
      part.energy_j *= pulse_energy_j * pi / 4 * aperture_m * aperture_m / weights_;
    return all;
  }

 private:
  Aim aim_;
  std::function<double(double)> retro_cos_;
  glm::dvec3 axis_, h_{0}, v_{0};
  double weights_ = 0;
  std::vector<BeamReturn> returns_;
};

double lambertian(double cosine) { return reflectance / pi * cosine; }

// Covers a beam from one point by a midpoint rule in radius and angle.
PlaneReturns beam_on_plane(const Aim& aim, const BeamSpec& beam,
                           const std::function<double(double)>& retro_cos) {
  constexpr int radii = 600, angles = 96;
  const double edge = beam.profile == Profile::Gaussian ? 3.6 : 1;
  const glm::dvec2 tangent = glm::tan(0.5 * beam.divergence_rad);
  PlaneReturns returns(aim, retro_cos);
  for (int i = 0; i < radii; ++i) {
    const double r = edge * (i + 0.5) / radii;
    const double weight = beam.profile == Profile::Gaussian ? r * std::exp(-2 * r * r) : r;
    for (int k = 0; k < angles; ++k) {
      const double angle_rad = 2 * pi * (k + 0.5) / angles;
      returns.add(weight, {0, 0},
                  tangent * r * glm::dvec2(std::cos(angle_rad), std::sin(angle_rad)));
    }
  }
  return returns;
}

double centroid_m(const Aim& aim, const BeamSpec& beam,
                  const std::function<double(double)>& retro_cos = lambertian) {
  return beam_on_plane(aim, beam, retro_cos).centroid_m();
}

// The same for a Gaussian beam with an aperture, whose positions and directions are independent.
double centroid_of_wide_aperture_m(const Aim& aim, const BeamSpec& beam) {
  constexpr int steps = 8;  // the trapezium rule converges exponentially
  const glm::dvec2 tangent = glm::tan(0.5 * beam.divergence_rad);
  PlaneReturns returns(aim, lambertian);
  const auto density = [](double x) { return std::exp(-2 * x * x); };
  const auto at = [](int i) { return 2.6 * i / steps; };
  for (int a = -steps; a <= steps; ++a) {
    for (int b = -steps; b <= steps; ++b) {
      for (int c = -steps; c <= steps; ++c) {
        for (int d = -steps; d <= steps; ++d) {
          returns.add(density(at(a)) * density(at(b)) * density(at(c)) * density(at(d)),
                      0.5 * beam.aperture_m * glm::dvec2(at(a), at(b)),
                      tangent * glm::dvec2(at(c), at(d)));
        }
      }
    }
  }
  return returns.centroid_m();
}

constexpr double incidences_deg[] = {0, 20, 45, 60, 70, 75, 80, 83, 85, 86, 87};

// Expects one echo of one surface at the centroid. The contract states 0.1 mm for the truth; the
// reported range adds floats: 2^-24 of a kilometre is 0.06 mm.
void expect_one_echo(const PointCloud& echoes, double expected_m, const std::string& which) {
  ASSERT_EQ(echoes.rows(), 1u) << which;
  EXPECT_EQ(echoes.column<float>("share")[0], 1) << which;
  const double true_m = echoes.column<double>("range_true")[0];
  EXPECT_NEAR(true_m, expected_m, 1e-4) << which;
  testing::record_margin("range_true", true_m - expected_m, 1e-4, "m");
  const glm::dvec3 point(echoes.column<float>("x")[0], echoes.column<float>("y")[0],
                         echoes.column<float>("z")[0]);
  EXPECT_NEAR(glm::length(point), expected_m, 1e-3) << which;
  testing::record_margin("reported range", glm::length(point) - expected_m, 1e-3, "m");
}

// From one metre to where a beam is 10 m wide, and up to 190 m deep at 87 degrees. Pulses are never
// refined, so that all depends on the quadrature.
TEST(LidarPlane, IsOneEchoAtTheCentroidOfItsEnergyAtAnyRangeAndIncidence) {
  const Scene scene = scene_of(flat_ground());
  int roll = 0;
  for (const double divergence_rad : {0.2e-3, 1e-3, 3e-3, 10e-3}) {
    for (const double range_m : {1., 3., 10., 30., 100., 300., 1000., 3000.}) {
      if (range_m * divergence_rad > 10) continue;
      for (const double incidence_deg : incidences_deg) {
        for (const Profile profile : {Profile::Gaussian, Profile::TopHat}) {
          const BeamSpec beam{.profile = profile,
                              .divergence_rad = {divergence_rad, 0.6 * divergence_rad},
                              .sub_rays = 16,
                              .most_sub_rays = 16,
                              .turn = roll % 2 ? BeamSpec::Turn::EachPulse : BeamSpec::Turn::Fixed};
          const Aim aim{range_m, glm::radians(incidence_deg), 0.4 * roll++};
          const double expected_m = centroid_m(aim, beam);
          for (const double fwhm_s : {1e-9, 5e-9, 20e-9}) {
            expect_one_echo(
                echoes_of(lidar_of(beam, fwhm_s), aim, scene), expected_m,
                fmt::format("{} m, {} deg, {} rad, {} s, profile {}", range_m, incidence_deg,
                            divergence_rad, fwhm_s, static_cast<int>(profile)));
          }
        }
      }
    }
  }
}

TEST(LidarPlane, EchoOfABeamWithAnApertureIsAtTheCentroidOfItsEnergy) {
  const Scene scene = scene_of(flat_ground());
  int roll = 0;
  for (const BeamSpec& beam :
       {BeamSpec{.divergence_rad = {3e-3, 1e-3}, .aperture_m = {8e-3, 20e-3}, .sub_rays = 16},
        BeamSpec{.divergence_rad = {10e-3, 5e-3}, .aperture_m = {20e-3, 30e-3}, .sub_rays = 16},
        BeamSpec{.divergence_rad = {0, 0}, .aperture_m = {20e-3, 30e-3}, .sub_rays = 16}}) {
    for (const double range_m : {2., 5., 10., 100.}) {
      for (const double incidence_deg : {45., 75., 85., 87.}) {
        const Aim aim{range_m, glm::radians(incidence_deg), 0.4 * roll++};
        const double expected_m = centroid_of_wide_aperture_m(aim, beam);
        for (const double fwhm_s : {0.5e-9, 5e-9}) {
          expect_one_echo(echoes_of(lidar_of(beam, fwhm_s), aim, scene), expected_m,
                          fmt::format("{} m, {} deg, {} s", range_m, incidence_deg, fwhm_s));
        }
      }
    }
  }
}

TEST(LidarPlane, EchoOfAnyMaterialIsAtTheCentroidOfItsEnergy) {
  const Spectrum half{{300, 0.5}, {2500, 0.5}};
  for (const Material& material :
       {Material{"rough", RoughDiffuse{half, 0.8}}, Material{"coated", Coated{half, 1.5, 0.3}},
        Material{"metal", Conductor{{{300, 1.5}, {2500, 1.5}}, {{300, 5}, {2500, 5}}, 0.5}},
        Material{"sheeting", RetroReflector{200}}}) {
    const Scene scene = scene_of(flat_ground(), material);
    const RetroBrdf brdf = retro_brdf(material, 905);
    for (const double divergence_rad : {1e-3, 10e-3}) {
      for (const double range_m : {1., 2., 5., 20., 300.}) {
        for (const double incidence_deg : {0., 45., 75., 85., 87.}) {
          const BeamSpec beam{.divergence_rad = glm::dvec2(divergence_rad), .sub_rays = 16};
          const Aim aim{range_m, glm::radians(incidence_deg)};
          const double expected_m =
              centroid_m(aim, beam, [&](double cosine) { return retro_brdf_cos(brdf, cosine); });
          expect_one_echo(echoes_of(lidar_of(beam, 5e-9), aim, scene), expected_m,
                          fmt::format("{}: {} m, {} deg, {} rad", material.name, range_m,
                                      incidence_deg, divergence_rad));
        }
      }
    }
  }
}

// Pulses with steep edges need closer nodes than Gaussians. Reported ranges are not compared: few
// samples of a steep edge do not give its centroid.
TEST(LidarPlane, EchoOfARectangularOrSkewedPulseIsOne) {
  const Scene scene = scene_of(flat_ground());
  const BeamSpec beam{.divergence_rad = glm::dvec2(3e-3), .sub_rays = 16};
  for (const std::vector<double>& shape :
       {std::vector<double>(40, 1.0), {1, 1}, {0, 5, 9, 7, 5, 4, 3, 2, 1}}) {
    for (const double incidence_deg : {0., 75., 85., 87.}) {
      const Aim aim{100, glm::radians(incidence_deg)};
      LidarSpec spec = lidar_of(beam, 0);
      spec.light->pulse = {.shape = shape, .shape_step_s = 0.5e-9};
      const PointCloud echoes = echoes_of(spec, aim, scene);
      ASSERT_EQ(echoes.rows(), 1u) << shape.size() << ' ' << incidence_deg;
      EXPECT_EQ(echoes.column<float>("share")[0], 1);
      EXPECT_NEAR(echoes.column<double>("range_true")[0], centroid_m(aim, beam), 1e-4);
    }
  }
}

TEST(LidarPlane, WaveformIsTheIntegralOverTheBeam) {
  const Scene scene = scene_of(flat_ground());
  constexpr double fwhm_s = 5e-9, sigma_m = c_m_s / 2 * fwhm_s / fwhm_per_sigma;
  for (const Profile profile : {Profile::Gaussian, Profile::TopHat}) {
    for (const auto& [range_m, divergence_rad] : {std::pair(50., 3e-3), std::pair(300., 1e-3)}) {
      for (const double incidence_deg : {75., 83., 87.}) {
        const Aim aim{range_m, glm::radians(incidence_deg)};
        const BeamSpec beam{
            .profile = profile, .divergence_rad = glm::dvec2(divergence_rad), .sub_rays = 16};
        LidarSpec spec = lidar_of(beam, fwhm_s);
        spec.waveforms = LidarSpec::WaveformOutput::Keep;
        const Waveforms found = scan_of(spec, aim, scene).waveforms;
        ASSERT_EQ(found.runs.size(), 1u);
        const std::vector<BeamReturn> returns = beam_on_plane(aim, beam, lambertian).returns();
        double peak_w = 0, largest_w = 0;
        for (std::size_t i = 0; i < found.power_w.size(); ++i) {
          const double at_m =
              c_m_s / 2 * (found.runs[0].start_s + static_cast<double>(i) * found.interval_s);
          double expected_w = 0;
          for (const BeamReturn& part : returns) {
            const double z = (at_m - part.range_m) / sigma_m;
            if (std::abs(z) < 7) expected_w += part.energy_j * std::exp(-z * z / 2);
          }
          expected_w *= fwhm_per_sigma / fwhm_s / std::sqrt(2 * pi);
          peak_w = std::max(peak_w, expected_w);
          largest_w = std::max(largest_w, std::abs(found.power_w[i] - expected_w));
        }
        // Nodes at the longest spacing add up to a constant within 1e-4.
        EXPECT_LE(largest_w, 1e-4 * peak_w) << range_m << ' ' << incidence_deg;
        testing::record_margin("waveform", largest_w / peak_w, 1e-4);
      }
    }
  }
}

// Ground at 0 to the right of the x axis, and at `height_m` to the left.
HeightGrid step_along_x(float height_m) {
  constexpr std::size_t rows = 20'001;
  std::vector<float> heights_m(2 * rows);
  for (std::size_t i = 0; i < rows; ++i)
    heights_m[2 * i] = heights_m[2 * i + 1] = i <= rows / 2 ? 0.0f : height_m;
  return {{2, int(rows)}, {-1000, -1}, {2000, 1e-4}, std::move(heights_m)};
}

// Both planes are hit over the same ranges; one lies 0.1 m higher, and 0.1 m / cos(80) = 0.58 m
// nearer, which a pulse of 5 ns resolves (c FWHM / 4 = 0.37 m). Steps of 0.02 m are not resolved.
TEST(LidarPlane, TwoPlanesAtAStepAlongTheBeamAreTwoSurfaces) {
  const Aim aim{60, glm::radians(80.)};
  constexpr double divergence_rad = 3e-3;
  const double w_m = aim.range_m * std::tan(divergence_rad / 2);
  for (const int sub_rays : {64, 1024}) {
    const BeamSpec beam{.divergence_rad = glm::dvec2(divergence_rad),
                        .sub_rays = sub_rays,
                        .most_sub_rays = sub_rays};
    const double tolerance = 2 * std::pow(sub_rays, -0.75) + 0.03;
    for (const double y_m : {0.01, 0.03}) {
      const double on_high = 0.5 * std::erfc(-std::numbers::sqrt2 * y_m / w_m);
      const PointCloud high =
          echoes_of(lidar_of(beam, 5e-9), aim, scene_of(step_along_x(0.1f)), y_m);
      ASSERT_EQ(high.rows(), 1u);
      const double larger = std::max(on_high, 1 - on_high);
      EXPECT_NEAR(high.column<float>("share")[0], larger, tolerance) << y_m;
      EXPECT_NEAR(high.column<float>("second_share")[0], 1 - larger, tolerance) << y_m;
      EXPECT_NEAR(high.column<double>("range_true")[0],
                  on_high > 0.5 ? aim.range_m - 0.1 / std::cos(aim.incidence_rad) : aim.range_m,
                  0.2)
          << y_m;
      const PointCloud low =
          echoes_of(lidar_of(beam, 5e-9), aim, scene_of(step_along_x(0.02f)), y_m);
      ASSERT_EQ(low.rows(), 1u);
      EXPECT_EQ(low.column<float>("share")[0], 1) << y_m;
    }
  }
}

// Gaps between sub-rays on one plane, here beside a mast, do not separate surfaces.
TEST(LidarPlane, IsOneSurfaceBesideAnotherWithFewSubRays) {
  const Scene scene = scene_of(step_along_x(30.0f));
  const Aim aim{100, glm::radians(85.)};
  const BeamSpec beam{.divergence_rad = glm::dvec2(3e-3), .sub_rays = 16, .most_sub_rays = 16};
  LidarSpec spec = lidar_of(beam, 5e-9);
  spec.light->receiver.response_fwhm_s = 0;
  const PointCloud echoes = echoes_of(spec, aim, scene, -0.02);
  ASSERT_GT(echoes.rows(), 0u);
  for (const float share : echoes.column<float>("share")) EXPECT_GT(share, 0.99f);
}

TEST(LidarPlane, RefinementFollowsFromPulseAndFootprint) {
  const auto sub_rays_of = [](double far_m, double divergence_rad, double fwhm_s) {
    LidarSpec spec =
        lidar_of({.divergence_rad = glm::dvec2(divergence_rad), .sub_rays = 16}, fwhm_s);
    spec.gate.far_m = far_m;
    spec.pattern = TablePattern{.period_s = 1, .shots = {{}}};
    return Lidar(spec).most_sub_rays();
  };
  // (2 w tan 87 / (c FWHM / 4))^2 with w = 0.15, 0.05 and 0.015 m: 233, 26 and 2.3.
  EXPECT_EQ(sub_rays_of(100, 3e-3, 5e-9), 256u);
  EXPECT_EQ(sub_rays_of(100, 1e-3, 5e-9), 32u);
  EXPECT_EQ(sub_rays_of(100, 0.3e-3, 5e-9), 16u);
  EXPECT_EQ(sub_rays_of(100, 0.3e-3, 1e-9), 64u);
  EXPECT_EQ(sub_rays_of(INFINITY, 0.3e-3, 5e-9), 1024u);
  EXPECT_EQ(sub_rays_of(INFINITY, 0, 5e-9), 16u);
}

}  // namespace
}  // namespace groundray::lidar_plane_test
