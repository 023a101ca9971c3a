#include "test/benchmark/raw_embree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "core/tracing/embree_adapter.h"

namespace groundray::benchmark {

template <int W>
struct Packets {
  using RayHit = PacketOf<W>;

  std::vector<RayHit> filled;

  void fill(std::span<const Ray> rays) {
    filled.resize((rays.size() + W - 1) / W);
    for (std::size_t i = 0; i < filled.size() * W; ++i) {
      const Ray& ray = rays[std::min(i, rays.size() - 1)];
      auto& [out, hit] = filled[i / W];
      const std::size_t lane = i % W;
      out.org_x[lane] = static_cast<float>(ray.origin.x);
      out.org_y[lane] = static_cast<float>(ray.origin.y);
      out.org_z[lane] = static_cast<float>(ray.origin.z);
      out.dir_x[lane] = static_cast<float>(ray.direction.x);
      out.dir_y[lane] = static_cast<float>(ray.direction.y);
      out.dir_z[lane] = static_cast<float>(ray.direction.z);
      out.tnear[lane] = 0;
      out.tfar[lane] = static_cast<float>(ray.far_m);
      out.time[lane] = 0;
      out.mask[lane] = ~0u;
      out.id[lane] = 0;
      out.flags[lane] = 0;
      hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  void trace(RTCScene scene, std::vector<float>& ranges_m) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, filled.size(), 512), [&](const auto& range) {
          const FlushDenormals flush;
          alignas(64) int valid[W];
          std::fill_n(valid, W, -1);
          QueryContext context;
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            RayHit packet = filled[i];
            intersect<W>(scene, valid, packet, context, Coherence::Coherent);
            for (std::size_t lane = 0; lane < W && i * W + lane < ranges_m.size(); ++lane) {
              ranges_m[i * W + lane] = packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID
                                           ? std::numeric_limits<float>::infinity()
                                           : packet.ray.tfar[lane];
            }
          }
        });
  }
};

struct RawEmbree::Impl {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  bool wide = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  Packets<8> eights;
  Packets<16> sixteens;
  std::vector<float> ranges_m;
};

RawEmbree::RawEmbree(const HeightGrid& grid, std::span<const Ray> rays)
    : impl_(std::make_unique<Impl>()) {
  constexpr int tile_cells = 64;
  const std::size_t samples = grid.heights_m().size();
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_GRID);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), samples));
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const glm::dvec2 p = grid.origin_m() + glm::dvec2(column, row) * grid.step_m();
      *vertex++ = static_cast<float>(p.x);
      *vertex++ = static_cast<float>(p.y);
      *vertex++ = grid.height_m(column, row);
    }
  }
  std::vector<RTCGrid> tiles;
  const auto count = [](int first, int end) {
    return static_cast<unsigned short>(std::min(tile_cells + 1, end - first));
  };
  for (int row = 0; row < grid.rows() - 1; row += tile_cells) {
    for (int column = 0; column < grid.columns() - 1; column += tile_cells) {
      tiles.push_back({static_cast<unsigned>(row * grid.columns() + column),
                       static_cast<unsigned>(grid.columns()), count(column, grid.columns()),
                       count(row, grid.rows())});
    }
  }
  std::ranges::copy(tiles, static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
                               geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid),
                               tiles.size())));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(impl_->scene);
  impl_->ranges_m.resize(rays.size());
  if (impl_->wide) {
    impl_->sixteens.fill(rays);
  } else {
    impl_->eights.fill(rays);
  }
}

RawEmbree::~RawEmbree() {
  rtcReleaseScene(impl_->scene);
  rtcReleaseDevice(impl_->device);
}

std::span<const float> RawEmbree::trace() {
  if (impl_->wide) {
    impl_->sixteens.trace(impl_->scene, impl_->ranges_m);
  } else {
    impl_->eights.trace(impl_->scene, impl_->ranges_m);
  }
  return impl_->ranges_m;
}

}  // namespace groundray::benchmark
