#include "reconstruction/dem/thin_plate/thin_plate_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>

#include "reconstruction/dem/thin_plate/bounded_solver.h"
#include "reconstruction/dem/thin_plate/ldlt.h"

namespace groundray {
namespace {

constexpr int stencil_reach = 3;  // reach of the equations, in columns and rows
constexpr std::size_t stencil_side = 2 * stencil_reach + 1;

// Sample of an energy term, relative to the term's first sample, and its factor.
struct TermSample {
  int column, row;
  double factor;
};

// Kind of energy terms: (sum of factor z)^2 weight.
struct Term {
  std::vector<TermSample> samples;
  double weight;
};

// Weight of links that couple neighbours where nothing else does, too weak to have a visible
// effect.
constexpr double least_link = 1e-12;

std::vector<Term> thin_plate_terms(glm::dvec2 step_m, const ThinPlateEnergy& form) {
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

int reach_of(const ThinPlateEnergy& form) {
  return form.smoothness > 0 ? stencil_reach : stencil_reach - 1;
}

// Equation of one sample: factors of the samples around it.
using Stencil = std::array<double, stencil_side * stencil_side>;

std::size_t stencil_place(int columns, int rows) {
  return static_cast<std::size_t>(rows + stencil_reach) * stencil_side +
         static_cast<std::size_t>(columns + stencil_reach);
}

struct EquationEntry {
  std::size_t sample = 0;  // index in the raster
  double factor = 0;
};

class EquationMaker {
 public:
  EquationMaker(const ThinPlateRaster& raster, const ThinPlateEnergy& form, int wide)
      : raster_(raster), terms_(thin_plate_terms(raster.step_m, form)), wide_(wide) {
    entries_.reserve(stencil_side * stencil_side);
    for (const Term& term : terms_)
      for (const TermSample& self : term.samples) add(term, self, whole_);
  }

  // Returns the equation of a sample; valid until the next call.
  const std::vector<EquationEntry>& at(glm::ivec2 place) {
    if (!take(whole_, place)) {
      Stencil stencil{};
      for (const Term& term : terms_) {
        for (const TermSample& self : term.samples)
          if (is_whole(term, place - glm::ivec2(self.column, self.row))) add(term, self, stencil);
      }
      take(stencil, place);
    }
    return entries_;
  }

 private:
  // Returns the number of a sample; absent_sample beyond the edge.
  std::int32_t number_at(glm::ivec2 place) const {
    return raster_.contains(place) ? raster_.numbers[raster_.index(place)] : absent_sample;
  }

  bool is_whole(const Term& term, glm::ivec2 first) const {
    return std::ranges::all_of(term.samples, [&](const TermSample& sample) {
      return number_at(first + glm::ivec2(sample.column, sample.row)) != absent_sample;
    });
  }

  static void add(const Term& term, const TermSample& self, Stencil& stencil) {
    for (const TermSample& other : term.samples)
      stencil[stencil_place(other.column - self.column, other.row - self.row)] +=
          term.weight * self.factor * other.factor;
  }

  // Converts a stencil to the equation of a sample. Returns whether all samples within reach exist.
  bool take(const Stencil& stencil, glm::ivec2 place) {
    entries_.clear();
    bool is_whole = true;
    for (int down = -wide_; down <= wide_; ++down) {
      const int most = wide_ - std::abs(down);
      for (int across = -most; across <= most; ++across) {
        const glm::ivec2 other = place + glm::ivec2(across, down);
        const double factor = stencil[stencil_place(across, down)];
        if (number_at(other) == absent_sample) {
          is_whole = false;
        } else if (factor != 0) {
          entries_.push_back({raster_.index(other), factor});
        }
      }
    }
    return is_whole;
  }

  const ThinPlateRaster& raster_;
  std::vector<Term> terms_;
  int wide_;
  Stencil whole_{};
  std::vector<EquationEntry> entries_;
};

}  // namespace

namespace {

// Returns the sets of samples that are connected through neighbours at most `widths[k]` columns
// away in rows k above and below; ascending, in the order of their first samples.
std::vector<std::vector<std::uint32_t>> connected_samples(glm::ivec2 size,
                                                          std::span<const std::uint8_t> is_wanted,
                                                          std::span<const int> widths) {
  const int reach = static_cast<int>(widths.size()) - 1;
  std::vector<std::uint8_t> is_open(is_wanted.begin(), is_wanted.end());
  std::vector<std::vector<std::uint32_t>> sets;
  for (std::uint32_t first = 0; first < is_open.size(); ++first) {
    if (std::exchange(is_open[first], std::uint8_t{0}) == 0) continue;
    std::vector<std::uint32_t> set{first};
    for (std::size_t i = 0; i < set.size(); ++i) {
      const int column = static_cast<int>(set[i]) % size.x, row = static_cast<int>(set[i]) / size.x;
      for (int r = std::max(row - reach, 0); r <= std::min(row + reach, size.y - 1); ++r) {
        const int width = widths[static_cast<std::size_t>(std::abs(r - row))];
        for (int c = std::max(column - width, 0); c <= std::min(column + width, size.x - 1); ++c) {
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

}  // namespace

std::vector<std::vector<std::uint32_t>> linked_samples(glm::ivec2 size,
                                                       std::span<const std::uint8_t> is_wanted) {
  return connected_samples(size, is_wanted, std::array{1, 1});
}

std::vector<std::vector<std::uint32_t>> coupled_samples(glm::ivec2 size,
                                                        std::span<const std::uint8_t> is_wanted) {
  static_assert(stencil_reach == 3);
  return connected_samples(size, is_wanted, std::array{3, 2, 1, 0});
}

bool has_known_neighbour(glm::ivec2 size, std::span<const std::int32_t> numbers,
                         std::span<const std::uint32_t> set) {
  return std::ranges::any_of(set, [&](std::uint32_t sample) {
    const int column = static_cast<int>(sample) % size.x, row = static_cast<int>(sample) / size.x;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, size.y - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, size.x - 1); ++c) {
        const auto other = static_cast<std::size_t>(r) * static_cast<std::size_t>(size.x) +
                           static_cast<std::size_t>(c);
        if (numbers[other] == known_sample) return true;
      }
    }
    return false;
  });
}

// Equations A z = b for one form, with heights above a base.
struct ThinPlateSystem::Equations {
  std::optional<ThinPlateEnergy> form;
  double base_m = std::numeric_limits<double>::quiet_NaN();  // the first known height encountered
  ThinPlateMatrix matrix;
  std::vector<double> right;
  std::vector<glm::ivec2> places;  // columns and rows of the samples
  std::array<std::optional<Dissection>, stencil_reach + 1> orders;  // by the reach of the equations
  std::vector<double> below;  // latest heights under bounds, above the base

  void assemble(const ThinPlateRaster& raster, std::span<const std::uint32_t> samples,
                const ThinPlateEnergy& for_form);
  const Dissection& order();
};

const Dissection& ThinPlateSystem::Equations::order() {
  const int wide = reach_of(*form);
  auto& order = orders[static_cast<std::size_t>(wide)];
  if (!order) order = dissect(places, wide);
  return *order;
}

void ThinPlateSystem::Equations::assemble(const ThinPlateRaster& raster,
                                          std::span<const std::uint32_t> samples,
                                          const ThinPlateEnergy& for_form) {
  if (form == for_form) return;
  form = for_form;
  matrix.ends.clear();
  matrix.samples.clear();
  matrix.factors.clear();
  right.assign(samples.size(), 0);
  EquationMaker maker(raster, for_form, reach_of(for_form));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (const EquationEntry& entry : maker.at(places[i])) {
      const std::int32_t number = raster.numbers[entry.sample];
      if (number == known_sample) {
        const double height_m = raster.heights_m[entry.sample];
        if (std::isnan(base_m)) base_m = height_m;
        right[i] -= entry.factor * (height_m - base_m);
      } else {
        matrix.samples.push_back(number);
        matrix.factors.push_back(entry.factor);
      }
    }
    matrix.ends.push_back(matrix.samples.size());
  }
}

ThinPlateSystem::ThinPlateSystem(const ThinPlateRaster& raster, std::vector<std::uint32_t> samples)
    : raster_(raster), samples_(std::move(samples)), equations_(std::make_unique<Equations>()) {
  for (const std::uint32_t sample : samples_) equations_->places.push_back(raster_.place(sample));
}

ThinPlateSystem::~ThinPlateSystem() = default;

std::vector<double> ThinPlateSystem::solve(const ThinPlateEnergy& form) {
  equations_->assemble(raster_, samples_, form);
  LdltFactor factor(equations_->matrix, equations_->order(), FactorUse::Once);
  factor.factorise(std::vector<std::uint8_t>(samples_.size()));
  std::vector<double> heights_m = factor.solve(equations_->right);
  for (double& height_m : heights_m) height_m += equations_->base_m;
  return heights_m;
}

BoundedThinPlate ThinPlateSystem::solve_below(const ThinPlateEnergy& form,
                                              std::span<const double> most_m) {
  Equations& equations = *equations_;
  equations.assemble(raster_, samples_, form);
  std::vector<double> most(most_m.begin(), most_m.end());  // bounds above the base
  for (double& bound : most)
    bound = std::isnan(bound) ? std::numeric_limits<double>::infinity() : bound - equations.base_m;
  BoundedSolver descent(equations.matrix, equations.order(), equations.right, most);
  BoundedThinPlate result;
  result.is_best = descent.run(equations.below);
  equations.below = descent.heights();
  result.heights_m = descent.heights();
  for (std::size_t i = 0; i < most.size(); ++i) {
    double& height_m = result.heights_m[i];
    if (height_m >= most[i]) ++result.at_bound;
    height_m = height_m >= most[i] ? most_m[i] : height_m + equations.base_m;
  }
  return result;
}

}  // namespace groundray
