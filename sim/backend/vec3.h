#pragma once
// The least three-vector, generic because T is a float on a GPU thread and a pack on a CPU core.

#include "sim/backend/backend.h"
#include "sim/backend/pack.h"

namespace drench::sim::DRENCH_BACKEND {

template <class T>
struct Vec3 {
  T x, y, z;
  friend DRENCH_HD Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend DRENCH_HD Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend DRENCH_HD Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend DRENCH_HD Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend DRENCH_HD Vec3 operator*(T s, Vec3 a) { return a * s; }
};

template <class T>
DRENCH_HD T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
DRENCH_HD Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
DRENCH_HD T length2(Vec3<T> a) {
  return dot(a, a);
}
DRENCH_HD float length(Vec3<float> a) { return sqrtf(length2(a)); }
DRENCH_HD double length(Vec3<double> a) { return ::sqrt(length2(a)); }
template <class M, class T>
DRENCH_HD Vec3<T> select(M mask, Vec3<T> a, Vec3<T> b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
DRENCH_HD Vec3<double> to_double(Vec3<float> a) { return {a.x, a.y, a.z}; }
DRENCH_HD Vec3<float> to_float(Vec3<double> a) { return {float(a.x), float(a.y), float(a.z)}; }

/// exp(-x) for x >= 0 by squaring a short series three times: within 1e-6 for x up to 1.
template <class T>
DRENCH_HD T decay(T x) {
  const T y = x * T(0.125f);
  T e = T(1.f) / (T(1.f) + y * (T(1.f) + y * (T(0.5f) + y * T(1.f / 6))));
  e = e * e;
  e = e * e;
  return e * e;
}

/// Three columns read as one vector. A view: it does not own them.
struct ConstVecView {
  const float *x, *y, *z;
  DRENCH_HD Vec3<float> operator[](int i) const { return {x[i], y[i], z[i]}; }
  /// The same for an index of any kind: int, eight consecutive, eight arbitrary.
  template <class Index>
  DRENCH_HD auto at(Index i) const {
    return Vec3<decltype(load(x, i))>{load(x, i), load(y, i), load(z, i)};
  }
};

/// Three columns that are written, too.
struct VecView {
  float *x, *y, *z;
  DRENCH_HD operator ConstVecView() const { return {x, y, z}; }
  DRENCH_HD Vec3<float> operator[](int i) const { return {x[i], y[i], z[i]}; }
  DRENCH_HD void set(int i, Vec3<float> a) const { x[i] = a.x, y[i] = a.y, z[i] = a.z; }
  template <class Index>
  DRENCH_HD auto at(Index i) const {
    return ConstVecView(*this).at(i);
  }
  template <class Index, class T>
  DRENCH_HD void put(Index i, Vec3<T> a) const {
    store(x, i, a.x), store(y, i, a.y), store(z, i, a.z);
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
