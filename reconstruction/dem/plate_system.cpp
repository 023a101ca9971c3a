#include "reconstruction/dem/plate_system.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
using Solver = Eigen::SimplicialLDLT<Matrix, Eigen::Lower>;

constexpr int reach = 3;  // of the equations, in columns and rows
constexpr std::size_t side = 2 * reach + 1;

// Where a term of the sum reaches, from its first sample on, and how.
struct TermSample {
  int column, row;
  double factor;
};

// One of the kinds of terms: (sum of factor z)^2 weight.
struct Term {
  std::vector<TermSample> samples;
  double weight;
};

// Keeps neighbours together where nothing else does, too weak to be seen.
constexpr double least_link = 1e-12;

std::vector<Term> terms_of(glm::dvec2 step_m, const PlateForm& form) {
  const double a = std::abs(step_m.y / step_m.x);  // h^2 / dx^2
  const double bend = 1 - form.tension, pull = form.tension + least_link, turn = form.smoothness;
  std::vector<Term> terms{
      {{{0, 0, 1}, {1, 0, -2}, {2, 0, 1}}, bend * a * a},
      {{{0, 0, 1}, {0, 1, -2}, {0, 2, 1}}, bend / (a * a)},
      {{{0, 0, 1}, {1, 0, -1}, {0, 1, -1}, {1, 1, 1}}, 2 * bend},
      {{{0, 0, 1}, {1, 0, -1}}, pull * a},
      {{{0, 0, 1}, {0, 1, -1}}, pull / a},
      {{{0, 0, 1}, {1, 1, -1}}, least_link},
      {{{1, 0, 1}, {0, 1, -1}}, least_link},
      {{{0, 0, -1}, {1, 0, 3}, {2, 0, -3}, {3, 0, 1}}, turn * a * a * a},
      {{{0, 0, -1}, {0, 1, 3}, {0, 2, -3}, {0, 3, 1}}, turn / (a * a * a)},
      {{{0, 0, 1}, {1, 0, -2}, {2, 0, 1}, {0, 1, -1}, {1, 1, 2}, {2, 1, -1}}, 3 * turn * a},
      {{{0, 0, 1}, {0, 1, -2}, {0, 2, 1}, {1, 0, -1}, {1, 1, 2}, {1, 2, -1}}, 3 * turn / a}};
  std::erase_if(terms, [](const Term& term) { return term.weight == 0; });
  return terms;
}

// The equation of one sample: factors of the samples about it.
using Stencil = std::array<double, side * side>;

std::size_t stencil_place(int columns, int rows) {
  return static_cast<std::size_t>(rows + reach) * side + static_cast<std::size_t>(columns + reach);
}

class StencilMaker {
 public:
  StencilMaker(const PlateRaster& raster, const PlateForm& form)
      : raster_(raster), terms_(terms_of(raster.step_m, form)) {}

  Stencil at(int column, int row) const {
    Stencil stencil{};
    for (const Term& term : terms_) {
      for (const TermSample& self : term.samples)
        add(term, self, column - self.column, row - self.row, stencil);
    }
    return stencil;
  }

 private:
  bool is_there(int column, int row) const {
    if (column < 0 || row < 0 || column >= raster_.size.x || row >= raster_.size.y) return false;
    return raster_
               .numbers[static_cast<std::size_t>(row) * static_cast<std::size_t>(raster_.size.x) +
                        static_cast<std::size_t>(column)] != plate_absent;
  }

  // Adds the term whose first sample is (column, row).
  void add(const Term& term, const TermSample& self, int column, int row, Stencil& stencil) const {
    for (const TermSample& other : term.samples)
      if (!is_there(column + other.column, row + other.row)) return;
    for (const TermSample& other : term.samples)
      stencil[stencil_place(other.column - self.column, other.row - self.row)] +=
          term.weight * self.factor * other.factor;
  }

  const PlateRaster& raster_;
  std::vector<Term> terms_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> coupled_samples(glm::ivec2 size,
                                                        std::span<const std::uint8_t> is_wanted) {
  std::vector<std::uint8_t> is_open(is_wanted.begin(), is_wanted.end());
  std::vector<std::vector<std::uint32_t>> sets;
  for (std::uint32_t first = 0; first < is_open.size(); ++first) {
    if (is_open[first] == 0) continue;
    std::vector<std::uint32_t> set{first};
    is_open[first] = 0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      const int column = static_cast<int>(set[i]) % size.x, row = static_cast<int>(set[i]) / size.x;
      for (int down = -reach; down <= reach; ++down) {
        const int most = reach - std::abs(down);
        for (int across = -most; across <= most; ++across) {
          const int c = column + across, r = row + down;
          if (c < 0 || r < 0 || c >= size.x || r >= size.y) continue;
          const auto other = static_cast<std::uint32_t>(r * size.x + c);
          if (std::exchange(is_open[other], std::uint8_t{0}) != 0) set.push_back(other);
        }
      }
    }
    std::ranges::sort(set);
    sets.push_back(std::move(set));
  }
  return sets;
}

bool has_known_neighbour(glm::ivec2 size, std::span<const std::int32_t> numbers,
                         std::span<const std::uint32_t> set) {
  return std::ranges::any_of(set, [&](std::uint32_t sample) {
    const int column = static_cast<int>(sample) % size.x, row = static_cast<int>(sample) / size.x;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, size.y - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, size.x - 1); ++c) {
        const auto other = static_cast<std::size_t>(r) * static_cast<std::size_t>(size.x) +
                           static_cast<std::size_t>(c);
        if (numbers[other] == plate_known) return true;
      }
    }
    return false;
  });
}

// A z = b for one form, with the heights above a base.
struct PlateSystem::Equations {
  std::optional<PlateForm> form;
  double base_m = 0;
  Matrix matrix;  // lower triangle
  Eigen::VectorXd right;
  Solver solver;
  Eigen::Index analysed = -1;  // nonzeros of the matrix that the order of elimination is for

  void assemble(const PlateRaster& raster, std::span<const std::uint32_t> samples,
                const PlateForm& for_form);
  void factorise(const Matrix& of);
};

void PlateSystem::Equations::factorise(const Matrix& of) {
  if (std::exchange(analysed, of.nonZeros()) != of.nonZeros()) solver.analyzePattern(of);
  solver.factorize(of);
  if (solver.info() != Eigen::Success)
    throw Error("a hole of {} samples has no surface: its equations have no solution", of.cols());
}

void PlateSystem::Equations::assemble(const PlateRaster& raster,
                                      std::span<const std::uint32_t> samples,
                                      const PlateForm& for_form) {
  if (form == for_form) return;
  form = for_form;
  const auto count = static_cast<Eigen::Index>(samples.size());
  matrix.resize(count, count);
  matrix.reserve(count * (side * side / 4 + 1));
  right.setZero(count);
  const StencilMaker maker(raster, for_form);
  std::vector<std::pair<double, double>> known;  // factors and heights, of one equation
  base_m = std::nan("");
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<int>(samples[static_cast<std::size_t>(i)]);
    const int column = at % raster.size.x, row = at / raster.size.x;
    const Stencil stencil = maker.at(column, row);
    matrix.startVec(i);
    for (int down = -reach; down <= reach; ++down) {
      for (int across = -reach; across <= reach; ++across) {
        const double factor = stencil[stencil_place(across, down)];
        if (factor == 0) continue;
        const auto other =
            static_cast<std::size_t>(at + std::ptrdiff_t{down} * raster.size.x + across);
        const std::int32_t number = raster.numbers[other];
        if (number == plate_known) {
          const double height_m = raster.heights_m[other];
          if (std::isnan(base_m)) base_m = height_m;
          right[i] -= factor * (height_m - base_m);
        } else if (number >= i) {
          matrix.insertBack(number, i) = factor;
        }
      }
    }
  }
  matrix.finalize();
}

PlateSystem::PlateSystem(const PlateRaster& raster, std::vector<std::uint32_t> samples)
    : raster_(raster), samples_(std::move(samples)), equations_(std::make_unique<Equations>()) {}

PlateSystem::~PlateSystem() = default;

std::vector<double> PlateSystem::solve(const PlateForm& form) {
  equations_->assemble(raster_, samples_, form);
  equations_->factorise(equations_->matrix);
  const Eigen::VectorXd above_m = equations_->solver.solve(equations_->right);
  std::vector<double> heights_m(samples_.size());
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    heights_m[i] = above_m[static_cast<Eigen::Index>(i)] + equations_->base_m;
  return heights_m;
}

namespace {

constexpr int most_rounds = 60;     // of the active set
constexpr int rounds_of_both = 25;  // after which samples only join it, so that it ends

// The matrix with the samples at their bounds taken out, each left to an equation of its own.
Matrix without(const Matrix& matrix, const std::vector<std::uint8_t>& is_held) {
  Matrix rest(matrix);
  double* const factors = rest.valuePtr();
  for (int column = 0; column < rest.outerSize(); ++column) {
    for (int k = rest.outerIndexPtr()[column]; k < rest.outerIndexPtr()[column + 1]; ++k) {
      const int row = rest.innerIndexPtr()[k];
      if (is_held[static_cast<std::size_t>(row)] != 0 ||
          is_held[static_cast<std::size_t>(column)] != 0)
        factors[k] = row == column ? 1 : 0;
    }
  }
  return rest;
}

// Which samples are at their bounds.
class Held {
 public:
  Held(std::span<const double> most_m, double base_m)
      : most_m_(Eigen::Map<const Eigen::VectorXd>(most_m.data(), std::ssize(most_m)).array() -
                base_m),
        is_held_(most_m.size()) {}

  const std::vector<std::uint8_t>& flags() const { return is_held_; }

  // Takes in those above their bounds and lets go, if it may, those that would fall. How many
  // changed.
  std::size_t update(const Eigen::VectorXd& z, const Eigen::VectorXd& push, bool may_let_go) {
    std::size_t changed = 0;
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      std::uint8_t& is_held = is_held_[static_cast<std::size_t>(i)];
      const bool stays = is_held != 0 && (push[i] > 0 || !may_let_go);
      const std::uint8_t shall = stays || z[i] > most_m_[i] ? 1 : 0;
      if (std::exchange(is_held, shall) != shall) ++changed;
    }
    return changed;
  }

  // The vector with the bounds in the places of those held.
  Eigen::VectorXd put_bounds(Eigen::VectorXd values) const {
    for (Eigen::Index i = 0; i < values.size(); ++i)
      if (is_held_[static_cast<std::size_t>(i)] != 0) values[i] = most_m_[i];
    return values;
  }

 private:
  Eigen::VectorXd most_m_;  // above the base; NaN for none
  std::vector<std::uint8_t> is_held_;
};

// A z for a symmetric matrix of which the lower triangle is stored.
Eigen::VectorXd times(const Matrix& lower, const Eigen::VectorXd& z) {
  return lower.selfadjointView<Eigen::Lower>() * z;
}

}  // namespace

BoundedPlate PlateSystem::solve_below(const PlateForm& form, std::span<const double> start,
                                      std::span<const double> most_m) {
  equations_->assemble(raster_, samples_, form);
  const Matrix& matrix = equations_->matrix;
  const auto count = static_cast<Eigen::Index>(samples_.size());
  Held held(most_m, equations_->base_m);
  Eigen::VectorXd z =
      Eigen::Map<const Eigen::VectorXd>(start.data(), count).array() - equations_->base_m;
  Eigen::VectorXd push = Eigen::VectorXd::Zero(count);  // of the bounds, downwards
  BoundedPlate result;
  for (int round = 0; round < most_rounds; ++round) {
    const std::size_t changed = held.update(z, push, round < rounds_of_both);
    result.is_best = changed == 0 && round <= rounds_of_both;
    if (changed == 0) break;
    Eigen::VectorXd rest =
        equations_->right - times(matrix, held.put_bounds(Eigen::VectorXd::Zero(count)));
    equations_->factorise(without(matrix, held.flags()));
    z = equations_->solver.solve(held.put_bounds(std::move(rest)));
    push = equations_->right - times(matrix, z);
  }
  result.at_bound = static_cast<std::size_t>(std::ranges::count(held.flags(), 1));
  for (Eigen::Index i = 0; i < count; ++i) {
    const double bound_m = most_m[static_cast<std::size_t>(i)];
    const double height_m = z[i] + equations_->base_m;
    result.heights_m.push_back(height_m > bound_m ? bound_m : height_m);
  }
  return result;
}

}  // namespace groundray
