#pragma once
// How much light a rough surface returns after one facet, by the angle it is seen at. Light that
// facets send into others is what is missing; it is given back in proportion to the lobes that are
// there (Turquin 2019, "Practical Multiple Scattering Compensation for Microfacet Models"), so that
// what absorbs nothing returns all. A table is of one roughness and one index, made by quadrature
// when the frame starts, so that nothing is fitted and only the angle is interpolated.

#include <array>

namespace drench::render {

class AlbedoTable {
 public:
  struct Albedo {
    float reflected = 0, total = 1;  // of single scattering; total with what is refracted
  };

  /// @param cos  of the direction that light leaves by, 0..1
  Albedo at(float cos) const;
  /// Means over light from everywhere on this side: of reflected / total, and of total.
  float mean_reflected() const { return mean_reflected_; }
  float mean_total() const { return mean_total_; }

  /// Between dielectrics. @param eta  index beyond over index before; alpha 0 is smooth
  static AlbedoTable dielectric(float alpha, float eta);
  /// Of facets that reflect everything.
  static AlbedoTable mirrors(float alpha);

 private:
  static constexpr int nodes = 128;  // over the root of the cosine, finer where facets are grazed

  template <class Fresnel>
  static AlbedoTable integrate(float alpha, float eta, const Fresnel& fresnel);

  std::array<Albedo, nodes + 1> albedo_;
  float mean_reflected_ = 0, mean_total_ = 1;
};

}  // namespace drench::render
