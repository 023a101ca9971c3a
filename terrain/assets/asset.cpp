#include "terrain/assets/asset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/geometric.hpp>
#include <vector>

#include "core/error.h"
#include "core/near_names.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_defaults.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

constexpr std::array<std::string_view, 32> names = {"rock",
                                                    "stone",
                                                    "grass_tuft",
                                                    "shrub",
                                                    "conifer",
                                                    "broadleaf_tree",
                                                    "fence_post",
                                                    "wire",
                                                    "vehicle",
                                                    "person_cylinder",
                                                    "calibration_board",
                                                    "sphere_target",
                                                    "spruce",
                                                    "pine",
                                                    "birch",
                                                    "oak",
                                                    "bush",
                                                    "snag",
                                                    "fern",
                                                    "reed",
                                                    "grass_patch",
                                                    "fallen_log",
                                                    "stump",
                                                    "person",
                                                    "deer",
                                                    "pickup",
                                                    "ugv",
                                                    "tractor",
                                                    "fence",
                                                    "sign",
                                                    "hay_bale",
                                                    "boulder"};

// Generator of a kind, and the members that the kind has, with their default values; 0 for those
// that it does not have.
struct KindRule {
  Model (*make)(AssetShape shape);
  std::string_view size_is;
  double size_m = 0;
  double width_m = 0;
  double sag_m = 0;
  double per_m2 = 0;
  double leaf_area_index = 0;
  bool has_squares = false;
  bool has_variants = false;
  bool has_detail = true;
  bool has_health = false;
};

constexpr KindRule tree(Model (*make)(AssetShape), double size_m, double leaf_area_index) {
  return {.make = make,
          .size_is = "height",
          .size_m = size_m,
          .leaf_area_index = leaf_area_index,
          .has_variants = true,
          .has_health = true};
}

// A wire is aluminium 1/0 AWG (105.6 kcmil): six strands around one of steel, so three strands
// across. A fence post follows USDA NRCS Mississippi, standard 382 (2000): 6 feet, of which 18
// inches are buried. Leaf area indices: Asner et al. (2003), mean of all biomes 4.5 +- 2.5 without
// outliers, temperate evergreen forests from 5.1.
constexpr std::array<KindRule, names.size()> rules = {{
    {.make = make_rock, .size_is = "largest extent", .size_m = 0.8, .has_variants = true},
    {.make = make_stone, .size_is = "largest extent", .size_m = 0.15, .has_variants = true},
    {.make = make_grass_tuft, .size_is = "height", .size_m = 0.35, .has_variants = true},
    {.make = make_shrub,
     .size_is = "height",
     .size_m = 1.2,
     .leaf_area_index = 3,
     .has_variants = true,
     .has_health = true},
    {.make = make_conifer,
     .size_is = "height",
     .size_m = 12,
     .leaf_area_index = 5.1,
     .has_variants = true},
    {.make = make_broadleaf_tree,
     .size_is = "height",
     .size_m = 9,
     .leaf_area_index = 4.5,
     .has_variants = true,
     .has_health = true},
    {.make = make_fence_post, .size_is = "height", .size_m = 1.37, .width_m = 0.1},
    {.make = make_wire, .size_is = "span", .size_m = 50, .width_m = 0.0101, .sag_m = 1},
    {.make = make_vehicle, .size_is = "length", .size_m = 5.265, .has_detail = false},
    {.make = make_person_cylinder, .size_is = "height", .size_m = 1.75, .width_m = 0.5},
    {.make = make_calibration_board,
     .size_is = "height",
     .size_m = 0.8,
     .width_m = 0.6,
     .has_squares = true,
     .has_detail = false},
    {.make = make_sphere_target, .size_is = "diameter", .size_m = 0.145},
    tree(make_spruce, 12, 5.1),
    tree(make_pine, 12, 2.5),
    tree(make_birch, 10, 3.5),
    tree(make_oak, 10, 4.5),
    tree(make_bush, 2, 3),
    {.make = make_snag, .size_is = "height", .size_m = 7, .has_variants = true},
    {.make = make_fern, .size_is = "height", .size_m = 0.7, .has_variants = true},
    {.make = make_reed,
     .size_is = "height",
     .size_m = 2.2,
     .width_m = 1,
     .per_m2 = 60,
     .has_variants = true},
    {.make = make_grass_patch,
     .size_is = "height",
     .size_m = 0.4,
     .width_m = 1,
     .per_m2 = 1500,
     .has_variants = true},
    {.make = make_fallen_log,
     .size_is = "length",
     .size_m = 4,
     .width_m = 0.3,
     .has_variants = true},
    {.make = make_stump, .size_is = "height", .size_m = 0.5, .width_m = 0.4, .has_variants = true},
    {.make = make_person,
     .size_is = "height",
     .size_m = 1.75,
     .has_variants = true,
     .has_detail = false},
    {.make = make_deer,
     .size_is = "height of the withers",
     .size_m = 1.14,
     .has_variants = true,
     .has_detail = false},
    {.make = make_pickup, .size_is = "length", .size_m = 5.265, .has_variants = true},
    {.make = make_ugv, .size_is = "length", .size_m = 0.9874},
    {.make = make_tractor, .size_is = "length", .size_m = 4.47, .has_variants = true},
    {.make = make_straight_fence,
     .size_is = "length",
     .size_m = 25.6,
     .width_m = 4.267,
     .has_variants = true},
    {.make = make_sign,
     .size_is = "height",
     .size_m = 2.6,
     .width_m = 0.762,
     .has_variants = true,
     .has_detail = false},
    {.make = make_hay_bale,
     .size_is = "diameter",
     .size_m = 1.524,
     .width_m = 1.219,
     .has_variants = true},
    {.make = make_boulder, .size_is = "largest extent", .size_m = 1.5, .has_variants = true},
}};

// Surfaces without a measured spectrum, and the width of the facets of their clear coat, if they
// have one. Cloth is of plant fibres, as litter is; fur is brown, too.
struct StandIn {
  std::string_view surface, material;
  double coat_alpha = 0;
};
constexpr std::array<StandIn, 17> stand_ins = {{{"jacket", "litter"},
                                                {"trousers", "litter"},
                                                {"shoes", "char"},
                                                {"skin", "dry_soil"},
                                                {"hair", "char"},
                                                {"fur", "litter"},
                                                {"hoof", "char"},
                                                {"paint", "metal", 0.06},
                                                {"glass", "char", 0.02},
                                                {"trim", "char", 0.4},
                                                {"tyre", "char"},
                                                {"rim", "metal", 0.2},
                                                {"lamp", "metal", 0.03},
                                                {"tail_lamp", "metal", 0.03},
                                                {"hay", "dry_grass"},
                                                {"sign_face", "metal", 0.15},
                                                {"sign_legend", "metal", 0.15}}};

const KindRule& rule_of(AssetKind kind) { return rules[static_cast<std::size_t>(kind)]; }

// Checks that a member is set only if the kind has it, and that it is then within bounds.
void check_member(Violations& broken, const AssetSpec& spec, std::string_view name,
                  const std::optional<double>& value, bool is_known, double low, double high) {
  if (!value) return;
  broken.unless(is_known, "{0} = {1} is set, but a {2} has no {0}: remove it", name, *value,
                asset_name(spec.kind));
  if (!is_known) return;
  broken.unless(low <= *value && *value <= high, "{} = {} must be from {} to {}", name, *value, low,
                high);
}

bool is_foliage(const ModelSurface& surface) {
  return surface.name == "leaf" || surface.name == "broad_leaf" || surface.name == "dry_grass";
}

}  // namespace

void check_asset(const AssetSpec& spec) {
  Violations broken("AssetSpec");
  const auto number = static_cast<std::size_t>(spec.kind);
  broken.unless(number < names.size(), "kind = {} is not one of the {} kinds", number,
                names.size());
  broken.throw_if_any();
  const KindRule& rule = rule_of(spec.kind);
  check_member(broken, spec, "size_m", spec.size_m, true, 1e-3, 1e4);
  check_member(broken, spec, "width_m", spec.width_m, rule.width_m > 0, 1e-4, 1e3);
  check_member(broken, spec, "sag_m", spec.sag_m, rule.sag_m > 0, 1e-3, 1e4);
  check_member(broken, spec, "per_m2", spec.per_m2, rule.per_m2 > 0, 1, 1e5);
  check_member(broken, spec, "square_m", spec.square_m, rule.has_squares, 1e-3, 1e3);
  check_member(broken, spec, "leaf_area_index", spec.leaf_area_index, rule.leaf_area_index > 0, 0.1,
               20);
  check_member(broken, spec, "health", spec.health, rule.has_health, 0, 1);
  broken.unless(
      spec.leaves == LeafModel::Cards || rule.leaf_area_index > 0,
      "leaves = geometry is set, but a {} has no leaves that are cards by default: remove it",
      asset_name(spec.kind));
  broken.unless(spec.seed.value == 0 || rule.has_variants,
                "seed = {} (`variant` in a scene) is set, but a {} has no variants: remove it",
                spec.seed.value, asset_name(spec.kind));
  broken.unless(spec.detail == 1 || rule.has_detail,
                "detail = {} is set, but a {} always has the same triangles: remove it",
                spec.detail, asset_name(spec.kind));
  broken.unless(!rule.has_detail || (spec.detail >= 0.25 && spec.detail <= 32),
                "detail = {} must be from 0.25 to 32", spec.detail);
  const double size_m = spec.size_m.value_or(rule.size_m);
  const double width_m = spec.width_m.value_or(rule.width_m);
  const double stems = width_m * width_m * spec.per_m2.value_or(rule.per_m2) * spec.detail;
  broken.unless(rule.per_m2 == 0 || !(stems > 1e6),
                "width_m and per_m2: {:g} stems or blades are more than the limit of 1e6; place "
                "several smaller patches",
                stems);
  if (spec.kind == AssetKind::Wire) {
    const double sag_m = spec.sag_m.value_or(rule.sag_m);
    broken.unless(sag_m <= size_m, "sag_m = {} must not exceed the span of {} m", sag_m, size_m);
    broken.unless(width_m <= size_m / 100, "width_m = {} must not exceed a hundredth of the span",
                  width_m);
  }
  if (rule.has_squares && spec.square_m) {
    for (const double side_m : {width_m, size_m}) {
      broken.unless(squares_along(side_m, *spec.square_m).has_value(),
                    "square_m = {} must divide the board's {} m into a whole number of squares, at "
                    "most 1000: change either",
                    *spec.square_m, side_m);
    }
  }
  broken.throw_if_any();
}

std::span<const std::string_view> asset_names() { return names; }

std::string_view asset_name(AssetKind kind) { return names[static_cast<std::size_t>(kind)]; }

AssetKind asset_kind(std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<AssetKind>(i);
  }
  const bool is_tree = name == "tree" || name == "trees";  // some have other names
  throw Error("there is no asset '{}'; it must be one of {}{}", name, fmt::join(names, ", "),
              is_tree ? "; did you mean 'conifer' or 'broadleaf_tree'?"
                      : suggestion(name, {names.begin(), names.end()}));
}

std::string_view asset_stand_in(std::string_view surface) {
  const auto* const found = std::ranges::find(stand_ins, surface, &StandIn::surface);
  return found == stand_ins.end() ? std::string_view() : found->material;
}

double asset_coat_alpha(std::string_view surface) {
  const auto* const found = std::ranges::find(stand_ins, surface, &StandIn::surface);
  return found == stand_ins.end() ? 0 : found->coat_alpha;
}

AssetDefaults asset_defaults(AssetKind kind) {
  const KindRule& rule = rule_of(kind);
  const auto if_known = [](double value) {
    return value > 0 ? std::optional(value) : std::nullopt;
  };
  return {.size_is = rule.size_is,
          .size_m = rule.size_m,
          .width_m = if_known(rule.width_m),
          .sag_m = if_known(rule.sag_m),
          .per_m2 = if_known(rule.per_m2),
          .leaf_area_index = if_known(rule.leaf_area_index),
          .has_squares = rule.has_squares,
          .has_variants = rule.has_variants,
          .has_detail = rule.has_detail,
          .has_health = rule.has_health};
}

AssetShape asset_shape(const AssetSpec& spec) {
  check_asset(spec);
  const KindRule& rule = rule_of(spec.kind);
  return {.size_m = spec.size_m.value_or(rule.size_m),
          .width_m = spec.width_m.value_or(rule.width_m),
          .sag_m = spec.sag_m.value_or(rule.sag_m),
          .per_m2 = spec.per_m2.value_or(rule.per_m2),
          .square_m = spec.square_m,
          .leaf_area_index = spec.leaf_area_index.value_or(rule.leaf_area_index),
          .detail = spec.detail,
          .leaves = spec.leaves,
          .health = spec.health.value_or(1),
          .seed = spec.seed,
          .random = AssetRandom(spec.kind, spec.seed)};
}

Model make_asset(const AssetSpec& spec) {
  const AssetShape shape = asset_shape(spec);  // checks the kind, which rule_of needs
  return rule_of(spec.kind).make(shape);
}

FoliageArea foliage_area(const Model& model) {
  std::vector<double> share;  // opaque fraction of each surface; 0 if it is not foliage
  for (const ModelSurface& surface : model.surfaces) {
    share.push_back(is_foliage(surface) ? opaque_share(surface.albedo.pixels) : 0);
  }
  FoliageArea area;
  std::vector<glm::dvec2> plan;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const std::uint16_t surface = model.surface_of[i];
    if (!is_foliage(model.surfaces[surface])) continue;
    const glm::uvec3& t = model.mesh.triangles[i];
    const auto& p = model.mesh.vertices_m;
    area.leaf_m2 += share[surface] * glm::length(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x])) / 2;
    for (int k = 0; k < 3; ++k) plan.emplace_back(p[t[k]]);
  }
  area.crown_m2 = hull_area(std::move(plan));
  return area;
}

}  // namespace groundray
