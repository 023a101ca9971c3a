// Litter, moss, grass and heath. docs/reference/textures.md states the sizes and their sources.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <span>
#include <vector>

#include "core/math.h"
#include "terrain/textures/kinds.h"
#include "terrain/textures/shapes.h"

namespace groundray::ground {
namespace {

using Colour = glm::vec3;

template <std::size_t n>
Colour pick(Dice& dice, const std::array<Colour, n>& palette, double spread) {
  const auto i = static_cast<std::size_t>(dice.unit() * static_cast<double>(n));
  return palette[i] * static_cast<float>(1 + spread * (2 * dice.unit() - 1));
}

constexpr LeafOutline ovate{0.02f, 0.05f, 0.22f, 0.42f, 0.60f, 0.74f, 0.85f, 0.93f, 0.98f,
                            1.00f, 1.00f, 0.98f, 0.95f, 0.90f, 0.85f, 0.79f, 0.72f, 0.64f,
                            0.56f, 0.47f, 0.37f, 0.27f, 0.17f, 0.08f, 0.00f};
constexpr LeafOutline lobed{0.02f, 0.03f, 0.03f, 0.06f, 0.22f, 0.33f, 0.28f, 0.24f, 0.46f,
                            0.60f, 0.52f, 0.36f, 0.50f, 0.80f, 0.86f, 0.62f, 0.46f, 0.76f,
                            1.00f, 0.86f, 0.55f, 0.62f, 0.60f, 0.38f, 0.00f};
constexpr LeafOutline round{0.02f, 0.02f, 0.02f, 0.35f, 0.65f, 0.84f, 0.95f, 1.00f, 1.00f,
                            0.97f, 0.93f, 0.87f, 0.81f, 0.74f, 0.67f, 0.60f, 0.53f, 0.46f,
                            0.39f, 0.32f, 0.25f, 0.18f, 0.12f, 0.05f, 0.00f};

Leaf leaf(Site& site, double length_m, double z_m) {
  static constexpr std::array<Colour, 7> palette{{{0.235f, 0.125f, 0.055f},
                                                  {0.180f, 0.090f, 0.040f},
                                                  {0.300f, 0.185f, 0.090f},
                                                  {0.125f, 0.070f, 0.038f},
                                                  {0.350f, 0.230f, 0.125f},
                                                  {0.210f, 0.150f, 0.095f},
                                                  {0.270f, 0.120f, 0.045f}}};
  Dice& dice = site.dice;
  const float px = site.canvas.px_per_m();
  Leaf made;
  const double kind = dice.unit();
  made.outline = kind < 0.45 ? &ovate : kind < 0.8 ? &lobed : &round;
  made.middle = site.place();
  made.along = site.direction();
  made.length = static_cast<float>(length_m) * px;
  made.half = made.length * static_cast<float>(dice.between(0.24, 0.36));
  made.z_m = static_cast<float>(z_m);
  const double rise = 0.07 * length_m;
  made.tilt_m = glm::vec2{dice.between(-rise, rise), dice.between(-rise, rise)};
  made.curl_m = static_cast<float>(dice.between(-0.03, 0.09) * length_m);
  made.color = pick(dice, palette, 0.3);
  made.vein = static_cast<float>(dice.between(0.05, 0.3));
  made.mottle = static_cast<float>(dice.between(0.05, 0.16));
  made.pattern = static_cast<std::uint32_t>(dice.seed());
  made.spots = &site.spots;
  made.roughness = static_cast<float>(dice.between(0.55, 0.85));
  return made;
}

// Length, width and shape of blades, needles and twigs.
struct Growth {
  double length_m, width_m;
  int pieces = 1;
  double bend_rad = 0;  // from begin to end
  double taper = 0;     // width at the end, relative
  double round_m = 0;
  double z_begin_m = 0, z_middle_m = 0, z_end_m = 0;
  Colour begin{0}, end{0};
  double crease = 0, roughness = 0.9;
};

// Appends the strips of a curved blade, from its root on.
void grow(Site& site, const Growth& growth, glm::vec2 root, double heading_rad,
          std::vector<Strip>& into) {
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto px = static_cast<double>(site.canvas.px_per_m());
  const auto half = [&](double t) {
    // A blade narrows mostly near its tip.
    return growth.width_m * px / 2 * mix(1, growth.taper, growth.pieces > 1 ? t * t : t);
  };
  const auto z_m = [&](double t) {
    return mix(mix(growth.z_begin_m, growth.z_end_m, t), growth.z_middle_m, 4 * t * (1 - t));
  };
  const double length = growth.length_m * px / growth.pieces;
  for (int i = 0; i < growth.pieces; ++i) {
    const double a = static_cast<double>(i) / growth.pieces, b = (i + 1.0) / growth.pieces;
    const double angle_rad = heading_rad + growth.bend_rad * (a + b) / 2;
    Strip strip;
    strip.begin = root;
    strip.along = glm::vec2(math::cos(angle_rad), math::sin(angle_rad));
    strip.length = static_cast<float>(length);
    strip.half_begin = static_cast<float>(half(a)), strip.half_end = static_cast<float>(half(b));
    strip.z_begin_m = static_cast<float>(z_m(a)), strip.z_end_m = static_cast<float>(z_m(b));
    strip.round_m = static_cast<float>(growth.round_m);
    strip.color_begin = growth.begin + static_cast<float>(a) * (growth.end - growth.begin);
    strip.color_end = growth.begin + static_cast<float>(b) * (growth.end - growth.begin);
    strip.crease = static_cast<float>(growth.crease);
    strip.roughness = static_cast<float>(growth.roughness);
    root += strip.along * strip.length;
    into.push_back(strip);
  }
}

void add_needles(Site& site, double per_m2, double z_low_m, double z_high_m,
                 std::vector<Strip>& into) {
  static constexpr std::array<Colour, 3> palette{
      {{0.30f, 0.155f, 0.06f}, {0.22f, 0.12f, 0.055f}, {0.36f, 0.22f, 0.10f}}};
  Dice& dice = site.dice;
  for (int i = site.count(per_m2 / 2); i > 0; --i) {
    const glm::vec2 root = site.place();
    const double heading_rad = dice.angle_rad(), z_m = dice.between(z_low_m, z_high_m);
    const double length_m = dice.between(0.025, 0.05);
    const Colour colour = pick(dice, palette, 0.25);
    for (const double side : {-1.0, 1.0}) {  // pine needles fall in pairs
      Growth needle{length_m, 0.0013, 2, side * dice.between(0, 0.3), 0.5, 0.0006};
      needle.z_begin_m = needle.z_middle_m = z_m;
      needle.z_end_m = z_m + dice.between(-0.002, 0.002);
      needle.begin = needle.end = colour;
      needle.roughness = 0.6;
      grow(site, needle, root, heading_rad + side * dice.between(0.02, 0.25), into);
    }
  }
}

void add_twigs(Site& site, double per_m2, double z_m, std::vector<Strip>& into) {
  static constexpr std::array<Colour, 3> palette{
      {{0.085f, 0.065f, 0.05f}, {0.13f, 0.105f, 0.085f}, {0.10f, 0.06f, 0.04f}}};
  Dice& dice = site.dice;
  for (int i = site.count(per_m2); i > 0; --i) {
    Growth twig{dice.logarithmic(0.05, 0.25), dice.logarithmic(0.002, 0.006), 5,
                dice.between(-0.7, 0.7), 0.55};
    twig.round_m = twig.width_m / 2;
    twig.z_begin_m = twig.z_middle_m = twig.z_end_m = z_m + dice.between(-0.003, 0.003);
    twig.begin = twig.end = pick(dice, palette, 0.3);
    const glm::vec2 root = site.place();
    const double heading_rad = dice.angle_rad();
    grow(site, twig, root, heading_rad, into);
    if (!dice.chance(0.5)) continue;
    Growth spur = twig;  // a side twig
    spur.length_m *= 0.4, spur.width_m *= 0.6, spur.round_m *= 0.6;
    const glm::vec2 along(math::cos(heading_rad), math::sin(heading_rad));
    grow(site, spur,
         root + along * static_cast<float>(twig.length_m * 0.45) * site.canvas.px_per_m(),
         heading_rad + (dice.chance(0.5) ? 0.8 : -0.8), into);
  }
}

constexpr Colour humus(0.055f, 0.037f, 0.024f);

void lay_humus(Site& site, double rough_m, Colour color = humus) {
  const Field bumps = site.noise(0.5, 0.004), tone = site.noise(0.3, 0.004, 0.5);
  fill(site.canvas, [&](int x, int y) {
    const float light = 1 + 0.25f * tone.at(x, y);
    return Texel{static_cast<float>(rough_m) * bumps.at(x, y), color * light, 0.95f};
  });
}

// Blades in clumps, lying outwards.
struct Sward {
  double blades_per_m2, clumps_per_m2, clump_m;
  double shortest_m, longest_m, narrowest_m, widest_m;
  double top_m;         // height of the highest blades
  double dead;          // share of straw
  double parallel = 0;  // 0: outwards from the clump; 1: along the wind
};

constexpr std::array<Colour, 4> green_palette{{{0.085f, 0.150f, 0.028f},
                                               {0.065f, 0.125f, 0.030f},
                                               {0.110f, 0.165f, 0.035f},
                                               {0.055f, 0.105f, 0.024f}}};
constexpr std::array<Colour, 4> straw_palette{
    {{0.42f, 0.33f, 0.18f}, {0.34f, 0.26f, 0.14f}, {0.50f, 0.41f, 0.25f}, {0.27f, 0.215f, 0.14f}}};

void grow_sward(Site& site, const Sward& sward, std::vector<Strip>& into) {
  Dice& dice = site.dice;
  const auto px = static_cast<double>(site.canvas.px_per_m());
  const Field wind = site.noise(1, 0.2);
  const double per_clump = sward.blades_per_m2 / sward.clumps_per_m2;
  const int blades_of_clump = static_cast<int>(per_clump);
  into.reserve(static_cast<std::size_t>(site.count(sward.blades_per_m2)) * 3);
  for (int i = site.count(sward.clumps_per_m2); i > 0; --i) {
    const glm::vec2 clump = site.place();
    const double clump_tone = dice.between(0.75, 1.25), vigour = dice.between(0.7, 1.15);
    for (int j = blades_of_clump; j > 0; --j) {
      const double angle_rad = dice.angle_rad();
      const double away = sward.clump_m * std::sqrt(dice.unit());
      const glm::vec2 outwards(math::cos(angle_rad), math::sin(angle_rad));
      const glm::vec2 root = clump + outwards * static_cast<float>(away * px);
      const float blown = wind.at(static_cast<int>(root.x), static_cast<int>(root.y));
      const double wind_rad = 1.2 * static_cast<double>(blown) + 0.5;
      const double heading_rad = dice.chance(sward.parallel) ? wind_rad + dice.between(-0.5, 0.5)
                                                             : angle_rad + dice.between(-1.0, 1.0);
      Growth blade{dice.between(sward.shortest_m, sward.longest_m) * vigour,
                   dice.between(sward.narrowest_m, sward.widest_m), 3, dice.between(-0.9, 0.9),
                   0.15};
      const bool is_dead = dice.chance(sward.dead);
      const Colour colour = is_dead
                                ? pick(dice, straw_palette, 0.25)
                                : pick(dice, green_palette, 0.25) * static_cast<float>(clump_tone);
      blade.begin = colour * 0.55f;
      blade.end = is_dead ? colour : colour * 1.35f + Colour(0.012f, 0.008f, 0);
      const double top_m = sward.top_m * dice.between(is_dead ? 0.0 : 0.3, is_dead ? 0.6 : 1.0);
      blade.z_begin_m = 0.1 * top_m, blade.z_middle_m = top_m, blade.z_end_m = 0.75 * top_m;
      blade.crease = dice.between(-0.35, 0.35);
      blade.roughness = is_dead ? 0.8 : 0.55;
      grow(site, blade, root, heading_rad, into);
    }
  }
}

}  // namespace

Finish make_forest_litter(Site& site) {
  lay_humus(site, 0.003);
  Dice& dice = site.dice;
  std::vector<Leaf> leaves;
  const int count = site.count(2700);
  for (int i = 0; i < count; ++i) {
    const double depth = static_cast<double>(i) / count;  // the last lies on top
    const double length_m = dice.logarithmic(0.03, 0.08);
    const double z_m = 0.014 * depth + dice.between(0, 0.002);
    leaves.push_back(leaf(site, length_m, z_m));
    if (depth < 0.5) leaves.back().color *= 0.75f;  // older
  }
  lay(site.canvas, std::span<const Leaf>(leaves));
  std::vector<Strip> strips;
  add_needles(site, 900, 0.006, 0.019, strips);
  add_twigs(site, 14, 0.016, strips);
  lay(site.canvas, std::span<const Strip>(strips));
  return {0.003, 0.012, 0.75};
}

Finish make_moss(Site& site) {
  lay_humus(site, 0.002, Colour(0.026f, 0.034f, 0.008f));
  const Field cushions = site.noise(0.35, 0.04, 0.9), tone = site.noise(0.5, 0.03, 0.4);
  Dice& dice = site.dice;
  const float px = site.canvas.px_per_m();
  std::vector<Tuft> tufts;
  for (int i = site.count(70000); i > 0; --i) {
    Tuft tuft;
    tuft.middle = site.place();
    const int x = static_cast<int>(tuft.middle.x), y = static_cast<int>(tuft.middle.y);
    const float swell = cushions.at(x, y);
    if (swell + static_cast<float>(dice.between(-0.5, 0.5)) < -1.9f) continue;  // gaps
    tuft.radius = static_cast<float>(dice.between(0.0025, 0.005)) * px;
    tuft.turn = site.direction();
    tuft.z_m = 0.008f * swell + 0.02f + static_cast<float>(dice.between(0, 0.004));
    tuft.height_m = 0.004f;
    tuft.gaps = 0.24f;
    const float dry = std::clamp(0.5f + 0.35f * tone.at(x, y), 0.0f, 1.0f);
    const Colour wet(0.058f, 0.100f, 0.019f), yellow(0.105f, 0.138f, 0.026f);
    tuft.color = (wet + dry * (yellow - wet)) * static_cast<float>(dice.between(0.45, 0.75));
    tuft.tip_color = (wet + dry * (yellow - wet)) * static_cast<float>(dice.between(1.0, 1.7));
    tufts.push_back(tuft);
  }
  lay(site.canvas, std::span<const Tuft>(tufts));
  std::vector<Strip> strips;
  add_needles(site, 90, 0.03, 0.042, strips);
  add_twigs(site, 3, 0.034, strips);
  lay(site.canvas, std::span<const Strip>(strips));
  std::vector<Leaf> leaves;
  for (int i = site.count(4); i > 0; --i) {
    leaves.push_back(leaf(site, dice.logarithmic(0.03, 0.06), 0.034));
    leaves.back().color *= 0.4f;  // wet
  }
  lay(site.canvas, std::span<const Leaf>(leaves));
  return {0.004, 0.012, 0.7};
}

Finish make_short_grass(Site& site) {
  lay_humus(site, 0.002, Colour(0.034f, 0.046f, 0.014f));
  std::vector<Strip> blades;
  grow_sward(site, {19000, 900, 0.05, 0.025, 0.07, 0.002, 0.0042, 0.014, 0.08}, blades);
  lay(site.canvas, std::span<const Strip>(blades));
  return {0.005, 0.012, 0.8};
}

Finish make_dead_grass(Site& site) {
  lay_humus(site, 0.003, Colour(0.150f, 0.115f, 0.064f));
  std::vector<Strip> blades;
  grow_sward(site, {9000, 180, 0.07, 0.07, 0.25, 0.0015, 0.0035, 0.012, 0.97, 0.5}, blades);
  lay(site.canvas, std::span<const Strip>(blades));
  return {0.004, 0.012, 0.75};
}

Finish make_heath(Site& site) {
  lay_humus(site, 0.003, Colour(0.060f, 0.050f, 0.028f));
  const Field patches = site.noise(0.4, 0.04, 0.6);
  Dice& dice = site.dice;
  const float px = site.canvas.px_per_m();
  std::vector<Tuft> tufts;  // reindeer lichen where patches are high, moss elsewhere
  for (int i = site.count(42000); i > 0; --i) {
    Tuft tuft;
    tuft.middle = site.place();
    const float patch =
        patches.at(static_cast<int>(tuft.middle.x), static_cast<int>(tuft.middle.y));
    const bool is_lichen = patch + static_cast<float>(dice.between(-0.45, 0.45)) > 0.8f;
    tuft.radius = static_cast<float>(dice.between(0.0022, is_lichen ? 0.0055 : 0.0045)) * px;
    tuft.turn = site.direction();
    tuft.gaps = is_lichen ? 0.2f : 0.26f;
    tuft.z_m = 0.006f + (is_lichen ? 0.004f + 0.006f * patch : 0.0f) +
               static_cast<float>(dice.between(0, 0.006));
    tuft.height_m = is_lichen ? 0.006f : 0.004f;
    const Colour base = is_lichen ? Colour(0.31f, 0.315f, 0.225f) : Colour(0.075f, 0.080f, 0.025f);
    tuft.color = base * static_cast<float>(dice.between(0.45, 0.7));
    tuft.tip_color = base * static_cast<float>(dice.between(0.9, 1.3));
    tufts.push_back(tuft);
  }
  lay(site.canvas, std::span<const Tuft>(tufts));
  std::vector<Strip> twigs;
  static constexpr std::array<Colour, 4> shrub{{{0.060f, 0.085f, 0.024f},
                                                {0.085f, 0.100f, 0.030f},
                                                {0.160f, 0.075f, 0.030f},
                                                {0.045f, 0.065f, 0.022f}}};
  for (int i = site.count(1300); i > 0; --i) {  // dwarf shrubs: stems with small leaves
    const glm::vec2 root = site.place();
    if (patches.at(static_cast<int>(root.x), static_cast<int>(root.y)) > 0.9f) continue;
    const double heading_rad = dice.angle_rad(), length_m = dice.between(0.03, 0.09);
    Growth stem{length_m, 0.0016, 2, dice.between(-0.6, 0.6), 0.6, 0.0008, 0.008, 0.018, 0.024};
    stem.begin = stem.end = Colour(0.10f, 0.06f, 0.04f);
    grow(site, stem, root, heading_rad, twigs);
    const Colour own = pick(dice, shrub, 0.3);
    for (double along = 0.12; along < 1; along += 0.0035 / length_m) {
      const double turn_rad = heading_rad + stem.bend_rad * along / 2;
      const glm::vec2 at = root + glm::vec2(math::cos(turn_rad), math::sin(turn_rad)) *
                                      static_cast<float>(along * length_m) * px;
      const double z_m = 0.012 + 0.014 * along + dice.between(-0.002, 0.004);
      Growth leaflet{dice.between(0.004, 0.008), dice.between(0.002, 0.0045), 1, 0, 0.4};
      leaflet.z_begin_m = leaflet.z_middle_m = z_m, leaflet.z_end_m = z_m + 0.002;
      leaflet.begin = own * static_cast<float>(dice.between(0.7, 1.0));
      leaflet.end = own * static_cast<float>(dice.between(0.9, 1.4));
      leaflet.crease = dice.between(-0.2, 0.2);
      leaflet.roughness = 0.5;
      const double side = dice.chance(0.5) ? 1.0 : -1.0;
      grow(site, leaflet, at, turn_rad + side * dice.between(0.4, 1.4), twigs);
    }
  }
  lay(site.canvas, std::span<const Strip>(twigs));
  return {0.005, 0.014, 0.75};
}

}  // namespace groundray::ground
