#pragma once
// Embree 3 and 4 behind one face: handles that release themselves, and single-ray queries.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <immintrin.h>

#include <memory>
#include <type_traits>

namespace drench::render {

/// Denormals to zero while a tile is rendered: Embree asks for it, and it is per thread.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

template <class Handle, void (*release)(Handle)>
struct EmbreeRelease {
  void operator()(std::remove_pointer_t<Handle>* handle) const { release(handle); }
};
using EmbreeDevice =
    std::unique_ptr<std::remove_pointer_t<RTCDevice>, EmbreeRelease<RTCDevice, rtcReleaseDevice>>;
using EmbreeScene =
    std::unique_ptr<std::remove_pointer_t<RTCScene>, EmbreeRelease<RTCScene, rtcReleaseScene>>;
using EmbreeGeometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>,
                                       EmbreeRelease<RTCGeometry, rtcReleaseGeometry>>;

enum class Coherence { coherent, incoherent };

#if RTC_VERSION_MAJOR >= 4
inline void embree_intersect(RTCScene scene, RTCRayHit& ray, Coherence coherence) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherence == Coherence::coherent ? RTC_RAY_QUERY_FLAG_COHERENT
                                                     : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcIntersect1(scene, &ray, &arguments);
}
inline void embree_occluded(RTCScene scene, RTCRay& ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  rtcOccluded1(scene, &ray, &arguments);
}
#else
inline void embree_intersect(RTCScene scene, RTCRayHit& ray, Coherence coherence) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                   : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect1(scene, &context, &ray);
}
inline void embree_occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
#endif

}  // namespace drench::render
