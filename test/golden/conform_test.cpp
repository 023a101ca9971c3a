#include "apps/golden/conform/conform.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "apps/golden/conform/pass_folder.h"
#include "apps/golden/conform/reference_rays.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/npy_io.h"
#include "terrain/lod/deviation.h"
#include "terrain/terrain_scene.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::golden::conform_test {
namespace {

namespace fs = std::filesystem;
using groundray::testing::fractal;
using groundray::testing::TemporaryFolder;
using groundray::testing::with_holes;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr const char* all_classes = R"({"implementation": "test",
  "classes": ["bytes", "mesh", "bound", "rays"], "rays": {"precision": "double", "delta_m": 0}})";

HeightGrid ground() { return with_holes(fractal(65, 2, 40, Seed{3}), 4, 3, Seed{4}); }

void write_dem(const HeightGrid& grid, const fs::path& path) {
  std::string text = fmt::format(
      "ncols {}\nnrows {}\nxllcorner 498765.5\nyllcorner 5123456.5\ncellsize {}\n"
      "NODATA_value -9999\n",
      grid.columns(), grid.rows(), grid.step_m().x);
  for (const float height_m : grid.heights_m())
    text += std::isnan(height_m) ? "-9999 " : fmt::format("{:#.9g} ", height_m);
  write_text(path, text + "\n");
}

// A folder of passes, and a copy that tests change.
class Conform : public ::testing::Test {
 protected:
  void SetUp() override {
    write_dem(ground(), folder_ / "dem.asc");
    write_pass_folder(folder_ / "dem.asc", {.tolerance_m = 0.5, .rays = 2000, .commit = "none"},
                      ours());
    fs::copy(ours(), theirs(), fs::copy_options::recursive);
    claim(all_classes);
  }
  fs::path ours() const { return folder_ / "ours"; }
  fs::path theirs() const { return folder_ / "theirs"; }
  void claim(const std::string& manifest) const {
    write_text(theirs() / "manifest.json", manifest);
  }
  void claim_only(const std::string& name) const {
    claim(R"({"implementation": "test", "classes": [")" + name +
          R"("], "rays": {"precision": "double", "delta_m": 0}})");
  }
  // Returns the numbers of an array, and writes them after a change.
  template <typename T>
  void change(const std::string& name,
              const std::function<void(std::vector<T>&, std::vector<std::uint64_t>&)>& by) const {
    auto numbers = ArrayFolder(ours()).read<T>(name, read_raw_npy(ours() / (name + ".npy")).shape);
    by(numbers.values, numbers.shape);
    write_npy(theirs() / (name + ".npy"), npy_type<T>(), numbers.shape,
              std::as_bytes(std::span(numbers.values)));
  }
  bool passes(const std::string& name) const {
    claim_only(name);
    const Report report = judge_conformity(ours(), theirs());
    EXPECT_EQ(report.sections.size(), 1u);
    return report.sections.front().verdict == Verdict::Passed;
  }
  std::string message() const {
    try {
      judge_conformity(ours(), theirs());
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

 private:
  TemporaryFolder folder_;
};

using Shape = std::vector<std::uint64_t>;

TEST_F(Conform, OwnArraysPassAllClasses) {
  const Report report = judge_conformity(ours(), theirs());
  ASSERT_EQ(report.sections.size(), 4u);
  for (const Section& section : report.sections)
    EXPECT_EQ(section.verdict, Verdict::Passed) << section.title;
}

TEST_F(Conform, ManifestNamesTheDemAndTheSumOfEachArray) {
  const auto json = nlohmann::json::parse(read_text(ours() / "manifest.json"));
  EXPECT_EQ(json["commit"], "none");
  EXPECT_EQ(json["dem"]["columns"], 65);
  EXPECT_EQ(json["dem"]["sha256"].get<std::string>().size(), 64u);
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(ours()))
    files += entry.path().extension() == ".npy" ? 1 : 0;
  EXPECT_EQ(json["arrays"].size(), files);
}

TEST_F(Conform, EachByteCounts) {
  change<float>("level_01/full_m", [](auto& values, auto&) { values[3] += 1e-6F; });
  EXPECT_FALSE(passes("bytes"));
  EXPECT_TRUE(passes("mesh"));
}

TEST_F(Conform, KeysMayBeOneFloatAboveButNotBelow) {
  const auto off = [&](int floats) {
    change<float>("level_02/key_m", [&](std::vector<float>& keys, Shape&) {
      for (float& key : keys) {
        for (int i = 0; i < std::abs(floats); ++i)
          key = std::nextafter(key, floats > 0 ? INFINITY : -INFINITY);
      }
    });
    return passes("mesh");
  };
  EXPECT_TRUE(off(0));
  EXPECT_TRUE(off(1));
  EXPECT_FALSE(off(2));
  EXPECT_FALSE(off(-1));
}

TEST_F(Conform, MeshesMayBeInAnyOrder) {
  std::vector<std::size_t> order;
  const auto reverse_rows = [&](auto& values, Shape& shape) {
    const std::size_t width = values.size() / shape[0];
    auto old = values;
    for (std::size_t i = 0; i < shape[0]; ++i)
      std::copy_n(old.begin() + static_cast<std::ptrdiff_t>(i * width), width,
                  values.end() - static_cast<std::ptrdiff_t>((i + 1) * width));
  };
  change<std::uint32_t>("mesh/triangles", [&](auto& values, auto& shape) {
    // The corners of each triangle from another one on.
    for (std::size_t i = 0; i < values.size(); i += 3)
      std::rotate(&values[i], &values[i + 1], &values[i + 3]);
    reverse_rows(values, shape);
  });
  for (const char* name : {"leaves/column", "leaves/row", "leaves/step"})
    change<std::int32_t>(name, reverse_rows);
  change<std::uint8_t>("leaves/coarser", reverse_rows);
  EXPECT_TRUE(passes("mesh"));
  EXPECT_TRUE(passes("bound"));
  EXPECT_FALSE(passes("bytes"));
}

TEST_F(Conform, OtherMeshesAreNotOurs) {
  change<std::uint32_t>("mesh/triangles",
                        [](auto& values, auto&) { std::swap(values[0], values[1]); });
  EXPECT_FALSE(passes("mesh"));
  EXPECT_FALSE(passes("bound"));  // one triangle faces down
  change<std::uint32_t>("mesh/triangles", [](auto& values, Shape& shape) {
    values.resize(values.size() - 3);
    --shape[0];
  });
  EXPECT_FALSE(passes("mesh"));
  EXPECT_FALSE(passes("bound"));  // a hole
  change<std::int32_t>("leaves/step", [](auto& values, auto&) { values[0] *= 2; });
  EXPECT_FALSE(passes("mesh"));
}

TEST_F(Conform, AnyMeshThatKeepsTheBoundPasses) {
  const auto other = [&](double tolerance_m) {
    const TerrainMesh mesh =
        build_terrain_mesh(read_pass_folder(ours()).grid, {.tolerance_m = tolerance_m}, 2);
    const Shape vertices = {mesh.vertices.size(), 2}, triangles = {mesh.triangles.size(), 3};
    write_npy(theirs() / "mesh/vertices.npy", "<i4", vertices,
              std::as_bytes(std::span(mesh.vertices)));
    write_npy(theirs() / "mesh/triangles.npy", "<u4", triangles,
              std::as_bytes(std::span(mesh.triangles)));
    return passes("bound");
  };
  EXPECT_TRUE(other(0.5));
  EXPECT_TRUE(other(0.1));
  EXPECT_FALSE(other(2));
}

TEST_F(Conform, RaysInDoubleHitTheSameTriangleAtTheSameRange) {
  const auto range = [&](double factor) {
    change<double>("rays/range_m", [&](auto& ranges, auto&) {
      for (double& range_m : ranges) range_m *= factor;
    });
    return passes("rays");
  };
  EXPECT_TRUE(range(1 + 0.9e-9));
  EXPECT_FALSE(range(1 + 1.2e-9));
  EXPECT_TRUE(range(1));
  change<std::int32_t>("rays/triangle", [](auto& triangles, auto&) {
    for (auto& triangle : triangles) triangle += triangle > 0 ? -1 : 0;
  });
  EXPECT_FALSE(passes("rays"));
}

TEST_F(Conform, LargeBudgetsDoNotExcuseOtherRays) {
  claim(R"({"implementation": "test", "classes": ["rays"], "rays": {"precision": "float",
    "delta_m": 2, "range_relative": 1e-3, "range_absolute_m": 2}})");
  const std::vector<float> ranges(2000, std::numeric_limits<float>::infinity());
  write_npy(theirs() / "rays/range_m.npy", "<f4", Shape{2000}, std::as_bytes(std::span(ranges)));
  const std::vector<std::int32_t> none(2000, -1);
  write_npy(theirs() / "rays/triangle.npy", "<i4", Shape{2000}, std::as_bytes(std::span(none)));
  const Section section = judge_conformity(ours(), theirs()).sections.front();
  EXPECT_EQ(section.verdict, Verdict::Failed);
}

TEST_F(Conform, RaysInFloatMayDifferByWhatTheirManifestStates) {
  change<double>("rays/range_m", [](auto&, auto&) {});
  const auto exact = ArrayFolder(ours()).read<double>("rays/range_m", {2000});
  std::vector<float> ranges(exact.values.begin(), exact.values.end());
  const auto judged = [&](double delta_m) {
    write_npy(theirs() / "rays/range_m.npy", "<f4", exact.shape, std::as_bytes(std::span(ranges)));
    claim(fmt::format(R"({{"implementation": "test", "classes": ["rays"], "rays": {{"precision":
      "float", "delta_m": {}, "range_relative": 1e-6, "range_absolute_m": 1e-5}}}})",
                      delta_m));
    return judge_conformity(ours(), theirs()).sections.front().verdict;
  };
  EXPECT_EQ(judged(0), Verdict::Passed);
  for (float& range_m : ranges) range_m += 5e-3F;
  EXPECT_EQ(judged(0), Verdict::Failed);
  EXPECT_EQ(judged(6e-3), Verdict::Passed);
}

struct Mistake {
  const char* name;
  std::function<void(const fs::path& theirs)> make;
  std::string message;
};

// Writes an array of zeros.
void zeros(const fs::path& path, const char* type, std::size_t size, const Shape& shape) {
  const std::size_t count =
      std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
  const std::vector<char> bytes(count * size);
  write_npy(path, type, shape, std::as_bytes(std::span(bytes)));
}

TEST_F(Conform, EachMistakeHasOneMessage) {
  const auto manifest = [](const char* text) {
    return [text](const fs::path& theirs) { write_text(theirs / "manifest.json", text); };
  };
  const std::vector<Mistake> mistakes = {
      {"no manifest", [](auto& t) { fs::remove(t / "manifest.json"); },
       "manifest.json: there is no such file"},
      {"no JSON", manifest("{"), "manifest.json: its JSON is invalid at byte 2"},
      {"no classes", manifest(R"({"implementation": "x", "classes": []})"),
       "manifest.json: classes is empty: what is claimed?"},
      {"other class", manifest(R"({"implementation": "x", "classes": ["fast"]})"),
       R"(class "fast" is unknown; the classes are bytes, mesh, bound, rays)"},
      {"no budget", manifest(R"({"implementation": "x", "classes": ["rays"]})"),
       "key 'rays' is missing (see docs/guide/gpu.md)"},
      {"other precision", manifest(R"({"implementation": "x", "classes": ["rays"],
         "rays": {"precision": "half", "delta_m": 0}})"),
       R"(rays.precision = "half" must be "double" or "float")"},
      {"negative delta", manifest(R"({"implementation": "x", "classes": ["rays"],
         "rays": {"precision": "double", "delta_m": -1}})"),
       "rays.delta_m must be a number from 0 to 2"},
      {"delta above what is known", manifest(R"({"implementation": "x", "classes": ["rays"],
         "rays": {"precision": "double", "delta_m": 3}})"),
       "rays.delta_m must be a number from 0 to 2"},
      {"budget of anything", manifest(R"({"implementation": "x", "classes": ["rays"],
         "rays": {"precision": "float", "delta_m": 0, "range_relative": 1, "range_absolute_m": 0}})"),
       "rays.range_relative must be a number from 0 to 0.001"},
      {"missing array", [](auto& t) { fs::remove(t / "level_00/key_m.npy"); },
       "level_00/key_m.npy: there is no such file"},
      {"folder for an array",
       [](auto& t) {
         fs::remove(t / "level_00/key_m.npy");
         fs::create_directory(t / "level_00/key_m.npy");
       },
       "level_00/key_m.npy: it is not a file"},
      {"path out of the folder",
       [](auto& t) {
         fs::remove(t / "level_00/key_m.npy");
         fs::create_symlink("../../ours/level_00/key_m.npy", t / "level_00/key_m.npy");
       },
       "level_00/key_m.npy: it leads out of the folder, to "},
      {"no NumPy array", [](auto& t) { write_text(t / "level_00/key_m.npy", "keys"); },
       "level_00/key_m.npy: it does not begin with the NumPy signature"},
      {"truncated array", [](auto& t) { fs::resize_file(t / "level_00/key_m.npy", 200); },
       "level_00/key_m.npy: the header declares 64 numbers or rows of 4 bytes, but 72 bytes "
       "follow"},
      {"too many bytes", [](auto& t) { fs::resize_file(t / "level_00/key_m.npy", 1 << 20); },
       "level_00/key_m.npy: it has 1048576 bytes, more than an array of shape (8, 8) can"},
      {"wrong shape",
       [](auto& t) {
         zeros(t / "level_00/key_m.npy", "<f4", 4, {8, 7});
       },
       "level_00/key_m.npy: it is <f4 of shape (8, 7); <f4 of shape (8, 8) is required"},
      {"wrong type",
       [](auto& t) {
         zeros(t / "level_00/key_m.npy", "<f8", 8, {8, 8});
       },
       "level_00/key_m.npy: it is <f8 of shape (8, 8); <f4 of shape (8, 8) is required"},
      {"other byte order",
       [](auto& t) {
         zeros(t / "level_00/key_m.npy", ">f4", 4, {8, 8});
       },
       "level_00/key_m.npy: it is >f4 of shape (8, 8); <f4"},
      {"NaN",
       [](auto& t) {
         const std::vector<float> nans(64, std::numeric_limits<float>::quiet_NaN());
         write_npy(t / "level_00/key_m.npy", "<f4", Shape{8, 8}, std::as_bytes(std::span(nans)));
       },
       "level_00/key_m.npy: number 0 is NaN"},
      {"vertex outside the DEM",
       [](auto& t) {
         const std::vector<std::int32_t> at = {65, 0};
         write_npy(t / "mesh/vertices.npy", "<i4", Shape{1, 2}, std::as_bytes(std::span(at)));
       },
       "mesh/vertices.npy: vertex 0 is (65, 0), not a sample of the DEM"},
      {"triangle without vertices",
       [](auto& t) {
         zeros(t / "mesh/vertices.npy", "<i4", 4, {0, 2});
       },
       "mesh/triangles.npy: triangle 0 has vertex"},
      {"more vertices than samples",
       [](auto& t) {
         zeros(t / "mesh/vertices.npy", "<i4", 4, {5000, 2});
       },
       "mesh/vertices.npy: it has 5000 rows; at most 4225 are possible"},
      {"ray on no triangle",
       [](auto& t) {
         const std::vector<std::int32_t> far(2000, 1 << 30);
         write_npy(t / "rays/triangle.npy", "<i4", Shape{2000}, std::as_bytes(std::span(far)));
       },
       "rays/triangle.npy: ray 0 hits triangle 1073741824, but there are"},
      {"range without a triangle", [](auto& t) { zeros(t / "rays/range_m.npy", "<f8", 8, {2000}); },
       "m and the triangle -1; a miss is inf and -1"},
  };
  for (const Mistake& mistake : mistakes) {
    fs::remove_all(theirs());
    fs::copy(ours(), theirs(), fs::copy_options::recursive);
    claim(all_classes);
    mistake.make(theirs());
    // Only the classes that the mistake concerns.
    for (const char* name : {"rays", "bound"}) {
      if (fs::exists(theirs() / "manifest.json") &&
          read_text(theirs() / "manifest.json") == all_classes &&
          mistake.message.starts_with(name == std::string("rays") ? "rays/" : "mesh/"))
        claim_only(name);
    }
    EXPECT_THAT(message(), HasSubstr(mistake.message)) << mistake.name;
  }
}

// What happens if the reference is damaged: the judge does not pass anything by it.
TEST_F(Conform, DamagedReferencesAreRejected) {
  const auto rejected = [&](const std::function<void(nlohmann::json&)>& damage) {
    const std::string sound = read_text(ours() / "manifest.json");
    auto json = nlohmann::json::parse(sound);
    damage(json);
    write_text(ours() / "manifest.json", json.dump());
    const std::string said = message();
    write_text(ours() / "manifest.json", sound);
    return said;
  };
  EXPECT_EQ(message(), "");
  EXPECT_THAT(rejected([](auto& json) { json["arrays"].clear(); }),
              HasSubstr("manifest.json: arrays: heights_m is missing"));
  EXPECT_THAT(rejected([](auto& json) { json["arrays"].erase(1); }),
              HasSubstr("arrays: level_00/key_m is missing"));
  EXPECT_THAT(rejected([](auto& json) { json["arrays"][1]["shape"].clear(); }),
              HasSubstr("arrays: level_00/key_m must have at least one row"));
  EXPECT_THAT(rejected([](auto& json) { json["settings"]["tolerance_m"] = -1; }),
              HasSubstr("tolerance_m = -1 must be finite and not negative"));
  EXPECT_THAT(rejected([](auto& json) { json["settings"]["block_cells"] = 7.5; }),
              HasSubstr("block_cells must be a whole number from 2 to 64"));
  EXPECT_THAT(rejected([](auto& json) { json["dem"]["columns"] = 1LL << 31; }),
              HasSubstr("manifest.json: columns must be a whole number from 2 to"));
  zeros(ours() / "level_00/low_m.npy", "<f4", 4, {8, 8});
  EXPECT_THAT(message(), HasSubstr("level_00/low_m has changed since it was written"));
}

TEST_F(Conform, FoldersOfPassesAreNew) {
  EXPECT_THAT([&] { write_pass_folder(ours(), {}, ours()); },
              ThrowsMessage<Error>(HasSubstr("it exists and is not an empty folder")));
  EXPECT_THAT([&] { write_pass_folder(ours(), {.block_cells = 6}, ours() / "new"); },
              ThrowsMessage<Error>(HasSubstr("must be a power of two from 2 to 64")));
}

// The meaning of both distances: a ray that is moved sideways by less than both hits the same
// triangle.
TEST(ReferenceRaysProof, RaysMovedByLessThanTheirDistancesHitTheSameTriangle) {
  const HeightGrid grid = ground();
  constexpr int block_cells = 4;
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  const MeshBound bound{.tolerance_m = 0.5, .cell_m = glm::abs(grid.step_m())};
  const auto levels = certify(grid, block_cells, NodeDetail::Full);
  std::vector<NodeWindow> windows;
  for (const NodeLevel& level : levels) windows.push_back(whole_window(level));
  const auto leaves = list_leaves(select_nodes(lattice, windows, bound), windows, 0);
  const TerrainMesh mesh = build_terrain_mesh(grid, bound, block_cells);
  const auto trace = [&](const std::vector<Ray>& rays) {
    return trace_reference_rays(grid, leaves, block_cells, mesh, rays);
  };
  const ReferenceRays all =
      trace(sample_rays(grid, groundray::testing::proof_size(3000, 100'000), Seed{5}));
  std::size_t near = 0;
  for (int direction = 0; direction < 8; ++direction) {
    std::vector<Ray> moved = all.rays;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const double distance_m = 0.999 * std::min(all.silhouette_m[i], all.edge_m[i]);
      near += distance_m < 0.5 * all.limit_m ? 1 : 0;
      const glm::dvec3 side =
          glm::normalize(glm::cross(moved[i].direction, glm::dvec3(0.1234, 0.5, 0.77)));
      const glm::dvec3 up = glm::cross(side, moved[i].direction);
      moved[i].origin +=
          distance_m * (std::cos(0.7854 * direction) * side + std::sin(0.7854 * direction) * up);
    }
    const ReferenceRays found = trace(moved);
    for (std::size_t i = 0; i < moved.size(); ++i) {
      // A ray that begins within the distance of the ground may begin below it.
      const bool begins_below =
          grid.height_m_at(glm::dvec2(moved[i].origin)).value_or(-1e9) + 0.6 > moved[i].origin.z;
      ASSERT_TRUE(found.triangle[i] == all.triangle[i] || begins_below) << i;
    }
  }
  EXPECT_GT(near, all.rays.size());
}

}  // namespace
}  // namespace groundray::golden::conform_test
