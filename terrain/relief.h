#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "core/cell.h"
#include "core/grid_frame.h"
#include "core/height_grid.h"
#include "core/image.h"
#include "terrain/fractal_field.h"
#include "terrain/node_level.h"

namespace groundray {

/// Relief from a displacement texture: amplitude_m (value - middle), value the first channel.
struct ImageRelief {
  ImageF image;  ///< its columns and rows run as the DEM's; (0, 0) is centred on sample (0, 0)
  double amplitude_m = 0.1;  ///< height of a difference of 1 between pixels
  double middle = 0.5;       ///< what leaves the ground where it is
  /// Width of one copy; its height follows from the pixels. Copies are stretched, by a tenth at
  /// most, so that a whole number of them fits the period.
  double size_m = 5;
};

/// Relief finer than a DEM: what is added to its surface. Image and fractal add up.
struct ReliefSpec {
  double cell_m = 0.05;  ///< the surface gets cells of this size or, a power of two, finer
  double period_m = 50;  ///< the relief repeats itself, no sooner than this
  std::optional<ImageRelief> image;
  std::optional<FractalSpec> fractal;
};

/// Relief on the fine lattice of a DEM: every cell of the DEM is cut into 2^exponent x 2^exponent,
/// and a fine sample is as high as the DEM's surface there plus a displacement that is periodic in
/// both directions. The fine samples, rounded to float, are the reference surface (docs/relief.md).
/// Immutable; any number of threads may use one.
class Relief {
 public:
  /// @param dem           where the DEM's samples stand.
  /// @param memory_bytes  what making one period may take.
  /// @throws Error listing every field of `spec` that is out of bounds; if the period takes more
  ///         memory, or the fine lattice more than 2^26 cells on a side.
  Relief(const ReliefSpec& spec, const GridFrame& dem, std::size_t memory_bytes);

  /// Where the fine samples stand in D.
  const GridFrame& frame() const noexcept { return frame_; }
  /// A cell of the DEM is 2^exponent fine cells wide and high.
  int exponent() const noexcept { return exponent_; }
  /// Fine samples after which the displacement repeats: powers of two.
  glm::ivec2 period() const noexcept { return displacement_.size(); }
  /// One period of it, from fine sample (0, 0) on; metres.
  const HeightArray& displacement() const noexcept { return displacement_; }

  float displacement_m(glm::ivec2 sample) const noexcept {
    return displacement_(sample.x & (period().x - 1), sample.y & (period().y - 1));
  }

  /// Returns the height of a fine sample, metres; NaN if it lies in a hole: if one of the DEM's
  /// samples that the surface there depends on is missing.
  /// @param dem  cell of the DEM that the sample lies in or on the border of.
  float height_m(const Cell& dem, glm::ivec2 sample) const noexcept;

  /// Returns the whole fine surface.
  HeightGrid refined(const HeightGrid& dem) const;

  /// What is certified of the displacement alone, as in NodeLevel, for nodes of 8 x 8 cells.
  struct Node {
    float key_m = 0, deviation_m = 0, full_m = 0, low_m = 0, high_m = 0;
  };
  /// Returns that of a node of a level of the fine lattice. From the cells of the DEM on, and for
  /// nodes wider than the period, it is the same for all: the displacement's whole span.
  Node node(int level, glm::ivec2 node) const noexcept;
  /// The largest key of a level.
  float max_key_m(int level) const noexcept;

  /// Bounds what rounding its heights to float adds to the deviation of a node, metres.
  /// @param low_m, high_m  of the node.
  static double rounding_m(float low_m, float high_m) noexcept;

  /// Stands for all that it adds.
  std::uint64_t fingerprint() const noexcept;

 private:
  void certify_period();

  int exponent_ = 0;
  GridFrame frame_;
  HeightArray displacement_;
  Node whole_;                     // of nodes without values of their own
  std::vector<NodeLevel> levels_;  // those with values of their own
};

}  // namespace groundray
