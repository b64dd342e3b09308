#pragma once
// Cloth that is wet in parts too small to see: a share of it is as dry, the rest as if soaked, with
// the colours of wet_cloth.h under a film of water on both sides. Two lobes for the loop: what is
// soft, the dry and the wet sheet, and what glints, the film.

#include <array>
#include <optional>

#include "render/bsdf_coated.h"
#include "render/wet_cloth.h"

namespace drench {

/// What fabric is at a point. The wet colours and the film need not be filled in where it is dry.
struct FabricPoint {
  SheetColours dry, wet;
  float wetness = 0;
  float film_alpha = 0, film_eta = 1;  // eta: the liquid's index over that of what lies on it
  const AlbedoTable* film = nullptr;   // of that alpha and eta
};

/// Several densities as one: a lobe is chosen by `share`, and a sample weighed by the sum of all.
template <class Value>
Scatter weigh(const V3f& direction, const Value& value) {
  Scatter out;
  out.direction = direction;
  const V3f sum = value(direction, out.pdf);
  if (out.pdf > 0) out.weight = sum * (1 / out.pdf);
  return out;
}

/// Which of several things with these shares, that sum to 1, a number falls on; the number is left
/// uniform over it.
template <size_t n>
size_t choose(const std::array<float, n>& share, float& u) {
  size_t last = 0;
  for (size_t k = 0; k < n; ++k) {
    if (share[k] == 0) continue;
    last = k;
    if (u < share[k]) break;
    if (k + 1 < n) u -= share[k];
  }
  u = std::clamp(u / share[last], 0.f, kOneMinusEpsilon);
  return last;
}

class FabricBsdf {
 public:
  /// The sheet itself, dry and wet, seen from `outgoing`.
  class Soft {
   public:
    V3f value(const V3f& incoming, float& pdf) const {
      V3f sum = dry_.value(incoming, pdf) * (1 - wetness_);
      pdf *= share_[0];
      if (wet_) {
        float wet_pdf = 0;
        sum += wet_->value(incoming, wet_pdf) * wetness_;
        pdf += wet_pdf * share_[1];
      }
      pdf *= of_all_;
      return sum;
    }

    Scatter sample(V2f u) const {
      const size_t lobe = choose(share_, u.x);
      const Scatter drawn = lobe == 0 ? dry_.sample(u) : wet_->sample(u);
      if (!(drawn.pdf > 0)) return {};
      return weigh(drawn.direction, [&](const V3f& d, float& pdf) { return value(d, pdf); });
    }

    /// Adds pi times the radiance that leaves.
    void receive(Irradiance& light, const V3f& incoming, const V3f& power) const {
      Irradiance dry, wet;
      dry_.receive(dry, incoming, power);
      V3f radiance = dry_.radiance(dry) * (1 - wetness_);
      if (wet_) {
        wet_->receive(wet, incoming, power);
        radiance += wet_->radiance(wet) * wetness_;
      }
      light.front += radiance * kPi;
    }
    V3f radiance(const Irradiance& light) const { return light.front * (1 / kPi); }

   private:
    friend class FabricBsdf;
    explicit Soft(const ClothBsdf& dry) : dry_(dry) {}

    ClothBsdf dry_;
    std::optional<CoatedBase> wet_;
    float wetness_ = 0, of_all_ = 1;
    std::array<float, 2> share_{1, 0};  // of the dry sheet, the wet one
  };

  /// The film.
  class Glints {
   public:
    V3f value(const V3f& incoming, float& pdf) const {
      pdf = 0;
      if (!film_) return V3f(0);
      return film_->value(incoming, pdf) * wetness_;
    }

    Scatter sample(const V2f& u) const {
      if (!film_) return {};
      Scatter out = film_->sample(u);
      out.weight *= wetness_;
      return out;
    }

   private:
    friend class FabricBsdf;
    std::optional<CoatLobe> film_;
    float wetness_ = 0;
  };

  /// @param outgoing  unit, away from the surface; normals unit and of the same hemisphere
  FabricBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading,
             const FabricPoint& point)
      : soft_(ClothBsdf(outgoing, geometric, shading, point.dry.reflectance,
                        point.dry.transmittance)) {
    const float wetness = point.wetness;
    albedo_ = soft_.dry_.albedo() * (1 - wetness);
    if (!(wetness > 0)) return;
    const CoatedBsdf wet(outgoing, geometric, shading, point.film_alpha, point.film_eta,
                         point.wet.reflectance, *point.film, point.wet.transmittance);
    const float dry_share = largest(albedo_),
                wet_share = std::max(largest(wet.albedo()) - wet.reflected(), 0.f) * wetness;
    albedo_ += wet.albedo() * wetness;
    const float soft = dry_share + wet_share;
    // A film reflects little, but what it shows are lamps.
    const float film = std::max(wet.reflected(), soft * kFilmLooks) * wetness;
    glint_share_ = wet.reflected() > 0 ? film / (film + soft) : 0;
    if (soft > 0) soft_.share_ = {dry_share / soft, wet_share / soft};
    soft_.of_all_ = 1 - glint_share_;
    soft_.wetness_ = glints_.wetness_ = wetness;
    soft_.wet_.emplace(wet.base(1));
    if (glint_share_ > 0) glints_.film_.emplace(wet.coat(glint_share_));
  }

  V3f albedo() const { return albedo_; }
  /// The chance that the loop samples the glints.
  float glint_share() const { return glint_share_; }
  const Soft& soft() const { return soft_; }
  const Glints& glints() const { return glints_; }

 private:
  static constexpr float kFilmLooks = 1.f / 3;  // of what is soft, where all is wet

  Soft soft_;
  Glints glints_;
  V3f albedo_;
  float glint_share_ = 0;
};

}  // namespace drench
