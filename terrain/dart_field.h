#pragma once

// Private to scatter: where darts hit the plane, and which of them find room.

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <unordered_map>
#include <vector>

#include "core/random.h"

namespace groundray {

/// Darts that hit the plane at random: a Poisson process of `per_m2` darts on each square metre.
/// They come cell by cell of a square lattice, the cells independent of each other, so that each
/// dart is a function of seed, layer, cell and number.
struct DartLattice {
  Seed seed;
  std::uint32_t layer = 0;
  double side_m = 1;          ///< of a cell; at least min_distance_m
  double per_m2 = 0;          ///< at most 16 in a cell on average
  double min_distance_m = 0;  ///< between darts that stand
};

/// The darts of a cell are numbered in the order in which they come, from 0 up to less than this:
/// with at most 16 on average, a cell loses one in 10^17.
constexpr std::uint32_t max_darts = 64;

/// What random numbers of a dart are for.
enum class DartDraw : std::uint32_t { Dart, Plant };

/// Returns four independent numbers, uniform in the open interval (0, 1), of 32 bits each.
glm::dvec4 draw(const DartLattice& lattice, glm::ivec2 cell, std::uint32_t number,
                DartDraw what) noexcept;

/// A place where a plant may stand.
struct Dart {
  glm::ivec2 cell{0};
  std::uint32_t number = 0;   ///< in its cell
  glm::dvec2 at{0};           ///< in its cell, from 0 to 1
  double arrival_per_m2 = 0;  ///< how densely darts lie when it comes
  double chance = 0;          ///< uniform from 0 to 1
};

/// The darts of part of the plane, made as they are asked for. A dart stands if no dart that stands
/// came before it within the minimum distance. That says of every dart on the plane whether it
/// stands, whoever asks first: earlier darts depend on none that come later.
/// @see Hinrichsen, Feder, Jøssang, Geometry of random sequential adsorption (1986).
class DartField {
 public:
  /// @param first, size  the cells that will be asked for most.
  DartField(const DartLattice& lattice, glm::ivec2 first, glm::ivec2 size);

  /// Darts of a cell, in the order in which they come.
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
  std::vector<Run>
      near_;  // of the cells asked for most; those not asked for yet begin at the highest number
  std::unordered_map<std::uint64_t, Run> far_;
  std::vector<Dart> darts_;
  std::vector<State> states_;
};

}  // namespace groundray
