#pragma once

// Private to scatter: positions of darts, and which of them are accepted.

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <unordered_map>
#include <vector>

#include "core/random.h"

namespace groundray {

/// Poisson process of darts on the plane, `per_m2` per square metre. Darts are generated cell by
/// cell of a square lattice, independently for each cell, so that each dart is a function of seed,
/// layer, cell and number.
struct DartLattice {
  Seed seed;
  std::uint32_t layer = 0;
  double side_m = 1;          ///< side of a cell; at least min_distance_m
  double per_m2 = 0;          ///< at most 16 per cell on average
  double min_distance_m = 0;  ///< between accepted darts
};

/// Upper bound of the number of darts in a cell; they are numbered from 0 in order of arrival. At a
/// mean of at most 16 per cell, less than one dart in 10^17 is lost.
constexpr std::uint32_t max_darts = 64;

/// Purpose of a dart's random numbers.
enum class DartDraw : std::uint32_t { Dart, Plant };

/// Returns four independent random numbers, uniform in the open interval (0, 1), of 32 bits each.
glm::dvec4 draw(const DartLattice& lattice, glm::ivec2 cell, std::uint32_t number,
                DartDraw what) noexcept;

/// Candidate position of a plant.
struct Dart {
  glm::ivec2 cell{0};
  std::uint32_t number = 0;   ///< number in its cell
  glm::dvec2 at{0};           ///< position in its cell, from 0 to 1
  double arrival_per_m2 = 0;  ///< time of arrival: density of all darts up to then
  double chance = 0;          ///< uniform from 0 to 1
};

/// Darts of part of the plane, generated on demand. A dart is accepted unless an accepted dart
/// arrived before it within the minimum distance. Because earlier darts never depend on later ones,
/// this determines for every dart on the plane whether it is accepted, whatever the order of
/// queries.
/// @see Hinrichsen, Feder, Jøssang, Geometry of random sequential adsorption (1986).
class DartField {
 public:
  /// @param first, size  cells that are queried most.
  DartField(const DartLattice& lattice, glm::ivec2 first, glm::ivec2 size);

  /// Indices of the darts of a cell, in order of arrival.
  struct Run {
    std::size_t begin = 0, end = 0;
  };
  Run in_cell(glm::ivec2 cell);
  const Dart& dart(std::size_t index) const noexcept { return darts_[index]; }
  bool stands(std::size_t index);

 private:
  enum class State : std::uint8_t { Unknown, Stands, Falls };
  Run throw_into(glm::ivec2 cell);
  bool is_free(const Dart& dart);
  bool is_blocked_from(glm::ivec2 cell, const Dart& dart, double reach);

  DartLattice lattice_;
  glm::ivec2 first_, size_;
  // Runs of the cells first_ to first_ + size_; `begin` is the highest number until a cell is
  // queried.
  std::vector<Run> near_;
  std::unordered_map<std::uint64_t, Run> far_;
  std::vector<Dart> darts_;
  std::vector<State> states_;
};

/// Kinetics of random sequential adsorption of equal discs on a plane. Darts hit the plane at
/// random, one after another. Each dart places a disc where it hits, unless the disc would overlap
/// one placed earlier. Amounts are areas per unit area of the plane: `coverage` is the fraction of
/// the plane under discs, the thrown amount the area of the discs of all darts, accepted or not.
/// @see Schaaf, Talbot, Surface exclusion effects in adsorption processes (1989), equation 31.

/// Largest supported coverage. From 0.547 on, no dart is accepted.
constexpr double max_adsorption_coverage = 0.45;

/// Returns the probability that a dart is accepted.
/// @param coverage  0 to max_adsorption_coverage.
double free_share(double coverage) noexcept;

/// Returns the amount to throw that yields a coverage. The coverage actually reached differs from
/// the requested one by at most 2e-4 of it.
/// @param coverage  0 to max_adsorption_coverage.
double thrown_for(double coverage) noexcept;

}  // namespace groundray
