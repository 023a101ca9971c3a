#include "apps/view/rendering/colour_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <span>

namespace groundray {
namespace {

using Anchors = std::span<const std::uint32_t>;  // 0xRRGGBB

// Equidistant samples of matplotlib's colour map of the same name.
constexpr std::array<std::uint32_t, 10> viridis = {0x440154, 0x482878, 0x3e4989, 0x31688e,
                                                   0x26828e, 0x1f9e89, 0x35b779, 0x6ece58,
                                                   0xb5de2b, 0xfde725};
constexpr std::array<std::uint32_t, 15> turbo = {0x30123b, 0x4145ab, 0x4675ed, 0x39a2fc, 0x1bcfd4,
                                                 0x24eca6, 0x61fc6c, 0xa4fc3b, 0xd1e834, 0xf3c63a,
                                                 0xfe9b2d, 0xf36315, 0xd93806, 0xb11901, 0x7a0402};
// ColorBrewer's RdBu.
constexpr std::array<std::uint32_t, 9> blue_to_red = {
    0x2166ac, 0x4393c3, 0x92c5de, 0xd1e5f0, 0xf7f7f7, 0xfddbc7, 0xf4a582, 0xd6604d, 0xb2182b};
// Lightness increases from first to last.
constexpr std::array<std::uint32_t, 6> earth = {0x2f5d50, 0x5d8257, 0x99a36b,
                                                0xc8b98a, 0xe0d0b1, 0xf8f4ec};
// Chosen to remain distinguishable with colour vision deficiencies as far as possible; 0 is grey
// and means nothing.
constexpr std::array<std::uint32_t, 13> kind_colours = {
    0x9a9a9a, 0x4e79a7, 0xf28e2b, 0x59a14f, 0xe15759, 0x76b7b2, 0xedc948,
    0xb07aa1, 0xff9da7, 0x9c755f, 0x1b9e77, 0xd95f02, 0x7570b3};

glm::dvec3 rgb(std::uint32_t hex) {
  return glm::dvec3((hex >> 16U) & 255U, (hex >> 8U) & 255U, hex & 255U) / 255.0;
}

Anchors anchors_of(ColourScale scale) {
  switch (scale) {
    case ColourScale::Even:
      return viridis;
    case ColourScale::Vivid:
      return turbo;
    case ColourScale::Signed:
      return blue_to_red;
    case ColourScale::Earth:
      break;
  }
  return earth;
}

void set(vtkLookupTable& table, int i, const glm::dvec3& colour) {
  table.SetTableValue(i, colour.x, colour.y, colour.z, 1);
}

}  // namespace

glm::dvec3 colour_on(ColourScale scale, double share) {
  const Anchors anchors = anchors_of(scale);
  const double place =
      std::clamp(std::isnan(share) ? 0 : share, 0.0, 1.0) * static_cast<double>(anchors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), anchors.size() - 2);
  return glm::mix(rgb(anchors[i]), rgb(anchors[i + 1]), place - static_cast<double>(i));
}

glm::dvec3 colour_of_kind(int kind) {
  if (kind <= 0) return rgb(kind_colours[0]);
  return rgb(kind_colours[1 + static_cast<std::size_t>(kind - 1) % (kind_colours.size() - 1)]);
}

glm::dvec3 colour_of_kind(const LayerColumn& column, int kind) {
  if (!column.is_ordered || column.categories.empty()) return colour_of_kind(kind);
  const int first = column.categories.begin()->first, last = column.categories.rbegin()->first;
  if (first == last) return colour_on(column.scale, 0.3);
  // The ends of the scale are omitted: they are hard to see on surfaces.
  return colour_on(column.scale, 0.1 + 0.85 * (kind - first) / (last - first));
}

vtkSmartPointer<vtkLookupTable> make_colour_table(const LayerColumn& column) {
  auto table = vtkSmartPointer<vtkLookupTable>::New();
  table->SetNanColor(0.45, 0.45, 0.45, 1);
  if (!column.categories.empty()) {
    const int first = column.categories.begin()->first, last = column.categories.rbegin()->first;
    // One entry for each number, whose interval is centred on it.
    const int entries = std::clamp(last - first + 1, 1, 65536);
    table->SetNumberOfTableValues(entries);
    table->SetTableRange(first - 0.5, first + entries - 0.5);
    for (int i = 0; i < entries; ++i) set(*table, i, colour_of_kind(column, first + i));
    return table;
  }
  constexpr int entries = 256;
  table->SetNumberOfTableValues(entries);
  const double span = column.range.y - column.range.x;
  const double half = span > 0 ? 0 : std::max(std::abs(column.range.x) * 1e-3, 1e-6);
  table->SetTableRange(column.range.x - half, column.range.y + half);
  for (int i = 0; i < entries; ++i) set(*table, i, colour_on(column.scale, i / (entries - 1.0)));
  return table;
}

}  // namespace groundray
