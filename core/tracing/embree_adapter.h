#pragma once

// All includes of Embree, and all differences between Embree 3.13 and Embree 4, are in this file.
// GROUNDRAY_EMBREE, the major version, comes with the CMake target embree.
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

/// Deleter for Embree's objects.
struct Release {
  void operator()(RTCScene scene) const noexcept { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const noexcept { rtcReleaseGeometry(geometry); }
  void operator()(RTCBuffer buffer) const noexcept { rtcReleaseBuffer(buffer); }
};
/// Owner of an RTCScene, RTCGeometry or RTCBuffer.
template <typename T>
using Owned = std::unique_ptr<std::remove_pointer_t<T>, Release>;

/// Embree's struct for packets of W rays: 1, 4, 8 or 16.
template <int W>
using PacketOf = std::conditional_t<
    W == 1, RTCRayHit,
    std::conditional_t<W == 4, RTCRayHit4, std::conditional_t<W == 8, RTCRayHit8, RTCRayHit16>>>;

/// Similarity of neighbouring rays in a packet. Coherent traversal is several times as fast if they
/// are similar.
enum class Coherence { Coherent, Incoherent };

/// Intersects the lanes of a packet whose `valid` is -1 with a scene; callbacks of user geometry
/// receive `context`.
template <int W>
void intersect(RTCScene scene, const int* valid, PacketOf<W>& packet, QueryContext& context,
               Coherence coherence) noexcept {
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

/// Scope guard that makes the thread treat denormals as zero, as Embree's traversal requires.
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
