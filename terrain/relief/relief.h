#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/cell.h"
#include "core/geometry/grid_frame.h"
#include "core/geometry/height_grid.h"
#include "core/image/image.h"
#include "terrain/lod/lattice.h"
#include "terrain/relief/fractal_field.h"
#include "terrain/trail/trail.h"

namespace groundray {

class Trails;

/// Relief from a displacement image: amplitude_m (value - middle), where value is the first
/// channel.
struct ImageRelief {
  ImageF image;              ///< columns and rows as in the DEM; (0, 0) is centred on sample (0, 0)
  double amplitude_m = 0.1;  ///< height per unit of pixel value
  double middle = 0.5;       ///< pixel value without displacement
  /// Width of one copy; its height follows from the pixels. Copies are stretched by at most a
  /// tenth, so that a whole number of them fits the period.
  double size_m = 5;
};

/// Relief finer than a DEM, added to its surface. Image and fractal add up.
struct ReliefSpec {
  double cell_m = 0.05;  ///< largest size of a fine cell
  double period_m = 50;  ///< smallest distance after which the relief repeats
  std::optional<ImageRelief> image;
  std::optional<FractalSpec> fractal;
  std::vector<TrailSpec> trails;  ///< in W, each over those before it
};

/// Relief on the fine lattice of a DEM. Every cell of the DEM is divided into 2^exponent x
/// 2^exponent fine cells. The height of a fine sample is that of the DEM's surface there plus a
/// displacement that is periodic in both directions, both changed by trails. The fine samples,
/// rounded to float, define the reference surface (docs/reference/relief.md). Immutable; any number
/// of threads may use one.
class Relief {
 public:
  /// @param dem           grid of the DEM's samples.
  /// @param memory_bytes  limit for the construction of one period.
  /// @throws Error listing every field of `spec` that is out of bounds; if the period takes more
  ///         memory, or if the fine lattice has more than 2^26 cells on a side.
  Relief(const ReliefSpec& spec, const GridFrame& dem, std::size_t memory_bytes);

  /// Returns the relief with trails, or a copy if there are none.
  /// @param dem         heights of the DEM's surface.
  /// @param origin_w_m  position of D in W.
  /// @throws Error as Trail.
  std::shared_ptr<const Relief> with_trails(std::span<const TrailSpec> specs,
                                            const Trail::GroundHeight& dem,
                                            glm::dvec2 origin_w_m) const;

  /// Returns the grid of the fine samples in D.
  const GridFrame& frame() const noexcept { return frame_; }
  /// Returns the exponent: a cell of the DEM is 2^exponent fine cells wide and high.
  int exponent() const noexcept { return exponent_; }
  /// Returns the number of fine samples after which the displacement repeats: powers of two.
  glm::ivec2 period() const noexcept { return displacement_.size(); }
  /// Returns one period of the displacement, from fine sample (0, 0) on; metres.
  const HeightArray& displacement() const noexcept { return displacement_; }

  float displacement_m(glm::ivec2 sample) const noexcept {
    return displacement_(sample.x & (period().x - 1), sample.y & (period().y - 1));
  }

  /// Returns the height of a fine sample, metres; NaN in a hole, i.e. if any of the DEM's samples
  /// that the surface there depends on is missing.
  /// @param dem  cell of the DEM that contains the sample, possibly on its boundary.
  float height_m(const Cell& dem, glm::ivec2 sample) const noexcept;
  /// Returns the same without the trails.
  float height_without_trails_m(const Cell& dem, glm::ivec2 sample) const noexcept;
  /// Returns the height of a fine sample, from that of the DEM's surface there.
  float height_m(double dem_m, glm::ivec2 sample) const noexcept;

  /// Returns the trails, or null.
  const Trails* trails() const noexcept { return trails_.get(); }

  /// Returns the whole fine surface.
  HeightGrid refined(const HeightGrid& dem) const;

  /// Certified values of the displacement alone, as in NodeLevel, for nodes of 8 x 8 cells.
  struct Node {
    float key_m = 0, deviation_m = 0, full_m = 0, low_m = 0, high_m = 0;
  };
  /// Returns the values of a node of a level of the fine lattice. From the cells of the DEM on, and
  /// for nodes wider than the period, they are the same for all: the displacement's whole range.
  Node node(int level, glm::ivec2 node) const noexcept;
  /// Returns the largest key of a level.
  float max_key_m(int level) const noexcept;

  /// Returns an upper bound of what rounding its heights to float adds to the deviation of a node,
  /// metres.
  /// @param low_m, high_m  height range of the node.
  static double rounding_m(float low_m, float high_m) noexcept;

  /// Returns a hash that identifies the displacement.
  std::uint64_t fingerprint() const noexcept;

 private:
  void certify_period();
  double dem_height_m(const Cell& dem, glm::ivec2 sample) const noexcept;

  int exponent_ = 0;
  GridFrame frame_;
  HeightArray displacement_;
  Node whole_;                     // for nodes without values of their own
  std::vector<NodeLevel> levels_;  // levels whose nodes have values of their own
  std::shared_ptr<const Trails> trails_;
};

}  // namespace groundray
