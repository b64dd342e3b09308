#pragma once
// Whether a ray meets a box.

#include <Imath/ImathBox.h>
#include <immintrin.h>

#include "render/packed.h"

namespace drench::render {

/// The slab test of a ray against boxes, grown by its own rounding: x, y, z and z again as a pack.
class BoxTest {
 public:
  BoxTest(const V3f& origin, const V3f& direction)
      : origin_(load(origin)), inverse_(_mm_div_ps(_mm_set1_ps(1), load(direction))) {}

  bool meets(const Imath::Box3f& box, float reach) const {
    const __m128 a = along(box.min), b = along(box.max), whole = _mm_set1_ps(reach);
    // 0 x infinity: the ray runs in the plane of a side, which does not bound it.
    const __m128 bounded = _mm_cmpord_ps(a, b);
    __m128 near = _mm_and_ps(_mm_min_ps(a, b), bounded);
    __m128 far = _mm_blendv_ps(whole, _mm_min_ps(_mm_max_ps(a, b), whole), bounded);
    near = _mm_max_ps(near, _mm_movehl_ps(near, near));
    near = _mm_max_ss(near, _mm_movehdup_ps(near));
    far = _mm_min_ps(far, _mm_movehl_ps(far, far));
    far = _mm_min_ss(far, _mm_movehdup_ps(far));
    return std::max(_mm_cvtss_f32(near), 0.f) <= _mm_cvtss_f32(far) * (1 + 8 * 0x1p-24f);
  }

 private:
  static __m128 pack(const V3f& v) { return _mm_setr_ps(v.x, v.y, v.z, v.z); }
  /// Of a ray, which was written just now (Packed::store).
  static __m128 load(const V3f& v) {
    const __m128 lanes = Packed::load(v).lanes;
    return _mm_shuffle_ps(lanes, lanes, _MM_SHUFFLE(2, 2, 1, 0));
  }
  __m128 along(const V3f& corner) const {
    return _mm_mul_ps(_mm_sub_ps(pack(corner), origin_), inverse_);
  }

  __m128 origin_, inverse_;
};

}  // namespace drench::render
