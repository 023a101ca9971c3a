#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/model/model.h"
#include "core/random.h"

namespace groundray {

/// Kind of object that groundray generates.
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
  SphereTarget,
  Spruce,
  Pine,
  Birch,
  Oak,
  Bush,
  Snag,
  Fern,
  Reed,
  GrassPatch,
  FallenLog,
  Stump,
  Person,
  Deer,
  Pickup,
  Ugv,
  Tractor,
  Fence,
  Sign,
  HayBale,
  Boulder
};

/// Form of the leaves of a shrub or tree: square cards with an image of a spray, for distant
/// plants, or a small mesh for each leaf or bundle of needles, on twigs that hold it.
enum class LeafModel : std::uint8_t { Cards, Geometry };

/// Specification of an asset. A member that is not set has the default of its kind
/// (docs/reference/assets.md). A member that the kind does not have must not be set.
struct AssetSpec {
  AssetKind kind = AssetKind::Rock;
  /// Largest extent of a rock or stone; height above the ground of a plant, post, person or board;
  /// span of a wire; length of a vehicle or log; diameter of a sphere.
  std::optional<double> size_m{};
  /// Diameter of a post, wire, person, log or stump; width of a board; side of a patch.
  std::optional<double> width_m{};
  /// Sag of a wire: depth of its lowest point below its ends; positive.
  std::optional<double> sag_m{};
  std::optional<double> per_m2{};           ///< blades or stems of a patch
  std::optional<double> square_m{};         ///< side of a board's squares; plain if not set
  std::optional<double> leaf_area_index{};  ///< of a healthy shrub or tree; see `FoliageArea`
  LeafModel leaves = LeafModel::Cards;      ///< of a shrub or tree; else as by default
  /// Fraction of the twigs of a tree that is alive, from 0 to 1. Multiplies the leaf area.
  std::optional<double> health{};
  Seed seed{};  ///< variant of a rock, stone or plant; else 0
  /// Number of triangles, as a multiple of the kind's usual number; 1 for vehicles and boards.
  double detail = 1;
};

/// Returns the names of all kinds, in the order of AssetKind: `rock`, `stone` and so on.
std::span<const std::string_view> asset_names();

/// Returns the name of a kind.
std::string_view asset_name(AssetKind kind);

/// Returns the kind with a name.
/// @throws Error with the list of all names if there is none.
AssetKind asset_kind(std::string_view name);

/// Checks a specification.
/// @throws Error listing every member of `spec` that is out of bounds or that its kind does not
///         have.
void check_asset(const AssetSpec& spec);

/// Generates an asset. Equal specifications give equal bytes.
/// @return the object in its frame O: x forward, z up, origin on the ground and centred below the
///         object. A wire's origin is midway between its ends. Rocks, plants and posts extend below
///         the ground, so that no gap appears on a slope. Leaves and blades are single-layer
///         sheets, visible from both sides; everything else is closed, in one or more pieces.
///         Surfaces have the names of built-in materials, except `white_paint` and `black_paint`.
/// @throws Error as check_asset.
/// @see docs/reference/assets.md: shapes, dimensions and their sources.
Model make_asset(const AssetSpec& spec);

/// Area of a model's leaves and blades, green or dry.
struct FoliageArea {
  double leaf_m2 = 0;   ///< one-sided area of leaves and blades, without parts cut out by alpha
  double crown_m2 = 0;  ///< area of the convex hull of leaves and blades, seen from above

  /// Returns the leaf area index, leaf_m2 / crown_m2; 0 without leaves.
  double index() const { return crown_m2 > 0 ? leaf_m2 / crown_m2 : 0; }
};

/// Returns the foliage area of all surfaces named `leaf`, `broad_leaf` or `dry_grass`. Assumes that
/// each image is mapped as a whole onto the triangles that use it.
FoliageArea foliage_area(const Model& model);

}  // namespace groundray
