#include "terrain/lod/certificate.h"

#include <fmt/format.h>
#include <gdal.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/random.h"
#include "terrain/lod/deviation.h"
#include "test/support/environment.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/geotiff.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::certificate_test {
namespace {

using ::testing::AllOf;
using testing::Environment;
using testing::FileSizeLimit;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr int block_cells = Certificate::block_cells;

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

bool same_bits(const NodeLevel& a, const NodeLevel& b) {
  return a.size == b.size && same_bits(a.key_m, b.key_m) &&
         same_bits(a.deviation_m, b.deviation_m) && same_bits(a.full_m, b.full_m) &&
         same_bits(a.low_m, b.low_m) && same_bits(a.high_m, b.high_m);
}

// Every 2^level-th sample and the last one, as Lattice defines them.
std::vector<float> thinned(const HeightGrid& grid, const Lattice& lattice, int level) {
  std::vector<float> heights;
  for (int row = 0; row < lattice.points(level).y; ++row) {
    for (int column = 0; column < lattice.points(level).x; ++column) {
      const glm::ivec2 sample = lattice.sample(level, {column, row});
      heights.push_back(grid.height_m(sample.x, sample.y));
    }
  }
  return heights;
}

void expect_certifies(const Certificate& certificate, const HeightGrid& grid,
                      const std::string& name) {
  SCOPED_TRACE(name);
  const Lattice& lattice = certificate.lattice();
  ASSERT_EQ(lattice, (Lattice{{grid.columns(), grid.rows()}, block_cells}));
  const auto levels = certify(grid, block_cells, NodeDetail::Full);
  ASSERT_EQ(certificate.levels().size(), levels.size());
  for (int level = 0; level <= lattice.top_level(); ++level) {
    const NodeLevel& nodes = levels[static_cast<std::size_t>(level)];
    EXPECT_TRUE(same_bits(certificate.nodes(level, {0, 0}, lattice.nodes(level)), nodes)) << level;
    if (level == 0) continue;
    EXPECT_TRUE(same_bits(certificate.heights(level, {0, 0}, lattice.points(level)),
                          thinned(grid, lattice, level)))
        << level;
  }
}

std::string error_of(const auto& work) {
  ::testing::internal::CaptureStderr();
  std::string message = "no error";
  try {
    work();
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  return message;
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

// Drops root privileges for the object's lifetime, so that read-only folders are effective even for
// root.
class Unprivileged {
 public:
  Unprivileged() {
    if (geteuid() == 0 && seteuid(65534) != 0) throw std::runtime_error("seteuid failed");
  }
  ~Unprivileged() {
    if (getuid() == 0 && seteuid(0) != 0) std::abort();
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;
};

void make_read_only(const std::filesystem::path& folder) {
  std::filesystem::permissions(folder, std::filesystem::perms{0555});
}

class CertificateTest : public ::testing::Test {
 protected:
  CertificateTest() { testing::save_geotiff(grid_, path_); }

  // Opens or makes the certificate, and counts how often it is made.
  Certificate certificate(const DemOptions& options = {}) {
    const DemFile dem(path_, options);
    return Certificate::open_or_make(dem, {.progress = [&](double share) { made_ += share == 1; }});
  }
  bool is_open() const { return Certificate::open(DemFile(path_)).has_value(); }

  TemporaryFolder folder_;
  TemporaryFolder cache_;
  Environment cache_home_{"XDG_CACHE_HOME", cache_.path()};
  std::filesystem::path path_ = folder_ / "dem.tif";
  std::filesystem::path beside_ = folder_ / "dem.tif.groundray";
  HeightGrid grid_ = testing::with_holes(testing::fractal(129, 2, 200, Seed{5}), 9, 3, Seed{6});
  std::atomic<int> made_ = 0;
};

TEST_F(CertificateTest, EqualsCertificationInMemoryBitForBit) {
  auto terrains = testing::adversarial_terrain();
  for (auto& plane : testing::planes()) terrains.push_back(std::move(plane));
  terrains.push_back({"fractal with holes", grid_});
  terrains.push_back({"noise", testing::white_noise({300, 130}, 50, Seed{7})});
  terrains.push_back({"strip", testing::white_noise({2, 700}, 50, Seed{8})});
  for (std::uint32_t i = 0; i < 6; ++i) {
    const glm::ivec2 size(2.0 + 120.0 * random_uniform({.pulse = i}));
    terrains.push_back({"noise", testing::white_noise(size, 50, Seed{i})});
  }
  std::erase_if(terrains, [](const auto& terrain) {
    return terrain.grid.hole_count() == terrain.grid.heights_m().size();
  });
  for (std::size_t i = 0; i < terrains.size(); ++i) {
    testing::save_geotiff(terrains[i].grid, path_);
    const int tile_cells = std::array{8, 16, 64, 4096}[i % 4];
    const auto made = Certificate::open_or_make(DemFile(path_), {.tile_cells = tile_cells});
    expect_certifies(made, terrains[i].grid, terrains[i].name);
    if (i % 4 == 3) expect_certifies(certificate(), terrains[i].grid, "reopened");
  }
  EXPECT_EQ(made_, 0);
}

TEST_F(CertificateTest, ValuesDoNotDependOnTheTileSize) {
  const HeightGrid noise =
      testing::with_holes(testing::white_noise({261, 140}, 50, Seed{7}), 12, 6, Seed{9});
  testing::save_geotiff(noise, path_);
  for (const int tile_cells : {8, 16, 32, 64, 128, 256, 512}) {
    std::filesystem::remove_all(beside_);
    expect_certifies(Certificate::open_or_make(DemFile(path_), {.tile_cells = tile_cells}), noise,
                     fmt::format("tiles of {} cells", tile_cells));
  }
  EXPECT_THAT(error_of([&] { Certificate::open_or_make(DemFile(path_), {.tile_cells = 24}); }),
              HasSubstr("tile_cells = 24 must be a power of two, 8 or more"));
}

TEST_F(CertificateTest, BytesDoNotDependOnTheNumberOfThreads) {
  std::vector<std::string> bytes;
  for (const std::size_t threads : {1UL, 2UL, 5UL}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::filesystem::remove_all(beside_);
    Certificate::open_or_make(DemFile(path_), {.tile_cells = 32});
    bytes.emplace_back();
    for (const auto& file : files_in(beside_)) bytes.back() += read_text(file);
  }
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_EQ(bytes[0], bytes[2]);
}

TEST_F(CertificateTest, ReadsWindowsOfLevels) {
  const HeightGrid noise = testing::white_noise({1300, 900}, 50, Seed{7});  // several TIFF tiles
  testing::save_geotiff(noise, path_);
  const Certificate made = certificate();
  const auto levels = certify(noise, block_cells, NodeDetail::Full);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const int level = static_cast<int>(i % 6);
    const auto window = [&](glm::ivec2 all) {
      const glm::dvec2 low = random_uniform({.pulse = i});
      const glm::dvec2 part = random_uniform({.pulse = i, .sub_ray = 1});
      const glm::ivec2 first(low * glm::dvec2(all));
      return std::pair(first, glm::ivec2(part * glm::dvec2(all - first - 1)) + 1);
    };
    const auto cut = [](const std::vector<float>& from, glm::ivec2 all, auto which) {
      std::vector<float> part;
      for (int row = 0; row < which.second.y; ++row) {
        const auto at = from.begin() + (which.first.y + row) * all.x + which.first.x;
        part.insert(part.end(), at, at + which.second.x);
      }
      return part;
    };
    const NodeLevel& nodes = levels[static_cast<std::size_t>(level)];
    const auto of_nodes = window(nodes.size);
    const NodeLevel part = made.nodes(level, of_nodes.first, of_nodes.second);
    EXPECT_EQ(part.size, of_nodes.second);
    EXPECT_TRUE(same_bits(part.key_m, cut(nodes.key_m, nodes.size, of_nodes)));
    EXPECT_TRUE(same_bits(part.high_m, cut(nodes.high_m, nodes.size, of_nodes)));
    if (level == 0) continue;
    const glm::ivec2 points = made.lattice().points(level);
    const auto of_points = window(points);
    EXPECT_TRUE(same_bits(made.heights(level, of_points.first, of_points.second),
                          cut(thinned(noise, made.lattice(), level), points, of_points)));
  }
}

TEST_F(CertificateTest, RejectsWindowsOutsideALevel) {
  const Certificate made = certificate();
  for (const int level : {0, -1, 8}) {
    EXPECT_THAT(error_of([&] {
                  made.heights(level, {0, 0}, {1, 1});
                }),
                HasSubstr("there are no heights of level"));
  }
  EXPECT_THAT(error_of([&] { made.heights(1, {60, 0}, {6, 1}); }), HasSubstr("heights_01.tif: "));
  EXPECT_THAT(error_of([&] { made.nodes(0, {0, 0}, {17, 1}); }), HasSubstr("exceeds image 0"));
  EXPECT_THAT(error_of([&] { made.nodes(-1, {0, 0}, {1, 1}); }), HasSubstr("nodes.tif: "));
  EXPECT_THAT(error_of([&] { made.nodes(7, {0, 0}, {2, 1}); }), HasSubstr("in level 7"));
  EXPECT_THAT(error_of([&] { made.nodes(8, {0, 0}, {1, 1}); }), HasSubstr("in level 8"));
}

TEST_F(CertificateTest, SummaryCountsTheNodes) {
  const Certificate made = certificate();
  const auto levels = certify(grid_, block_cells, NodeDetail::Full);
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const NodeLevel& nodes = levels[level];
    const LevelSummary& summary = made.levels()[level];
    double sum_m = 0;
    double max_key_m = 0;
    float max_deviation_m = 0;
    std::size_t mixed = 0;
    std::size_t empty = 0;
    for (std::size_t i = 0; i < nodes.key_m.size(); ++i) {
      empty += nodes.key_m[i] == -1;
      mixed += std::isinf(nodes.key_m[i]);
      if (std::isfinite(nodes.key_m[i])) max_key_m = std::max(max_key_m, double{nodes.key_m[i]});
      max_deviation_m = std::max(max_deviation_m, nodes.deviation_m[i]);
      sum_m += nodes.deviation_m[i];
    }
    EXPECT_EQ(summary.nodes, nodes.key_m.size());
    EXPECT_EQ(summary.mixed, mixed);
    EXPECT_EQ(summary.empty, empty);
    EXPECT_EQ(summary.max_key_m, max_key_m);
    EXPECT_EQ(summary.max_deviation_m, max_deviation_m);
    // About 100 numbers are added in a different order.
    EXPECT_NEAR(summary.mean_deviation_m, sum_m / static_cast<double>(nodes.key_m.size() - empty),
                1e-13 * sum_m);
  }
  EXPECT_GT(made.levels()[0].mixed, 0u);
}

TEST_F(CertificateTest, RastersAreAlignedWithTheDem) {
  certificate();
  const auto open = [&](const char* name) {
    return std::unique_ptr<void, decltype(&GDALClose)>(
        GDALOpen((beside_ / name).c_str(), GA_ReadOnly), &GDALClose);
  };
  std::array<double, 6> dem{};
  std::array<double, 6> raster{};
  const auto source =
      std::unique_ptr<void, decltype(&GDALClose)>(GDALOpen(path_.c_str(), GA_ReadOnly), &GDALClose);
  GDALGetGeoTransform(source.get(), dem.data());
  // The cells of a node begin at a sample, the centre of one of the DEM's pixels.
  const auto nodes = open("nodes.tif");
  GDALGetGeoTransform(nodes.get(), raster.data());
  EXPECT_EQ(raster, (std::array{dem[0] + 1, 16.0, 0.0, dem[3] - 1, 0.0, -16.0}));
  EXPECT_STREQ(GDALGetProjectionRef(nodes.get()), GDALGetProjectionRef(source.get()));
  EXPECT_EQ(GDALGetRasterXSize(nodes.get()), 16);
  const std::array names{"key_m", "deviation_m", "full_m", "low_m", "high_m"};
  for (int band = 1; band <= 5; ++band) {
    const GDALRasterBandH values = GDALGetRasterBand(nodes.get(), band);
    EXPECT_STREQ(GDALGetDescription(values), names[static_cast<std::size_t>(band) - 1]);
    EXPECT_EQ(GDALGetOverviewCount(values), 3);
    EXPECT_EQ(GDALGetRasterBandXSize(GDALGetOverview(values, 2)), 2);
  }
  // A height lies at the centre of its pixel.
  GDALGetGeoTransform(open("heights_02.tif").get(), raster.data());
  EXPECT_EQ(raster, (std::array{dem[0] + 1 - 4, 8.0, 0.0, dem[3] - 1 + 4, 0.0, -8.0}));
}

TEST_F(CertificateTest, IsStoredBesideTheDemAndComputedOnce) {
  EXPECT_EQ(certificate().folder(), beside_);
  EXPECT_EQ(certificate().folder(), beside_);
  EXPECT_EQ(made_, 1);
  EXPECT_THAT(files_in(folder_.path()), ::testing::SizeIs(2));
  EXPECT_TRUE(files_in(cache_.path()).empty());
}

TEST_F(CertificateTest, ProgressIncreasesToOne) {
  std::vector<double> shares;
  Certificate::open_or_make(
      DemFile(path_),
      {.progress = [&](double share) { shares.push_back(share); }, .tile_cells = 32});
  EXPECT_EQ(shares.size(), 32u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GT(shares.front(), 0);
  EXPECT_EQ(shares.back(), 1);
}

TEST_F(CertificateTest, IsRecomputedWhenTheDemHasChanged) {
  certificate();
  std::filesystem::last_write_time(path_, std::filesystem::file_time_type::clock::now());
  EXPECT_FALSE(is_open());
  certificate();
  EXPECT_EQ(made_, 2);
  const HeightGrid other = testing::fractal(65, 2, 200, Seed{8});
  testing::save_geotiff(other, path_);
  expect_certifies(certificate(), other, "changed");
  EXPECT_EQ(made_, 3);
}

TEST_F(CertificateTest, FingerprintOfANestedMosaicDependsOnItsFiles) {
  const auto inner = path_.parent_path() / "inner.vrt";
  const auto outer = path_.parent_path() / "outer.vrt";
  for (const auto& [from, to] : {std::pair(path_, inner), std::pair(inner, outer)}) {
    const std::string command = fmt::format("gdalbuildvrt -q {} {}", to.string(), from.string());
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  const std::string before = DemFile(outer).fingerprint();
  EXPECT_EQ(DemFile(outer).fingerprint(), before);
  std::filesystem::last_write_time(path_, std::filesystem::file_time_type::clock::now());
  EXPECT_NE(DemFile(outer).fingerprint(), before);
}

TEST_F(CertificateTest, OtherOptionsHaveASeparateCertificate) {
  const float some = grid_.height_m(64, 64);
  certificate();
  const Certificate other = certificate({.nodata = some});
  EXPECT_EQ(made_, 2);
  EXPECT_GT(other.levels()[0].mixed, certificate().levels()[0].mixed);
  certificate({.nodata = some});
  EXPECT_EQ(made_, 2);
}

TEST_F(CertificateTest, CertifiesReprojectedHeights) {
  const DemOptions options{.reproject_to = "EPSG:32632"};
  expect_certifies(certificate(options), load_dem(path_, options).grid, "reprojected");
}

TEST_F(CertificateTest, TruncatedMissingOrDamagedFilesAreNeverUsed) {
  const HeightGrid small = testing::white_noise({66, 66}, 50, Seed{7});
  testing::save_geotiff(small, path_);
  certificate();
  const auto files = files_in(beside_);
  ASSERT_EQ(files.size(), 9u);  // certificate.txt, nodes.tif, seven levels of heights
  const auto expect_made_anew = [&](const std::filesystem::path& file, const std::string& how) {
    SCOPED_TRACE(file.string() + how);
    const int before = made_;
    EXPECT_FALSE(is_open());
    EXPECT_EQ(error_of([&] { certificate(); }), "no error");
    EXPECT_EQ(made_, before + 1);
    EXPECT_TRUE(is_open());
  };
  for (const auto& file : files) {
    for (const double part : {0.0, 0.5, 0.99}) {
      const auto size = static_cast<double>(std::filesystem::file_size(file));
      std::filesystem::resize_file(file, static_cast<std::uintmax_t>(part * size));
      expect_made_anew(file, fmt::format(" cut to {}", part));
    }
    std::filesystem::remove(file);
    expect_made_anew(file, " removed");
    for (const int at : {0, 9}) {
      std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
      bytes.seekg(at);
      const int byte = bytes.get();
      bytes.seekp(at);
      bytes.put(static_cast<char>(byte ^ 0x10));
      bytes.close();
      expect_made_anew(file, fmt::format(" with byte {} flipped", at));
    }
  }
  expect_certifies(certificate(), small, "recomputed");
}

TEST_F(CertificateTest, ReadingADamagedTileIsAnError) {
  testing::save_geotiff(testing::white_noise({700, 700}, 50, Seed{7}), path_);
  const Certificate made = certificate();
  const auto file = beside_ / "heights_01.tif";
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(static_cast<std::streamoff>(std::filesystem::file_size(file) / 2));
  bytes << "groundray";
  bytes.close();
  EXPECT_NO_THROW(made.heights(1, {0, 0}, {9, 9}));
  EXPECT_THAT(error_of([&] {
                made.heights(1, {0, 0}, {351, 351});
              }),
              AllOf(HasSubstr(file.string() + ": its values cannot be read"),
                    HasSubstr("delete the folder")));
}

TEST_F(CertificateTest, FullDiskLeavesNoFiles) {
  std::uintmax_t largest = 0;
  certificate();
  for (const auto& file : files_in(beside_)) {
    largest = std::max(largest, std::filesystem::file_size(file));
  }
  std::filesystem::remove_all(beside_);
  for (rlim_t bytes = 1; bytes < largest; bytes = bytes * 3 / 2 + 100) {
    std::string message;
    {
      const FileSizeLimit limit(bytes);
      message = error_of([&] { certificate(); });
    }
    EXPECT_THAT(message,
                AllOf(HasSubstr("dem.tif.groundray.part/"), HasSubstr("cannot be written")))
        << bytes;
    EXPECT_THAT(files_in(folder_.path()), ::testing::ElementsAre(path_)) << bytes;
  }
  expect_certifies(certificate(), grid_, "with space again");
}

TEST_F(CertificateTest, RemovesTheFilesOfAnInterruptedRun) {
  const auto part = folder_ / "dem.tif.groundray.part";
  std::filesystem::create_directory(part);
  std::ofstream(part / "heights_01.tif") << "II*";
  std::ofstream(part / "heights_40.tif") << "II*";
  expect_certifies(certificate(), grid_, "after an interrupted run");
  EXPECT_FALSE(std::filesystem::exists(part));
  EXPECT_EQ(files_in(beside_).size(), 9u);
}

TEST_F(CertificateTest, SucceedsAfterAKilledRun) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  // The process to be killed repeats this test up to this point; both processes share the folder.
  const char* known = std::getenv("GROUNDRAY_KILLED_IN");
  const std::filesystem::path folder = known != nullptr ? known : folder_.path().c_str();
  const Environment both_know("GROUNDRAY_KILLED_IN", folder);
  const auto certify_and_die = [&] {
    const auto die = [](double share) {
      if (share > 0.7) std::raise(SIGKILL);
    };
    Certificate::open_or_make(DemFile(folder / "dem.tif"), {.progress = die, .tile_cells = 32});
  };
  EXPECT_EXIT(certify_and_die(), ::testing::KilledBySignal(SIGKILL), "");
  EXPECT_TRUE(std::filesystem::exists(folder_ / "dem.tif.groundray.part/nodes.tif"));
  EXPECT_FALSE(std::filesystem::exists(beside_));
  expect_certifies(certificate(), grid_, "after a killed run");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "dem.tif.groundray.part"));
}

TEST_F(CertificateTest, ExceptionFromProgressLeavesNoFiles) {
  struct Interrupted {};
  for (const double when : {0.0, 0.5, 0.99}) {
    const auto stop = [&](double share) {
      if (share > when) throw Interrupted();
    };
    EXPECT_THROW(Certificate::open_or_make(DemFile(path_), {.progress = stop, .tile_cells = 32}),
                 Interrupted);
    EXPECT_THAT(files_in(folder_.path()), ::testing::ElementsAre(path_));
  }
}

TEST_F(CertificateTest, UsesTheCacheFolderIfTheDemsFolderIsReadOnly) {
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0555});
  std::filesystem::permissions(cache_.path(), std::filesystem::perms{0777});
  {
    const Unprivileged nobody;
    const Certificate made = certificate();
    EXPECT_EQ(made.folder().parent_path(), cache_ / "groundray");
    EXPECT_EQ(certificate().folder(), made.folder());
    EXPECT_EQ(made_, 1);
  }
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0755});
}

TEST_F(CertificateTest, UsesTheCacheFolderForADemInAnArchive) {
  const std::string zip = "/vsizip/" + (folder_ / "dem.zip").string();
  ASSERT_EQ(VSIMkdir(zip.c_str(), 0755), 0);
  VSILFILE* file = VSIFOpenL((zip + "/dem.tif").c_str(), "wb");
  const std::string bytes = read_text(path_);
  VSIFWriteL(bytes.data(), 1, bytes.size(), file);
  VSIFCloseL(file);
  path_ = zip + "/dem.tif";
  expect_certifies(certificate(), grid_, "in an archive");
  EXPECT_EQ(certificate().folder().parent_path(), cache_ / "groundray");
  EXPECT_EQ(made_, 1);
}

TEST_F(CertificateTest, WithoutAWritableFolderReportsWhatToSet) {
  make_read_only(folder_.path());
  make_read_only(cache_.path());
  {
    const Unprivileged nobody;
    EXPECT_THAT(error_of([&] { certificate(); }),
                AllOf(HasSubstr(path_.string() + ": there is no writable folder"),
                      HasSubstr("set XDG_CACHE_HOME"), HasSubstr(beside_.string()),
                      HasSubstr((cache_ / "groundray").string())));
  }
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0755});
  std::filesystem::permissions(cache_.path(), std::filesystem::perms{0755});
}

TEST_F(CertificateTest, KeepsForeignFiles) {
  std::filesystem::create_directory(beside_);
  std::ofstream(beside_ / "my_notes.txt") << "mine";
  EXPECT_EQ(certificate().folder().parent_path(), cache_ / "groundray");
  EXPECT_EQ(read_text(beside_ / "my_notes.txt"), "mine");
  EXPECT_THAT(files_in(beside_), ::testing::SizeIs(1));
}

TEST_F(CertificateTest, IgnoresStatisticsAddedByViewers) {
  certificate();
  std::ofstream(beside_ / "nodes.tif.aux.xml") << "<PAMDataset></PAMDataset>";
  certificate();
  EXPECT_EQ(made_, 1);
  std::filesystem::resize_file(beside_ / "nodes.tif", 100);
  EXPECT_EQ(certificate().folder(), beside_);
  EXPECT_EQ(made_, 2);
}

TEST_F(CertificateTest, ConcurrentRunsComputeItOnce) {
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] { EXPECT_EQ(certificate().folder(), beside_); });
    }
  }
  EXPECT_EQ(made_, 1);
  EXPECT_THAT(files_in(folder_.path()), ::testing::SizeIs(2));
}

TEST_F(CertificateTest, RejectsADemWithoutHeights) {
  const std::vector<float> none(1600, std::numeric_limits<float>::quiet_NaN());
  testing::save_geotiff(HeightGrid({40, 40}, {0, 0}, {1, -1}, none), path_);
  EXPECT_THAT(error_of([&] { certificate(); }),
              HasSubstr(path_.string() + ": none of its 40 x 40 samples has a height"));
  EXPECT_THAT(files_in(folder_.path()), ::testing::ElementsAre(path_));
}

TEST_F(CertificateTest, UnreadableDemIsAnError) {
  const HeightGrid large = testing::white_noise({400, 400}, 50, Seed{7});
  testing::save_geotiff(large, path_);
  const DemFile dem(path_);
  const auto cut = [&](double share) {
    const auto size = std::filesystem::file_size(path_);
    if (share < 0.05) std::filesystem::resize_file(path_, size / 4);
  };
  EXPECT_THAT(
      error_of([&] { Certificate::open_or_make(dem, {.progress = cut, .tile_cells = 64}); }),
      HasSubstr(path_.string() + ": its samples in columns"));
  EXPECT_THAT(files_in(folder_.path()), ::testing::ElementsAre(path_));
}

TEST_F(CertificateTest, DemChangedDuringCertificationIsAnError) {
  const auto touch = [&](double) {
    std::filesystem::last_write_time(path_, std::filesystem::file_time_type::clock::now());
  };
  EXPECT_THAT(error_of([&] { Certificate::open_or_make(DemFile(path_), {.progress = touch}); }),
              HasSubstr(path_.string() + ": it changed while it was certified"));
  EXPECT_THAT(files_in(folder_.path()), ::testing::ElementsAre(path_));
}

}  // namespace
}  // namespace groundray::certificate_test
