// Tests of merging on published scans.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"
#include "core/model/mesh_reader.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "reconstruction/mesh/merge/mesh_merge.h"
#include "reconstruction/mesh/scan/organised_scan.h"
#include "reconstruction/mesh/scan/range_grid.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "test/support/gzip_file.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::mesh_merge_proof_test {
namespace {

using ::testing::IsEmpty;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// Poses of bun.conf: a scan's points are transformed by the inverse of the rotation given in the
// file.
std::vector<std::pair<std::string, Pose>> poses_of(const std::filesystem::path& conf) {
  std::vector<std::pair<std::string, Pose>> poses;
  std::ifstream file(conf);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind, name;
    glm::dvec3 p(0);
    glm::dquat q(1, 0, 0, 0);
    if (words >> kind >> name >> p.x >> p.y >> p.z >> q.x >> q.y >> q.z >> q.w && kind == "bmesh")
      poses.emplace_back(name, Pose{glm::conjugate(glm::normalize(q)), p});
  }
  return poses;
}

// Median of the distance by area, from bins of 0.01 mm.
double median_m(const MeanDistance& mean, double bin_m) {
  double below_m2 = 0;
  std::size_t bin = 0;
  while (bin < mean.bins_m2.size() && below_m2 < mean.area_m2 / 2) below_m2 += mean.bins_m2[bin++];
  return bin_m * static_cast<double>(bin);
}

double share_within(const MeanDistance& mean, double distance_m, double bin_m) {
  double area_m2 = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::round(distance_m / bin_m)); ++i)
    area_m2 += mean.bins_m2[i];
  return area_m2 / mean.area_m2;
}

// The ten range scans of the Stanford bunny against the mesh that their authors zippered from them.
// The scanner's noise is some 0.1 mm, and the pose errors are below a millimetre.
TEST(MeshMergeProof, TenScansReproduceTheBunny) {
  const auto folder = shared_data_folder() / "mesh/stanford_bunny_scans";
  if (!exists(folder / "bun.conf"))
    GTEST_SKIP() << "there are no scans in " << folder << "; set GROUNDRAY_SHARED_DATA";
  std::vector<ScanMesh> scans;
  for (const auto& [name, X_WS] : poses_of(folder / "bun.conf")) {
    const OrganisedScan scan =
        parse_range_grid(read_gzip(folder / (name + ".gz")), name, {.sd_m = 0.0001f});
    scans.push_back(link(place(scan, X_WS), ScreeningLimits::object()));
  }
  ASSERT_EQ(scans.size(), 10u);
  const std::clock_t begin = std::clock();
  const MergedMesh merged = merge(scans, {.apart_m = 0.001});
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  RecordProperty("cpu_s", std::to_string(cpu_s));
  EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());

  const TemporaryFolder made_here;
  std::ofstream(made_here / "bunny.ply", std::ios::binary)
      << read_gzip(folder / "bun_zipper.ply.gz");
  const TriangleMesh bunny = read_mesh(made_here / "bunny.ply").mesh;
  const DistanceBins bins{.width_m = 1e-5, .count = 200};
  const MeanDistance forth = MeshDistance(merged.mesh.shape, bunny).mean(0.001, bins);
  const MeanDistance back = MeshDistance(bunny, merged.mesh.shape).mean(0.001, bins);
  EXPECT_LE(median_m(forth, bins.width_m), 0.0006);
  EXPECT_LE(median_m(forth, bins.width_m),
            0.00005);  // as measured: the noise of one scan is twice that
  EXPECT_LE(forth.rms.value_m, 0.0001);
  EXPECT_GE(share_within(back, 0.0005, bins.width_m), 0.995);
  EXPECT_GE(share_within(back, 0.001, bins.width_m), 0.999);
  // No surface is doubled: the zippered mesh and this one both lack only what no scan saw.
  EXPECT_NEAR(forth.area_m2, back.area_m2, 0.015 * back.area_m2);
  record_margin("median from the merged to the zippered bunny", median_m(forth, bins.width_m) * 1e3,
                0.6, "mm");
  record_margin("of the zippered bunny farther than 0.5 mm from the merged",
                1 - share_within(back, 0.0005, bins.width_m), 0.005);
  record_margin("of the zippered bunny farther than 1 mm from the merged",
                1 - share_within(back, 0.001, bins.width_m), 0.001);
  record_margin("area of the merged bunny against the zippered", forth.area_m2 / back.area_m2 - 1,
                0.015);
}

}  // namespace
}  // namespace groundray::mesh_merge_proof_test
