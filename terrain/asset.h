#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/model.h"
#include "core/random.h"

namespace groundray {

/// The objects that groundray makes itself.
enum class AssetKind : std::uint8_t {
  Rock,
  Stone,
  GrassTuft,
  Shrub,
  Conifer,
  BroadleafTree,
  FencePost,
  Wire,
  Vehicle,
  PersonCylinder,
  CalibrationBoard,
  SphereTarget
};

/// What to make. A member that is not set is the kind's own, told in docs/assets.md; one that the
/// kind does not have must not be set.
struct AssetSpec {
  AssetKind kind = AssetKind::Rock;
  /// Greatest extent of a rock or stone; height over the ground of a plant, post, person or board;
  /// span of a wire; length of a vehicle; diameter of a sphere.
  std::optional<double> size_m{};
  /// Diameter of a post, a wire or a person; width of a board.
  std::optional<double> width_m{};
  std::optional<double> sag_m{};     ///< of a wire: its lowest point under its ends; positive
  std::optional<double> square_m{};  ///< side of a board's squares; a board without is plain
  std::optional<double> leaf_area_index{};  ///< of a shrub or tree; see `FoliageArea`
  Seed seed{};  ///< which of the variants of a rock, stone or plant; else 0
  double detail =
      1;  ///< number of triangles, as a multiple of the usual; 1 for vehicles and boards
};

/// Returns the names of all kinds, in their order: `rock`, `grass_tuft` and so on.
std::span<const std::string_view> asset_names();

/// Returns a kind's name.
std::string_view asset_name(AssetKind kind);

/// Returns the kind of a name.
/// @throws Error if there is none, with the names that there are.
AssetKind asset_kind(std::string_view name);

/// @throws Error listing every member of `spec` that is out of bounds or not of its kind.
void check_asset(const AssetSpec& spec);

/// Makes an object. Equal specs give equal bytes with the same build and C library.
/// @return the object in O: x forward, z up, the origin on the ground that it stands on, in the
///         middle; a wire's origin lies in the middle between its ends. Rocks, plants and posts
///         reach below the ground, so that no gap shows on a slope. Leaves and blades are sheets of
///         one layer, to be seen from both sides; all else is closed, of one piece or several.
///         Surfaces have the names of built-in materials, but `white_paint` and `black_paint`.
/// @throws Error as check_asset.
/// @see docs/assets.md: shapes, dimensions and their sources.
Model make_asset(const AssetSpec& spec);

/// What is green, or was.
struct FoliageArea {
  double leaf_m2 = 0;   ///< of leaves and blades, one side of each, what alpha cuts off left out
  double crown_m2 = 0;  ///< of the convex hull of leaves and blades as seen from above

  /// Area of leaves over area of crown; 0 without leaves.
  double index() const { return crown_m2 > 0 ? leaf_m2 / crown_m2 : 0; }
};

/// Returns how much leaf there is: all surfaces named `leaf`, `broad_leaf` or `dry_grass`, whose
/// images are taken to lie whole on what wears them.
FoliageArea foliage_area(const Model& model);

}  // namespace groundray
