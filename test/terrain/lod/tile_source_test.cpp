#include "terrain/lod/tile_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "terrain/lod/deviation.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/geotiff.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::tile_source_test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr std::size_t plenty = 64 << 20;

// Opens the DEM with nothing of it in GDAL's cache: each handle has its own blocks.
FileTiles open_tiles(const std::filesystem::path& path, std::size_t cache_bytes) {
  Certificate certificate = Certificate::open_or_make(DemFile(path));
  return {DemFile(path), std::move(certificate), cache_bytes};
}

MemoryTiles in_memory(const HeightGrid& grid) {
  return {grid, certify(grid, Certificate::block_cells, NodeDetail::Full)};
}

std::vector<TileName> all_tiles(const Lattice& lattice) {
  std::vector<TileName> names;
  for (int level = 0; level <= lattice.top_level(); ++level) {
    const glm::ivec2 count = tile_count(lattice, level);
    for (int row = 0; row < count.y; ++row) {
      for (int column = 0; column < count.x; ++column) names.push_back({level, {column, row}});
    }
  }
  return names;
}

template <std::size_t n>
bool same_bits(const std::array<float, n>& a, const std::array<float, n>& b) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return std::ranges::equal(a, b, {}, bits, bits);
}

bool same_bits(const Tile& a, const Tile& b) {
  return same_bits(a.heights_m, b.heights_m) && same_bits(a.key_m, b.key_m) &&
         same_bits(a.deviation_m, b.deviation_m) && same_bits(a.full_m, b.full_m) &&
         same_bits(a.low_m, b.low_m) && same_bits(a.high_m, b.high_m);
}

std::size_t index_of(glm::ivec2 place, int columns) {
  return static_cast<std::size_t>(place.y) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(place.x);
}

std::string error_of(const auto& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// A DEM of 4 x 4 tiles at level 0.
class TileSourceTest : public ::testing::Test {
 protected:
  TileSourceTest() { testing::save_geotiff(grid_, path_); }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "dem.tif";
  HeightGrid grid_ = testing::with_holes(testing::fractal(257, 2, 300, Seed{5}), 20, 4, Seed{6});
};

TEST_F(TileSourceTest, FileTilesEqualMemoryTilesBitForBit) {
  std::vector<testing::NamedTerrain> terrains{
      {"fractal with holes", grid_},
      {"noise", testing::white_noise({300, 130}, 50, Seed{7})},
      {"a cell", testing::white_noise({2, 2}, 50, Seed{8})}};
  const auto more = testing::adversarial_terrain();
  for (std::size_t i = 0; i < more.size(); i += 3) terrains.push_back(more[i]);
  for (const auto& [name, grid] : terrains) {
    if (grid.hole_count() == grid.heights_m().size()) continue;
    const auto path = folder_ / "terrain.tif";
    testing::save_geotiff(grid, path);
    const FileTiles files = open_tiles(path, plenty);
    const MemoryTiles memory = in_memory(grid);
    ASSERT_EQ(files.lattice(), memory.lattice());
    for (int level = 0; level <= files.lattice().top_level(); ++level) {
      EXPECT_EQ(files.max_key_m(level), memory.max_key_m(level)) << name << " level " << level;
    }
    for (const TileName& tile : all_tiles(files.lattice())) {
      ASSERT_TRUE(same_bits(*files.tile(tile), *memory.tile(tile)))
          << name << ", level " << tile.level << ": " << tile.which.x << ", " << tile.which.y;
    }
  }
}

TEST_F(TileSourceTest, TileContainsOnlyItsPointsAndNodes) {
  const HeightGrid noise = testing::white_noise({300, 130}, 50, Seed{7});
  const MemoryTiles tiles = in_memory(noise);
  const auto levels = certify(noise, Certificate::block_cells, NodeDetail::Full);
  const Lattice& lattice = tiles.lattice();
  for (const TileName& name : all_tiles(lattice)) {
    const auto tile = tiles.tile(name);
    for (int row = 0; row < Tile::points; ++row) {
      for (int column = 0; column < Tile::points; ++column) {
        const glm::ivec2 point = name.which * Tile::cells + glm::ivec2(column, row);
        const glm::ivec2 all = lattice.points(name.level);
        const float z = tile->heights_m[index_of({column, row}, Tile::points)];
        if (point.x >= all.x || point.y >= all.y) {
          ASSERT_TRUE(std::isnan(z));
          continue;
        }
        const glm::ivec2 sample = lattice.sample(name.level, point);
        ASSERT_EQ(z, noise.height_m(sample.x, sample.y));
      }
    }
    const NodeLevel& nodes = levels[static_cast<std::size_t>(name.level)];
    for (int row = 0; row < Tile::nodes; ++row) {
      for (int column = 0; column < Tile::nodes; ++column) {
        const glm::ivec2 node = name.which * Tile::nodes + glm::ivec2(column, row);
        const auto at = index_of({column, row}, Tile::nodes);
        const bool is_there = node.x < nodes.size.x && node.y < nodes.size.y;
        const auto in_level = index_of(node, nodes.size.x);
        ASSERT_EQ(tile->key_m[at], is_there ? nodes.key_m[in_level] : -1);
        if (is_there) {
          ASSERT_EQ(tile->high_m[at], nodes.high_m[in_level]);
        }
      }
    }
  }
}

TEST_F(TileSourceTest, RejectsTilesOutsideALevel) {
  const MemoryTiles memory = in_memory(grid_);
  const FileTiles files = open_tiles(path_, plenty);
  for (const TileSource* tiles :
       {static_cast<const TileSource*>(&memory), static_cast<const TileSource*>(&files)}) {
    for (const TileName& name :
         std::vector<TileName>{{-1, {0, 0}}, {9, {0, 0}}, {0, {4, 0}}, {0, {0, -1}}, {3, {0, 1}}}) {
      EXPECT_THAT(error_of([&] { (void)tiles->tile(name); }), HasSubstr("there is no tile ("));
    }
  }
}

TEST_F(TileSourceTest, RejectsMissingLevelsAndOtherBlockSizes) {
  auto levels = certify(grid_, Certificate::block_cells, NodeDetail::Full);
  levels.pop_back();
  EXPECT_THAT(error_of([&] { MemoryTiles(grid_, levels); }),
              HasSubstr("tiles require all 9 levels"));
  EXPECT_THAT(error_of([&] { MemoryTiles(grid_, certify(grid_, 4, NodeDetail::Full)); }),
              HasSubstr("blocks of 8 cells"));
}

TEST_F(TileSourceTest, CacheKeepsTheMostRecentlyUsedTilesWithinItsBound) {
  const FileTiles tiles = open_tiles(path_, 3 * sizeof(Tile) + 5);
  const auto reads_of = [&](int column) {
    const std::size_t before = tiles.statistics().reads;
    tiles.tile({0, {column, 0}});
    EXPECT_LE(tiles.statistics().cached_bytes, 3 * sizeof(Tile));
    return tiles.statistics().reads - before;
  };
  for (const int column : {0, 1, 2}) EXPECT_EQ(reads_of(column), 1u);
  EXPECT_EQ(reads_of(0), 0u);
  EXPECT_EQ(reads_of(3), 1u);  // replaces column 1
  EXPECT_EQ(reads_of(2), 0u);
  EXPECT_EQ(reads_of(0), 0u);
  EXPECT_EQ(reads_of(1), 1u);
}

TEST_F(TileSourceTest, WithoutACacheEveryTileIsReadAgain) {
  const FileTiles tiles = open_tiles(path_, 0);
  const auto first = tiles.tile({1, {1, 1}});
  const auto second = tiles.tile({1, {1, 1}});
  EXPECT_TRUE(same_bits(*first, *second));
  const std::vector<TileName> names{{1, {1, 1}}};
  tiles.prefetch(names);
  tiles.wait_for_prefetch();
  EXPECT_EQ(tiles.statistics().reads, 2u);
  EXPECT_EQ(tiles.statistics().cached_bytes, 0u);
}

TEST_F(TileSourceTest, PrefetchedTilesAreServedWithoutReading) {
  const FileTiles tiles = open_tiles(path_, plenty);
  const MemoryTiles memory = in_memory(grid_);
  const auto names = all_tiles(tiles.lattice());
  tiles.prefetch(names);
  tiles.wait_for_prefetch();
  EXPECT_EQ(tiles.statistics().reads, names.size());
  for (const TileName& name : names) {
    EXPECT_TRUE(same_bits(*tiles.tile(name), *memory.tile(name)));
  }
  tiles.prefetch(names);
  tiles.wait_for_prefetch();
  EXPECT_EQ(tiles.statistics().reads, names.size());
}

TEST_F(TileSourceTest, ConcurrentRandomAccessReturnsTheSameTiles) {
  const MemoryTiles memory = in_memory(grid_);
  const FileTiles tiles = open_tiles(path_, 7 * sizeof(Tile));
  const auto names = all_tiles(tiles.lattice());
  std::vector<int> wrong(5, 0);
  {
    std::vector<std::jthread> threads;
    for (std::uint32_t thread = 0; thread < wrong.size(); ++thread) {
      threads.emplace_back([&, thread] {
        for (std::uint32_t i = 0; i < 300; ++i) {
          const glm::dvec2 number = random_uniform({.sensor = thread, .pulse = i});
          const auto pick = [&](double share) {
            return names[static_cast<std::size_t>(share * static_cast<double>(names.size()))];
          };
          if (i % 10 == 0) tiles.prefetch(std::vector{pick(number.y), pick(number.x)});
          wrong[thread] += !same_bits(*tiles.tile(pick(number.x)), *memory.tile(pick(number.x)));
        }
      });
    }
  }
  EXPECT_THAT(wrong, ::testing::Each(0));
  EXPECT_LE(tiles.statistics().cached_bytes, 7 * sizeof(Tile));
}

TEST_F(TileSourceTest, ReportsFileLevelAndTileOfATruncatedDem) {
  const FileTiles tiles = open_tiles(path_, plenty);
  std::filesystem::resize_file(path_, 3000);
  const std::vector<TileName> names{{0, {3, 3}}};
  tiles.prefetch(names);
  tiles.wait_for_prefetch();
  EXPECT_EQ(tiles.statistics().cached_bytes, 0u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_THAT(error_of([&] {
                  tiles.tile({0, {3, 3}});
                }),
                AllOf(HasSubstr("tile (3, 3) of level 0 of " + path_.string()),
                      HasSubstr("cannot all be read")));
  }
  EXPECT_EQ(tiles.statistics().reads, 3u);
  EXPECT_NO_THROW(tiles.tile({1, {1, 1}}));  // held by the certificate
}

TEST_F(TileSourceTest, ReportsFileLevelAndTileOfATruncatedCertificate) {
  const FileTiles tiles = open_tiles(path_, plenty);
  const auto heights = folder_ / "dem.tif.groundray/heights_01.tif";
  std::filesystem::resize_file(heights, 3000);
  EXPECT_THAT(error_of([&] {
                tiles.tile({1, {1, 1}});
              }),
              AllOf(HasSubstr("tile (1, 1) of level 1 of " + path_.string()),
                    HasSubstr(heights.string() + ": its values cannot be read")));
  EXPECT_NO_THROW(tiles.tile({2, {0, 0}}));
}

TEST_F(TileSourceTest, TruncatedPartOfAMosaicAffectsOnlyItsTiles) {
  testing::save_geotiff(grid_, folder_ / "east.tif");
  const auto part = [](const char* name, int column) {
    return fmt::format(R"(<SimpleSource><SourceFilename relativeToVRT="1">{}</SourceFilename>
      <SourceBand>1</SourceBand>
      <SrcRect xOff="0" yOff="0" xSize="257" ySize="257"/>
      <DstRect xOff="{}" yOff="0" xSize="257" ySize="257"/>
      </SimpleSource>)",
                       name, column);
  };
  std::ofstream(folder_ / "mosaic.vrt") << fmt::format(
      R"(<VRTDataset rasterXSize="514" rasterYSize="257">
      <VRTRasterBand dataType="Float32" band="1">{}{}</VRTRasterBand></VRTDataset>)",
      part("dem.tif", 0), part("east.tif", 257));
  const FileTiles tiles = open_tiles(folder_ / "mosaic.vrt", plenty);
  std::filesystem::resize_file(folder_ / "east.tif", 3000);
  EXPECT_NO_THROW(tiles.tile({0, {0, 0}}));
  EXPECT_NO_THROW(tiles.tile({1, {3, 0}}));
  EXPECT_THAT(error_of([&] {
                tiles.tile({0, {6, 1}});
              }),
              AllOf(HasSubstr("tile (6, 1) of level 0 of"), HasSubstr("east.tif")));
}

TEST_F(TileSourceTest, DestructionCancelsPrefetching) {
  const auto begin = std::chrono::steady_clock::now();
  {
    const FileTiles tiles = open_tiles(path_, 2 * sizeof(Tile));
    std::vector<TileName> names;
    const auto all = all_tiles(tiles.lattice());
    for (int i = 0; i < 20'000; ++i) names.insert(names.end(), all.begin(), all.end());
    tiles.prefetch(names);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);  // reading all would take minutes
}

TEST_F(TileSourceTest, ALaterPrefetchReplacesTheQueue) {
  const FileTiles tiles = open_tiles(path_, sizeof(Tile));
  std::vector<TileName> many;
  const auto all = all_tiles(tiles.lattice());
  for (int i = 0; i < 20'000; ++i) many.insert(many.end(), all.begin(), all.end());
  tiles.prefetch(many);
  tiles.prefetch({});
  tiles.wait_for_prefetch();
  EXPECT_LT(tiles.statistics().reads, many.size());
}

}  // namespace
}  // namespace groundray::tile_source_test
