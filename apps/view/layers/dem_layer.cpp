#include "apps/view/layers/dem_layer.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "apps/view/layers/cloud_layer.h"
#include "apps/view/layers/mesh_layer.h"
#include "apps/view/rendering/coarse_layer.h"
#include "core/error.h"
#include "core/io/point_cloud.h"
#include "terrain/dem/band_file.h"
#include "terrain/dem/dem_file.h"

namespace groundray {
namespace {

constexpr int most_bands = 32;

// Reads the heights of every step-th sample.
std::vector<float> thinned_heights(const DemFile& file, int step) {
  const glm::ivec2 samples = file.header().samples;
  std::vector<float> heights;
  for (int row = 0; row < samples.y; row += step) {
    const std::vector<float> line = file.read({0, row}, {samples.x, 1});
    for (std::size_t i = 0; i < line.size(); i += static_cast<std::size_t>(step))
      heights.push_back(line[i]);
  }
  return heights;
}

// Returns the triangles of a grid whose three samples have heights. Cells are split like those of
// the reference surface: along the diagonal from the north-eastern corner.
KeptTriangles grid_triangles(glm::ivec2 size, const std::vector<float>& heights, bool is_mirrored) {
  KeptTriangles kept(heights.size());
  const auto columns = static_cast<std::uint32_t>(size.x);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (std::isnan(heights[a]) || std::isnan(heights[b]) || std::isnan(heights[c])) return;
    kept.add(is_mirrored ? glm::uvec3(a, c, b) : glm::uvec3(a, b, c), kept.cells.size());
  };
  for (std::uint32_t row = 0; row + 1 < static_cast<std::uint32_t>(size.y); ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t nw = row * columns + column, sw = nw + columns;
      add(nw, sw, nw + 1);
      add(sw + 1, nw + 1, sw);
    }
  }
  return kept;
}

PointCloud table_of(const RasterBands& bands) {
  PointCloud table(static_cast<std::size_t>(bands.samples.x) *
                   static_cast<std::size_t>(bands.samples.y));
  for (std::size_t i = 1; i < bands.bands.size(); ++i) {
    std::string name = bands.bands[i].name;
    while (table.has(name) || name == "height" || name == "slope") name += '\'';
    std::ranges::copy(bands.bands[i].values, table.add<float>(name).begin());
  }
  return table;
}

// Returns the layer of the kept triangles, with the column "height".
Layer surface_of(const std::string& name, const DemHeader& header, const RasterBands& bands,
                 const std::vector<float>& heights, const KeptTriangles& kept) {
  Layer layer{.name = name, .kind = LayerKind::Terrain, .data = make_points(kept.vertices.size())};
  layer.origin_w_m = header.origin_w_m;
  const auto places = coordinates(*layer.data);
  std::vector<float> height(kept.vertices.size());
  for (std::size_t i = 0; i < kept.vertices.size(); ++i) {
    const auto row = static_cast<int>(kept.vertices[i]);
    const glm::ivec2 sample(row % bands.samples.x, row / bands.samples.x);
    const glm::dvec2 p = header.origin_m + glm::dvec2(sample * bands.step) * header.step_m;
    places[3 * i] = static_cast<float>(p.x);
    places[3 * i + 1] = static_cast<float>(p.y);
    places[3 * i + 2] = height[i] = heights[kept.vertices[i]];
  }
  set_triangles(*layer.data, kept.triangles);
  add_normals(layer);
  add_column(layer, {.name = "height", .unit = "m", .scale = ColourScale::Earth}, height);
  return layer;
}

// Adds the other bands, with the units stated in the file.
void add_bands(Layer& layer, const RasterBands& bands, const std::vector<std::size_t>& rows) {
  add_table(layer, LayerColumn::Of::Points, table_of(bands), rows);
  for (LayerColumn& column : layer.columns) {
    for (const RasterBands::Band& band : bands.bands) {
      if (band.name == column.name && band.name != "height") column.unit = band.unit;
    }
  }
}

std::vector<std::string> raster_facts(const DemHeader& header, int all_bands, int step) {
  std::vector<std::string> facts = {
      fmt::format("{} x {} samples, {} bands", header.samples.x, header.samples.y, all_bands)};
  if (all_bands > most_bands)
    facts.push_back(fmt::format("shown with the first {} of {} bands", most_bands, all_bands));
  if (step > 1)
    facts.push_back(fmt::format("shown with every {}. sample of each row and column", step));
  facts.push_back(header.crs_name);
  return facts;
}

}  // namespace

DemOptions options_for(const std::filesystem::path& dem) {
  return {.reproject_to = inspect_raster(dem).is_geographic ? "utm" : ""};
}

Layer dem_layer(const std::string& name, const std::filesystem::path& path,
                std::size_t most_samples) {
  const DemFile file(path);
  const DemHeader& header = file.header();
  const RasterBands bands = read_bands(path, most_samples, most_bands);
  const std::vector<float> heights = thinned_heights(file, bands.step);
  const KeptTriangles kept =
      grid_triangles(bands.samples, heights, header.step_m.x * header.step_m.y > 0);
  if (kept.triangles.empty())
    throw Error("{}: no three neighbouring samples have heights: there is nothing to show",
                path.string());
  Layer layer = surface_of(name, header, bands, heights, kept);
  add_bands(layer, bands, {kept.vertices.begin(), kept.vertices.end()});
  add_slopes(layer);
  layer.coloured_by = "height";
  layer.facts = raster_facts(header, inspect_raster(path).bands, bands.step);
  return layer;
}

}  // namespace groundray
