#pragma once

// The one place that includes Embree, and that knows what differs between Embree 3.13 and Embree 4.
#if GROUNDRAY_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <immintrin.h>

#include <memory>
#include <type_traits>

namespace groundray {

#if GROUNDRAY_EMBREE >= 4
using QueryContext = RTCRayQueryContext;
#else
using QueryContext = RTCIntersectContext;
#endif

/// Gives Embree's objects back.
struct Release {
  void operator()(RTCScene scene) const noexcept { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const noexcept { rtcReleaseGeometry(geometry); }
  void operator()(RTCBuffer buffer) const noexcept { rtcReleaseBuffer(buffer); }
};
/// Owns an RTCScene, RTCGeometry or RTCBuffer.
template <typename T>
using Owned = std::unique_ptr<std::remove_pointer_t<T>, Release>;

/// Embree's struct for packets of W rays, as PacketOf<W>::Type.
template <int W>
struct PacketOf;
template <>
struct PacketOf<1> {
  using Type = RTCRayHit;
};
template <>
struct PacketOf<4> {
  using Type = RTCRayHit4;
};
template <>
struct PacketOf<8> {
  using Type = RTCRayHit8;
};
template <>
struct PacketOf<16> {
  using Type = RTCRayHit16;
};

/// Whether neighbours in a packet are alike; coherent packets trace several times as fast if they
/// are.
enum class Coherence { Coherent, Incoherent };

/// Intersects the lanes of a packet whose `valid` is -1 with a scene; `context` reaches the
/// callbacks of user geometry.
template <int W>
void intersect(RTCScene scene, const int* valid, typename PacketOf<W>::Type& packet,
               QueryContext& context, Coherence coherence) noexcept {
#if GROUNDRAY_EMBREE >= 4
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  arguments.flags = coherence == Coherence::Coherent ? RTC_RAY_QUERY_FLAG_COHERENT
                                                     : RTC_RAY_QUERY_FLAG_INCOHERENT;
  if constexpr (W == 1) rtcIntersect1(scene, &packet, &arguments);
  if constexpr (W == 4) rtcIntersect4(valid, scene, &packet, &arguments);
  if constexpr (W == 8) rtcIntersect8(valid, scene, &packet, &arguments);
  if constexpr (W == 16) rtcIntersect16(valid, scene, &packet, &arguments);
#else
  rtcInitIntersectContext(&context);
  context.flags = coherence == Coherence::Coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                   : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  if constexpr (W == 1) rtcIntersect1(scene, &context, &packet);
  if constexpr (W == 4) rtcIntersect4(valid, scene, &context, &packet);
  if constexpr (W == 8) rtcIntersect8(valid, scene, &context, &packet);
  if constexpr (W == 16) rtcIntersect16(valid, scene, &context, &packet);
#endif
  static_cast<void>(valid);
}

/// While one lives, its thread flushes denormals to zero as Embree's traversal wants it.
class FlushDenormals {
 public:
  FlushDenormals() noexcept : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }
  ~FlushDenormals() { _mm_setcsr(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned before_;
};

}  // namespace groundray
