#include "reconstruction/dem/fill/fill_error_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace groundray {
namespace {

constexpr std::size_t fewest = 30;
constexpr double least_roughness_m = 1e-9, least_m2 = 1e-18;
constexpr double usual_power = 1.5, usual_roughness_power = 2;  // exponents of the variance
constexpr double usual_weight = 10;                             // weight of these, in errors
constexpr double most_power = 6, most_roughness_power = 3;

Eigen::Vector3d law_terms(double distance_cells, double roughness_m) {
  return {1, std::log(std::max(distance_cells, 1e-3)),
          std::log(std::max(roughness_m, least_roughness_m))};
}

// Squared error and the terms that explain it.
struct Sample {
  Eigen::Vector3d terms;
  double square_m2;
};

// Returns twice the negative log-likelihood, plus that of the prior for the usual exponents, whose
// curvature is that of usual_weight errors.
double misfit_of(const std::vector<Sample>& samples, const Eigen::Vector3d& factors,
                 const Eigen::Vector3d& usual) {
  double sum = usual_weight / 2 * (factors - usual).tail<2>().squaredNorm();
  for (const Sample& sample : samples) {
    const double log_variance = sample.terms.dot(factors);
    sum += log_variance + sample.square_m2 * std::exp(-log_variance);
  }
  return sum;
}

// Scales the model so that squared errors equal its variance on average.
void level_law(const std::vector<Sample>& samples, Eigen::Vector3d& factors) {
  double sum = 0;
  for (const Sample& sample : samples)
    sum += sample.square_m2 * std::exp(-sample.terms.dot(factors));
  factors[0] += std::log(std::max(sum / static_cast<double>(samples.size()), 1e-12));
}

// Takes one step of Fisher scoring, shortened until it is an improvement. Returns whether the
// factors changed.
bool improve(const std::vector<Sample>& samples, const Eigen::Vector3d& usual,
             Eigen::Vector3d& factors) {
  Eigen::Matrix3d information = Eigen::Vector3d(0, usual_weight, usual_weight).asDiagonal();
  Eigen::Vector3d slope = information * (usual - factors);
  for (const Sample& sample : samples) {
    const double excess = sample.square_m2 * std::exp(-sample.terms.dot(factors)) - 1;
    information += sample.terms * sample.terms.transpose();
    slope += excess * sample.terms;
  }
  const Eigen::Vector3d step = information.ldlt().solve(slope);
  const double before = misfit_of(samples, factors, usual);
  for (double length = 1; length > 1e-3; length /= 2) {
    const Eigen::Vector3d next = factors + length * step;
    if (misfit_of(samples, next, usual) < before) {
      factors = next;
      return step.norm() * length > 1e-6;
    }
  }
  return false;
}

}  // namespace

double FillErrorModel::sd_m(double distance_cells, double roughness_m) const {
  const Eigen::Vector3d terms = law_terms(distance_cells, roughness_m);
  return std::exp((terms[0] * factors[0] + terms[1] * factors[1] + terms[2] * factors[2]) / 2);
}

std::optional<FillErrorModel> fit_law(std::span<const FillError> errors) {
  if (errors.size() < fewest) return std::nullopt;
  std::vector<Sample> samples;
  samples.reserve(errors.size());
  for (const FillError& error : errors) {
    samples.push_back({law_terms(error.distance_cells, error.roughness_m),
                       std::max(double{error.error_m} * error.error_m, least_m2)});
  }
  const Eigen::Vector3d usual(0, usual_power, usual_roughness_power);
  Eigen::Vector3d factors = usual;
  level_law(samples, factors);
  constexpr int most_improvements = 50;
  for (int step = 0; step < most_improvements && improve(samples, usual, factors); ++step) {
  }
  factors[1] = std::clamp(factors[1], 0.0, most_power);
  factors[2] = std::clamp(factors[2], 0.0, most_roughness_power);
  level_law(samples, factors);
  return FillErrorModel{{factors[0], factors[1], factors[2]}};
}

FillCover cover_of(std::span<const FillError> errors, const FillErrorModel& law) {
  if (errors.empty()) return {};
  FillCover cover{0, 0, 0};
  for (const FillError& error : errors) {
    const double sds = std::abs(error.error_m) / law.sd_m(error.distance_cells, error.roughness_m);
    cover.within_1sd += sds <= 1 ? 1 : 0;
    cover.within_2sd += sds <= 2 ? 1 : 0;
    cover.rms_sds += sds * sds;
  }
  const auto count = static_cast<double>(errors.size());
  return {cover.within_1sd / count, cover.within_2sd / count, std::sqrt(cover.rms_sds / count)};
}

}  // namespace groundray
