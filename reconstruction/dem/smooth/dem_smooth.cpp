#include "reconstruction/dem/smooth/dem_smooth.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

constexpr std::size_t smooth_bytes_per_sample = 640;
constexpr std::int64_t most_samples = 300'000'000;  // 7 matrix entries each are counted in 31 bits
constexpr double still_sds = 1e-3;                  // limit of the pull at convergence, in sds
// Relative residual of a round's solution; the next round, with other weights, reduces it further.
constexpr double solved_share = 0.03;
constexpr int most_steps = 10000;  // of the solver, per round

void check_smooth_inputs(const GridFrame& frame, std::span<const float> heights_m,
                         std::span<const float> variance_m2, const SmoothOptions& options,
                         const RunControl& work) {
  Violations broken("smoothing a DEM");
  const auto samples = std::int64_t{frame.samples.x} * frame.samples.y;
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2 && samples <= most_samples,
                "samples = [{}, {}] must be at least 2 along each axis, and at most {} in total",
                frame.samples.x, frame.samples.y, most_samples);
  const double area_m2 = frame.step_m.x * frame.step_m.y;
  broken.unless(std::isfinite(area_m2) && area_m2 != 0,
                "step_m = [{}, {}] must be finite and not zero", frame.step_m.x, frame.step_m.y);
  broken.unless(std::ssize(heights_m) == samples, "heights_m has {} entries for {} samples",
                heights_m.size(), samples);
  broken.unless(std::ssize(variance_m2) == samples, "variance_m2 has {} entries for {} samples",
                variance_m2.size(), samples);
  const double k = options.curvature_sd_per_m.value_or(1);
  broken.unless(k > 0 && std::isfinite(k), "curvature_sd_per_m = {} must be above 0 and finite", k);
  const auto is_infinite = [](float z) { return std::isinf(z); };
  broken.unless(std::ranges::none_of(heights_m, is_infinite),
                "a height is infinite; it must be finite, or NaN if unknown");
  broken.unless(std::ranges::none_of(variance_m2, [](float v) { return v <= 0 || std::isinf(v); }),
                "a variance is 0, negative or infinite; it must be above 0, or NaN if unmeasured");
  broken.throw_if_any();
  const std::size_t bytes = heights_m.size() * smooth_bytes_per_sample;
  if (bytes > work.most_bytes)
    throw Error(
        "smoothing a DEM of {} x {} samples takes {} MB, more than the {} MB allowed; smooth parts "
        "of it that overlap by about 20 cells",
        frame.samples.x, frame.samples.y, bytes / 1'000'000, work.most_bytes / 1'000'000);
}

// Second derivatives of one kind.
struct Derivatives {
  std::array<std::array<int, 2>, 4> offsets{};  // of the samples, ascending by number
  std::array<double, 4> factors{};
  std::vector<std::array<std::int32_t, 4>> rows;  // unknowns of each derivative
};

// Equations of one raster, in units of each height's sd. The least eigenvalue of their matrix is
// therefore 1 or more, and the residual is at least as large as the heights' distance from the
// solution.
class Smoothing {
 public:
  Smoothing(const GridFrame& frame, std::span<const float> heights_m,
            std::span<const float> variance_m2);

  double usual_curvature() const;
  SmoothHeights iterate(double curvature_sd_per_m, std::size_t most_rounds, const RunControl& work);

 private:
  // Returns the number of the unknown at an offset from a sample; -1 for none.
  std::int32_t unknown_at(std::uint32_t sample, const std::array<int, 2>& offset) const;
  void find_rows();
  void find_pattern();
  double derivative(const Derivatives& kind, const std::array<std::int32_t, 4>& row) const;
  void add(std::int32_t row, std::int32_t column, double value);
  void set_up(double curvature_sd_per_m);
  Eigen::VectorXd solve(double curvature_sd_per_m) const;

  const GridFrame& frame_;
  std::vector<std::int32_t> numbers_;   // unknown of each sample; -1 for none
  std::vector<std::uint32_t> samples_;  // sample of each unknown
  double base_m_ = 0;
  Eigen::VectorXd measured_m_, heights_m_, sds_m_;  // heights above the base
  std::array<Derivatives, 3> kinds_;                // xx, yy, and xy times sqrt(2)
  Matrix matrix_;                                   // lower triangle
  Eigen::VectorXd pull_;  // half the negative derivative of the cost by each height, times its sd
};

Smoothing::Smoothing(const GridFrame& frame, std::span<const float> heights_m,
                     std::span<const float> variance_m2)
    : frame_(frame), numbers_(heights_m.size(), -1) {
  for (std::uint32_t i = 0; i < heights_m.size(); ++i) {
    if (std::isnan(heights_m[i]) || std::isnan(variance_m2[i])) continue;
    numbers_[i] = static_cast<std::int32_t>(samples_.size());
    samples_.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(samples_.size());
  measured_m_.resize(count);
  sds_m_.resize(count);
  if (count > 0) base_m_ = heights_m[samples_.front()];
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::uint32_t sample = samples_[static_cast<std::size_t>(i)];
    measured_m_[i] = heights_m[sample] - base_m_;
    sds_m_[i] = std::sqrt(double{variance_m2[sample]});
  }
  heights_m_ = measured_m_;
  find_rows();
}

std::int32_t Smoothing::unknown_at(std::uint32_t sample, const std::array<int, 2>& offset) const {
  const auto columns = static_cast<std::uint32_t>(frame_.samples.x);
  const auto column = static_cast<int>(sample % columns) + offset[0];
  const auto row = static_cast<int>(sample / columns) + offset[1];
  if (column < 0 || column >= frame_.samples.x || row >= frame_.samples.y) return -1;
  return numbers_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
}

void Smoothing::find_rows() {
  const double dx = std::abs(frame_.step_m.x), dy = std::abs(frame_.step_m.y);
  const double xx = 1 / (dx * dx), yy = 1 / (dy * dy), xy = std::sqrt(2.0) / (dx * dy);
  kinds_[0] = {{{{0, 0}, {1, 0}, {2, 0}, {2, 0}}}, {xx, -2 * xx, xx, 0}, {}};
  kinds_[1] = {{{{0, 0}, {0, 1}, {0, 2}, {0, 2}}}, {yy, -2 * yy, yy, 0}, {}};
  kinds_[2] = {{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}}, {xy, -xy, -xy, xy}, {}};
  for (Derivatives& kind : kinds_) {
    for (const std::uint32_t sample : samples_) {
      std::array<std::int32_t, 4> row{};
      std::ranges::transform(kind.offsets, row.begin(), [&](const std::array<int, 2>& offset) {
        return unknown_at(sample, offset);
      });
      if (std::ranges::min(row) >= 0) kind.rows.push_back(row);
    }
  }
}

// Reserves entries for all samples that may share a derivative; unused entries stay 0.
void Smoothing::find_pattern() {
  constexpr std::array<std::array<int, 2>, 7> neighbours{
      {{0, 0}, {1, 0}, {2, 0}, {-1, 1}, {0, 1}, {1, 1}, {0, 2}}};
  const auto count = static_cast<int>(samples_.size());
  matrix_.resize(count, count);
  matrix_.reserve(count * std::ssize(neighbours));
  for (int column = 0; column < count; ++column) {
    matrix_.startVec(column);
    for (const auto& offset : neighbours) {
      const std::int32_t row = unknown_at(samples_[static_cast<std::size_t>(column)], offset);
      if (row >= 0) matrix_.insertBackByOuterInner(column, row) = 0;
    }
  }
  matrix_.finalize();
}

double Smoothing::derivative(const Derivatives& kind,
                             const std::array<std::int32_t, 4>& row) const {
  double sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) sum += kind.factors[i] * heights_m_[row[i]];
  return sum;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Returns the sd of second derivatives beyond that due to noise; at least a tenth of the latter.
double Smoothing::usual_curvature() const {
  std::vector<double> squares, noise;
  for (const Derivatives& kind : kinds_) {
    for (const auto& row : kind.rows) {
      const double size = derivative(kind, row);
      squares.push_back(size * size);
      noise.push_back(0);
      for (std::size_t i = 0; i < row.size(); ++i) {
        const double sd = kind.factors[i] * sds_m_[row[i]];
        noise.back() += sd * sd;
      }
    }
  }
  if (squares.empty()) return 1;
  constexpr double median_of_chi2 = 0.4549;  // with one degree of freedom
  const double usual_noise = median_of(std::move(noise));
  return std::sqrt(
      std::max(median_of(std::move(squares)) / median_of_chi2 - usual_noise, usual_noise / 100));
}

void Smoothing::add(std::int32_t row, std::int32_t column, double value) {
  int at = matrix_.outerIndexPtr()[column];
  while (matrix_.innerIndexPtr()[at] != row) ++at;
  matrix_.valuePtr()[at] += value;
}

// Sets up the equations for the changes of heights, with weights from their present values.
void Smoothing::set_up(double curvature_sd_per_m) {
  const double bending = 1 / (curvature_sd_per_m * curvature_sd_per_m);
  pull_ = (measured_m_ - heights_m_).cwiseQuotient(sds_m_);
  matrix_.coeffs().setZero();
  for (std::int32_t i = 0; i < pull_.size(); ++i) add(i, i, 1);
  for (const Derivatives& kind : kinds_) {
    for (const auto& row : kind.rows) {
      const double size = derivative(kind, row);
      const double weight = bending / std::sqrt(1 + bending * size * size);
      for (std::size_t i = 0; i < row.size() && kind.factors[i] != 0; ++i) {
        const double by_i = kind.factors[i] * sds_m_[row[i]] * weight;
        pull_[row[i]] -= by_i * size;
        for (std::size_t j = 0; j <= i; ++j)
          add(row[i], row[j], by_i * kind.factors[j] * sds_m_[row[j]]);
      }
    }
  }
}

// Returns the changes of heights, in sds.
Eigen::VectorXd Smoothing::solve(double curvature_sd_per_m) const {
  using Natural = Eigen::NaturalOrdering<int>;
  Eigen::ConjugateGradient<Matrix, Eigen::Lower,
                           Eigen::IncompleteCholesky<double, Eigen::Lower, Natural>>
      solver;
  solver.setTolerance(solved_share);
  solver.setMaxIterations(most_steps);
  const bool is_finite = pull_.allFinite() && matrix_.coeffs().isFinite().all();
  Eigen::VectorXd moves;
  if (is_finite) {
    solver.compute(matrix_);
    if (solver.info() == Eigen::Success) moves = solver.solve(pull_);
  }
  if (!is_finite || solver.info() != Eigen::Success || !moves.allFinite())
    throw Error(
        "smoothing a DEM: the equations of {} heights with standard deviations from {:.3g} to "
        "{:.3g} m and curvature_sd_per_m = {:.3g} could not be solved: curvature_sd_per_m is too "
        "small, or a variance or height is wrong",
        pull_.size(), sds_m_.minCoeff(), sds_m_.maxCoeff(), curvature_sd_per_m);
  return moves;
}

SmoothHeights Smoothing::iterate(double curvature_sd_per_m, std::size_t most_rounds,
                                 const RunControl& work) {
  SmoothHeights result;
  result.curvature_sd_per_m = curvature_sd_per_m;
  find_pattern();
  for (; result.rounds < most_rounds && !samples_.empty(); ++result.rounds) {
    set_up(curvature_sd_per_m);
    if (pull_.cwiseAbs().maxCoeff() < still_sds) break;
    const Eigen::VectorXd moves_m = solve(curvature_sd_per_m).cwiseProduct(sds_m_);
    heights_m_ += moves_m;
    result.last_move_m = moves_m.cwiseAbs().maxCoeff();
    work.report(static_cast<double>(result.rounds + 1) / static_cast<double>(most_rounds));
  }
  result.heights_m.assign(numbers_.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < samples_.size(); ++i)
    result.heights_m[samples_[i]] =
        static_cast<float>(heights_m_[static_cast<Eigen::Index>(i)] + base_m_);
  return result;
}

}  // namespace

SmoothHeights smooth_dem(const GridFrame& frame, std::span<const float> heights_m,
                         std::span<const float> variance_m2, const SmoothOptions& options,
                         const RunControl& work) {
  check_smooth_inputs(frame, heights_m, variance_m2, options, work);
  Smoothing smoothing(frame, heights_m, variance_m2);
  const double k =
      options.curvature_sd_per_m ? *options.curvature_sd_per_m : smoothing.usual_curvature();
  return smoothing.iterate(k, options.most_rounds, work);
}

}  // namespace groundray
