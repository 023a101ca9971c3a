#include "reconstruction/mesh/manifold_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "test/support/scans/solid.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::manifold_mesh_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

TriangleMesh some_points(std::size_t count) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < count; ++i)
    mesh.vertices_m.emplace_back(static_cast<double>(i), static_cast<double>(i * i), 0);
  return mesh;
}

std::size_t boundaries_of(const SurfaceMesh& surface) {
  std::size_t count = 0;
  for (const auto h : surface.halfedges()) count += surface.is_boundary(h);
  return count;
}

// Expects what OpenMesh asks of a surface whose vertices have one fan each.
void expect_sound(const SurfaceMesh& surface) {
  for (const auto h : surface.halfedges()) {
    EXPECT_EQ(surface.prev_halfedge_handle(surface.next_halfedge_handle(h)), h);
    EXPECT_EQ(surface.to_vertex_handle(h),
              surface.from_vertex_handle(surface.next_halfedge_handle(h)));
    EXPECT_EQ(surface.face_handle(h), surface.face_handle(surface.next_halfedge_handle(h)));
  }
  std::vector<std::size_t> leaving(surface.n_vertices());
  for (const auto h : surface.halfedges()) ++leaving[number_of(surface.from_vertex_handle(h))];
  for (const auto vertex : surface.vertices()) {
    const auto h = surface.halfedge_handle(vertex);
    EXPECT_EQ(surface.from_vertex_handle(h), vertex);
    EXPECT_EQ(surface.valence(vertex), leaving[number_of(vertex)]);
    std::size_t borders = 0;
    for (const auto out : surface.voh_range(vertex)) borders += surface.is_boundary(out);
    EXPECT_EQ(borders, surface.is_boundary(h) ? 1u : 0u);
  }
}

TEST(ManifoldMesh, KeepsManifolds) {
  for (const TriangleMesh& mesh :
       {testing::icosphere(2, 3).mesh, testing::cylinder(1, 2, 12).mesh}) {
    const ManifoldMesh cut = cut_to_manifold(mesh);
    EXPECT_EQ(cut.shape.vertices_m, mesh.vertices_m);
    EXPECT_EQ(cut.shape.triangles, mesh.triangles);
    EXPECT_EQ(cut.tangled_edges + cut.dropped + cut.copies, 0u);
    EXPECT_EQ(boundaries_of(to_surface(cut.shape)), 0u);
  }
}

TEST(ManifoldMesh, SeparatesTrianglesThatTouchAtAPoint) {
  TriangleMesh mesh = some_points(5);
  mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.copies, 1u);
  EXPECT_EQ(cut.shape.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {5, 3, 4}}));
  EXPECT_EQ(cut.sources, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 2}));
}

TEST(ManifoldMesh, CutsWhereThreeTrianglesMeet) {
  TriangleMesh mesh = some_points(5);
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.tangled_edges, 1u);
  EXPECT_EQ(cut.shape.vertices_m.size(), 9u);
  EXPECT_EQ(testing::border_edges(cut.shape), 9u);
}

TEST(ManifoldMesh, CutsBetweenInconsistentlyWoundTriangles) {
  TriangleMesh mesh = some_points(4);
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.tangled_edges, 1u);
  EXPECT_EQ(testing::border_edges(cut.shape), 6u);
}

TEST(ManifoldMesh, DropsDegenerateAndRepeatedTriangles) {
  TriangleMesh mesh = some_points(4);
  mesh.triangles = {{0, 1, 2}, {1, 1, 2}, {1, 2, 0}, {2, 1, 3}, {3, 3, 3}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.dropped, 3u);
  EXPECT_EQ(cut.shape.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(cut.tangled_edges, 0u);
}

TEST(ManifoldMesh, IsASurfaceForAnyTriangles) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 3000; ++trial) {
    const auto vertices = 3 + random() % 8, triangles = random() % 14;
    TriangleMesh mesh = some_points(vertices);
    const auto any = [&] { return static_cast<unsigned>(random() % vertices); };
    for (std::size_t i = 0; i < triangles; ++i) {
      const unsigned a = any(), b = any();
      mesh.triangles.emplace_back(a, b, any());
    }
    const ManifoldMesh cut = cut_to_manifold(mesh);
    EXPECT_THAT(testing::surface_faults(cut.shape), IsEmpty()) << "trial " << trial;
    EXPECT_EQ(cut.shape.triangles.size() + cut.dropped, triangles);
    expect_sound(to_surface(cut.shape));
    std::set<std::uint32_t> used;
    for (const glm::uvec3& t : cut.shape.triangles) used.insert({t.x, t.y, t.z});
    EXPECT_EQ(used.size(), cut.shape.vertices_m.size());
    for (std::size_t i = 0; i < cut.sources.size(); ++i)
      EXPECT_EQ(cut.shape.vertices_m[i], mesh.vertices_m[cut.sources[i]]);
  }
}

TEST(ToSurface, KeepsNumbersAndJoinsEdgesThatRunInOppositeDirections) {
  const std::vector<glm::uvec3> triangles{{0, 1, 2}, {2, 1, 3}};
  const SurfaceMesh surface = to_surface(some_points(4).vertices_m, triangles);
  EXPECT_EQ(surface.n_edges(), 5u);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_EQ(corners_of(surface, i), triangles[i]);
    for (int k = 0; k < 3; ++k) {
      const auto h = half_edge_of(surface, i, k);
      EXPECT_EQ(number_of(surface.from_vertex_handle(h)), triangles[i][k]);
      EXPECT_EQ(number_of(surface.to_vertex_handle(h)), triangles[i][(k + 1) % 3]);
      const bool is_joint = k == (i == 0 ? 1 : 0);
      EXPECT_EQ(triangle_across(surface, h), is_joint ? 1 - i : none);
    }
  }
  expect_sound(surface);
}

TEST(ToSurface, TagsWhatIsNotManifold) {
  const auto tagged = [](const std::vector<glm::uvec3>& triangles) {
    const SurfaceMesh surface = to_surface(some_points(5).vertices_m, triangles);
    EXPECT_EQ(boundaries_of(surface), 3 * triangles.size());
    std::vector<std::uint32_t> begins;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        if (surface.status(half_edge_of(surface, i, k)).tagged()) begins.push_back(triangles[i][k]);
      }
    }
    return begins;
  };
  EXPECT_THAT(tagged({{0, 1, 2}, {1, 0, 3}, {1, 0, 4}}), ElementsAre(0, 1, 1));
  EXPECT_THAT(tagged({{0, 1, 2}, {0, 1, 3}}), ElementsAre(0, 0));
  EXPECT_THAT(tagged({{0, 1, 2}, {3, 3, 4}}), IsEmpty());
  const SurfaceMesh surface = to_surface(some_points(5).vertices_m,
                                         std::vector<glm::uvec3>{{0, 1, 2}, {3, 3, 4}, {1, 2, 0}});
  std::vector<bool> is_tagged;
  for (const auto triangle : surface.faces())
    is_tagged.push_back(surface.status(triangle).tagged());
  EXPECT_THAT(is_tagged, ElementsAre(false, true, true));
}

TEST(Pieces, AreConnectedByEdgesThatAreNotCut) {
  const SurfaceMesh surface =
      to_surface(some_points(9).vertices_m,
                 std::vector<glm::uvec3>{{0, 1, 2}, {4, 5, 6}, {2, 1, 3}, {6, 5, 7}, {0, 7, 8}});
  EXPECT_THAT(number_pieces(surface), ElementsAre(0, 1, 0, 1, 2));
  const auto begins_or_ends_at_1 = [&](SurfaceMesh::HalfedgeHandle h) {
    return number_of(surface.from_vertex_handle(h)) == 1 ||
           number_of(surface.to_vertex_handle(h)) == 1;
  };
  EXPECT_THAT(number_pieces(surface, begins_or_ends_at_1), ElementsAre(0, 1, 2, 1, 3));
  const Buckets pieces = pieces_of(surface);
  ASSERT_EQ(pieces.size(), 3u);
  EXPECT_THAT(pieces.at(1), ElementsAre(1, 3));
  EXPECT_EQ(pieces_of(SurfaceMesh()).size(), 0u);
}

TEST(DropConflicts, DropsLaterTrianglesAlongAnEdge) {
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 0, 3}, {1, 0, 4}, {5, 5, 6}};
  EXPECT_EQ(drop_conflicts(triangles, 7), 2u);
  EXPECT_THAT(triangles, ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(1, 0, 3)));
}

TEST(SeparateFans, GivesEachFanAVertex) {
  SurfaceMesh surface =
      to_surface(some_points(8).vertices_m,
                 std::vector<glm::uvec3>{{0, 1, 2}, {0, 3, 4}, {0, 5, 6}, {0, 2, 7}});
  EXPECT_EQ(separate_fans(surface), 2u);
  const std::vector<std::uint32_t> first{corners_of(surface, 0).x, corners_of(surface, 1).x,
                                         corners_of(surface, 2).x};
  EXPECT_THAT(first, UnorderedElementsAre(0, 8, 9));
  EXPECT_EQ(corners_of(surface, 3).x, first[0]);
  for (const std::uint32_t vertex : first) {
    EXPECT_EQ(source_of(surface, surface.vertex_handle(vertex)), 0u);
    EXPECT_EQ(surface.point(surface.vertex_handle(vertex)), glm::dvec3(0));
  }
  expect_sound(surface);
}

TEST(SeparateFans, CopiesWhatWasMeasured) {
  MeasuredMesh mesh{
      .shape = some_points(6), .sd_m = {0, 1, 2, 3, 4, 5}, .labels = {0, 1, 2, 3, 4, 5}};
  mesh.shape.triangles = {{1, 2, 3}, {3, 4, 5}};  // they touch at 3; nothing uses 0
  SurfaceMesh surface = to_surface(mesh);
  EXPECT_EQ(separate_fans(surface), 1u);
  surface.delete_isolated_vertices();
  const MeasuredMesh parted = remaining_measured_mesh(surface);
  EXPECT_THAT(parted.sd_m, ElementsAre(1, 2, 3, 4, 5, 3));
  EXPECT_THAT(parted.labels, ElementsAre(1, 2, 3, 4, 5, 3));
  EXPECT_TRUE(parted.confidence.empty());
  for (std::size_t i = 0; i < parted.sd_m.size(); ++i)
    EXPECT_EQ(parted.shape.vertices_m[i], mesh.shape.vertices_m[parted.labels[i]]);
  EXPECT_EQ(parted.shape.triangles.size(), 2u);
}

TEST(DropConflicts, AndSeparateFansMakeASurfaceOfAnyTriangles) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const unsigned vertices = 4 + static_cast<unsigned>(i) % 30;
    std::uniform_int_distribution<unsigned> any(0, vertices - 1);
    TriangleMesh mesh = some_points(vertices);
    for (int k = 0; k < 3 * i; ++k)
      mesh.triangles.emplace_back(any(random), any(random), any(random));
    const std::size_t before_it = mesh.triangles.size();
    const std::size_t dropped = drop_conflicts(mesh.triangles, vertices);
    EXPECT_EQ(mesh.triangles.size() + dropped, before_it);
    SurfaceMesh surface = to_surface(mesh);
    for (const auto h : surface.halfedges()) EXPECT_FALSE(surface.status(h).tagged());
    const std::size_t copies = separate_fans(surface);
    EXPECT_EQ(surface.n_vertices(), vertices + copies);
    for (const auto vertex : surface.vertices())
      EXPECT_EQ(surface.point(vertex), mesh.vertices_m[source_of(surface, vertex)]);
    const TriangleMesh parted = remaining_mesh(surface).mesh;
    EXPECT_THAT(testing::surface_faults(parted), IsEmpty());
    std::vector<glm::uvec3> triangles = parted.triangles;
    EXPECT_EQ(drop_conflicts(triangles, parted.vertices_m.size()), 0u);
  }
}

TEST(ManifoldMesh, EmptyMeshStaysEmpty) {
  const ManifoldMesh cut = cut_to_manifold(some_points(4));
  EXPECT_TRUE(cut.shape.vertices_m.empty());
  EXPECT_TRUE(cut.shape.triangles.empty());
}

}  // namespace
}  // namespace groundray::manifold_mesh_test
