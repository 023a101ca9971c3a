#pragma once

#include <optional>

#include "core/geometry/line_field.h"
#include "core/random.h"

namespace groundray {

/// Blocks between the joints and beds of rock, each set back by itself.
struct BenchBlocks {
  double length_m = 2;  ///< along the line
  double height_m = 1;  ///< rounded so that a whole number of them makes a face
};

/// Benches of a bank: level steps between its faces, as in quarries, pits and road cuttings.
struct Benches {
  double height_m = 5;     ///< of each face
  double width_m = 3;      ///< of each bench
  double roughness_m = 0;  ///< largest setback of a face from its place, which varies along it
  std::optional<BenchBlocks> blocks{};  ///< without them, setbacks vary smoothly
};

/// Profile of the banks of a trail: the height by which cuttings rise and embankments fall beyond
/// its edge. Immutable; any number of threads may query it.
class BankProfile {
 public:
  /// @param slope    rise over run of the faces; positive.
  /// @param benches  with positive height and width, and a roughness of at most the width.
  /// @param variant  selects the setbacks.
  BankProfile(double slope, const std::optional<Benches>& benches, Seed variant)
      : slope_(slope), benches_(benches), variant_(variant), beds_(beds_of(benches)) {}

  /// Returns the height at a distance beyond the edge, beside a place of the line; metres.
  /// @param beyond_m  0 or more.
  /// @param to_end_m  arc length to the nearer end of the line, towards which setbacks fade.
  double rise_m(double beyond_m, const LinePlace& at, double to_end_m) const noexcept;
  /// Returns the distance beyond the edge from which on the height is at least `height_m`,
  /// everywhere along the line.
  double run_m(double height_m) const noexcept;

 private:
  static int beds_of(const std::optional<Benches>& benches) noexcept;
  double setback_m(double face, int bed, const LinePlace& at, double to_end_m) const noexcept;
  double block_noise(RandomKey key, double along_m) const noexcept;

  double slope_;
  std::optional<Benches> benches_;
  Seed variant_;
  int beds_;  ///< of a face; 1 without blocks
};

}  // namespace groundray
