#pragma once
// Cloth: a sheet that reflects and transmits diffusely, fuzz and yarns on both its faces, and water
// in it. All that lies on the sheet returns a fraction E of the light, by direction, and leaves the
// rest to it as a coat does (bsdf_coated.h): the sheet's value has the factor
//   (1 - E(o)) (1 - E(i)) / (1 - <E>),
// so that a white sheet returns what was left, all of it, and both directions are alike.
//
// Wet, cloth is wet in parts too small to see: a fraction of it is as dry, the rest as if soaked,
// with the colours of wet_cloth.h under a film of water on both faces and no fuzz or glint of its
// own.
//
// Two lobes for the loop: what is soft, sheets and fuzz, and what glints, yarns and the film.

#include <array>
#include <optional>

#include "render/bsdf/bsdf_coated.h"
#include "render/bsdf/sheen.h"
#include "render/bsdf/wet_cloth.h"
#include "render/bsdf/yarn.h"

namespace drench::render {

/// What fabric is at a point. What is absent (black, dry) needs no table.
struct FabricPoint {
  SheetColours dry, wet;
  float wetness = 0;
  float film_alpha = 0, film_eta = 1;  // eta: the liquid's index over that of what lies on it
  const AlbedoTable* film = nullptr;   // of that alpha and eta
  V3f sheen{0, 0, 0}, yarn{0, 0, 0};   // together at most 1
  const SheenTable* fuzz = nullptr;
  const YarnTable* yarns = nullptr;
  V3f along_u{0, 0, 0}, along_v{0, 0, 0};  // of warp and weft, any length
};

/// A sample of several lobes, drawn from one of them, weighed by the density of all.
template <class Value>
Scatter weigh(const V3f& direction, const Value& value) {
  Scatter out;
  out.direction = direction;
  const V3f sum = value(direction, out.pdf);
  if (out.pdf > 0) out.weight = sum * (1 / out.pdf);
  return out;
}

/// Which of several things, whose probabilities sum to 1, a number falls on; the number is left
/// uniform over it.
template <size_t n>
size_t choose(const std::array<float, n>& probability, float& u) {
  size_t last = 0;
  for (size_t k = 0; k < n; ++k) {
    if (probability[k] == 0) continue;
    last = k;
    if (u < probability[k]) break;
    if (k + 1 < n) u -= probability[k];
  }
  u = std::clamp(u / probability[last], 0.f, one_minus_epsilon);
  return last;
}

/// Fuzz and yarns on the side of the cloth that is seen, and what they leave on either.
class FabricTop {
 public:
  FabricTop(const V3f& outgoing, const FacingFrame& frame, const FabricPoint& point)
      : frame_(frame),
        point_(point),
        warp_(rotation_to(point.along_u, {1, 0})),
        weft_(rotation_to(point.along_v, {0, 1})),
        o_(frame.local(outgoing)) {
    // A normal that looks away is bent to a grazing view, and may be a rounding below it.
    o_.z = std::max(o_.z, 1e-6f);
    const V3f mean = point.sheen * (point.fuzz ? point.fuzz->mean() : 0) +
                     point.yarn * (point.yarns ? point.yarns->mean() : 0);
    seen_ = returned(o_);
    for (int c = 0; c < 3; ++c) entering_[c] = (1 - seen_[c]) / std::max(1 - mean[c], 1e-4f);
  }

  /// E of the direction that is looked from.
  const V3f& seen() const { return seen_; }
  V3f seen_sheen() const { return point_.fuzz ? point_.sheen * point_.fuzz->at(o_.z) : V3f(0); }
  V3f local(const V3f& direction) const { return frame_.local(direction); }
  V3f through(const V3f& i) const { return entering_ * (V3f(1) - returned(i)); }

  /// Whether a direction is on the side that is seen, by both normals.
  bool meets(const V3f& incoming, const V3f& i) const {
    return i.z > 0 && frame_.agrees(incoming, i.z);
  }
  V3f sheen_over_cos(const V3f& i) const {
    return point_.sheen * point_.fuzz->lobe().over_cos(o_, i);
  }
  V3f sheen_direction(const V2f& u) const { return frame_.basis.world(SheenLobe::sample(u)); }

  enum class Family { warp, weft };
  V3f yarn(Family family, const V3f& i, float& pdf) const {
    const V2f& rotation = family == Family::warp ? warp_ : weft_;
    return point_.yarn *
           (0.5f * point_.yarns->facets().value(rotated(o_, rotation), rotated(i, rotation), pdf));
  }
  V3f yarn_direction(Family family, const V2f& u) const {
    const V2f& rotation = family == Family::warp ? warp_ : weft_;
    const V3f i = point_.yarns->facets().sample(rotated(o_, rotation), u);
    return normalized(frame_.basis.world(rotated(i, {rotation.x, -rotation.y})));
  }

 private:
  /// Cosine and sine of a yarn in the surface, against the frame's x.
  V2f rotation_to(const V3f& along, const V2f& otherwise) const {
    const V2f flat(dot(along, frame_.basis.tangent), dot(along, frame_.basis.bitangent));
    const float square = flat.x * flat.x + flat.y * flat.y;
    return square > 0 ? flat * (1 / std::sqrt(square)) : otherwise;
  }
  static V3f rotated(const V3f& w, const V2f& rotation) {
    return {rotation.x * w.x + rotation.y * w.y, rotation.x * w.y - rotation.y * w.x, w.z};
  }
  V3f returned(const V3f& w) const {
    V3f out(0);
    if (point_.fuzz) out += point_.sheen * point_.fuzz->at(std::abs(w.z));
    if (point_.yarns)
      out += point_.yarn *
             (0.5f * (point_.yarns->at(rotated(w, warp_)) + point_.yarns->at(rotated(w, weft_))));
    return out;
  }

  FacingFrame frame_;
  FabricPoint point_;
  V2f warp_, weft_;
  V3f o_, seen_, entering_;
};

class FabricBsdf {
 public:
  /// Sheets, dry and wet, and fuzz.
  class Soft {
   public:
    V3f value(const V3f& incoming, float& pdf) const {
      V3f sum = dry_.value(incoming, pdf);
      pdf *= probability_[dry_lobe];
      if (top_) {
        const V3f i = top_->local(incoming);
        sum *= top_->through(i);
        if (probability_[fuzz_lobe] > 0 && top_->meets(incoming, i)) {
          sum += top_->sheen_over_cos(i) * i.z;
          pdf += probability_[fuzz_lobe] * SheenLobe::pdf();
        }
      }
      sum *= 1 - wetness_;
      if (wet_) {
        float wet_pdf = 0;
        sum += wet_->value(incoming, wet_pdf) * wetness_;
        pdf += wet_pdf * probability_[wet_lobe];
      }
      pdf *= group_probability_;
      return sum;
    }

    Scatter sample(V2f u) const {
      const size_t lobe = choose(probability_, u.x);
      V3f direction;
      if (lobe == fuzz_lobe) {
        direction = top_->sheen_direction(u);
      } else {
        const Scatter drawn = lobe == dry_lobe ? dry_.sample(u) : wet_->sample(u);
        if (!(drawn.pdf > 0)) return {};
        direction = drawn.direction;
      }
      return weigh(direction, [&](const V3f& d, float& pdf) { return value(d, pdf); });
    }

    /// Adds pi times the radiance that leaves.
    void receive(Irradiance& light, const V3f& incoming, const V3f& power) const {
      Irradiance dry, wet;
      dry_.receive(dry, incoming, power);
      V3f radiance = dry_.radiance(dry);
      if (top_) {
        const V3f i = top_->local(incoming);
        radiance *= top_->through(i);
        if (probability_[fuzz_lobe] > 0 && top_->meets(incoming, i))
          radiance += top_->sheen_over_cos(i) * power;
      }
      radiance *= 1 - wetness_;
      if (wet_) {
        wet_->receive(wet, incoming, power);
        radiance += wet_->radiance(wet) * wetness_;
      }
      light.front += radiance * pi;
    }
    V3f radiance(const Irradiance& light) const { return light.front * (1 / pi); }

   private:
    friend class FabricBsdf;
    enum Lobe : size_t { dry_lobe, fuzz_lobe, wet_lobe };
    explicit Soft(const ClothBsdf& dry) : dry_(dry) {}

    ClothBsdf dry_;
    std::optional<FabricTop> top_;
    std::optional<CoatedBase> wet_;
    float wetness_ = 0, group_probability_ = 1;
    std::array<float, 3> probability_{1, 0, 0};
  };

  /// Yarns and the film.
  class Glints {
   public:
    V3f value(const V3f& incoming, float& pdf) const {
      V3f sum(0);
      pdf = 0;
      if (probability_[warp_lobe] > 0) {
        const V3f i = top_->local(incoming);
        if (top_->meets(incoming, i)) {
          float warp = 0, weft = 0;
          sum = top_->yarn(FabricTop::Family::warp, i, warp) +
                top_->yarn(FabricTop::Family::weft, i, weft);
          sum *= 1 - wetness_;
          pdf = probability_[warp_lobe] * warp + probability_[weft_lobe] * weft;
        }
      }
      if (film_) {
        float film = 0;
        sum += film_->value(incoming, film) * wetness_;
        pdf += probability_[film_lobe] * film;
      }
      pdf *= group_probability_;
      return sum;
    }

    Scatter sample(V2f u) const {
      if (group_probability_ == 0) return {};
      const size_t lobe = choose(probability_, u.x);
      V3f direction;
      if (lobe == film_lobe) {
        const Scatter drawn = film_->sample(u);
        if (!(drawn.pdf > 0)) return {};
        direction = drawn.direction;
      } else {
        direction = top_->yarn_direction(
            lobe == warp_lobe ? FabricTop::Family::warp : FabricTop::Family::weft, u);
      }
      return weigh(direction, [&](const V3f& d, float& pdf) { return value(d, pdf); });
    }

   private:
    friend class FabricBsdf;
    enum Lobe : size_t { warp_lobe, weft_lobe, film_lobe };

    std::optional<FabricTop> top_;
    std::optional<CoatLobe> film_;
    float wetness_ = 0, group_probability_ = 0;
    std::array<float, 3> probability_{0, 0, 0};
  };

  /// @param outgoing  unit, away from the surface; normals unit and of the same hemisphere
  FabricBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading,
             const FabricPoint& point)
      : FabricBsdf(outgoing, FacingFrame(outgoing, geometric, shading), point) {}

  V3f albedo() const { return albedo_; }
  /// The probability of the loop sampling the glints.
  float glint_probability() const { return glints_.group_probability_; }
  const Soft& soft() const { return soft_; }
  const Glints& glints() const { return glints_; }

 private:
  static constexpr float film_sampling = 1.f / 3;  // of what is soft, where all is wet

  FabricBsdf(const V3f& outgoing, const FacingFrame& frame, const FabricPoint& point)
      : soft_(ClothBsdf(outgoing, frame.geometric, frame.basis.normal, point.dry.reflectance,
                        point.dry.transmittance)),
        albedo_(soft_.dry_.albedo()) {
    std::array<float, 3> soft{1, 0, 0}, glints{0, 0, 0};
    const float dry = 1 - point.wetness;
    if (point.fuzz || point.yarns) {
      const FabricTop& top = soft_.top_.emplace(outgoing, frame, point);
      glints_.top_.emplace(top);
      const V3f below = albedo_ * (V3f(1) - top.seen());
      soft = {largest(below) * dry, largest(top.seen_sheen()) * dry, 0};
      glints[0] = glints[1] = 0.5f * largest(top.seen() - top.seen_sheen()) * dry;
      albedo_ = top.seen() + below;
    } else {
      soft[0] = largest(albedo_) * dry;
    }
    albedo_ *= dry;
    if (point.wetness > 0) add_wet_lobes(outgoing, frame, point, soft, glints);
    set_probabilities(soft, glints);
  }

  /// Adds the lobes of the wet fraction.
  void add_wet_lobes(const V3f& outgoing, const FacingFrame& frame, const FabricPoint& point,
                     std::array<float, 3>& soft, std::array<float, 3>& glints) {
    const CoatedBsdf wet(outgoing, frame.geometric, frame.basis.normal, point.film_alpha,
                         point.film_eta, point.wet.reflectance, *point.film,
                         point.wet.transmittance);
    soft_.wetness_ = glints_.wetness_ = point.wetness;
    soft_.wet_.emplace(wet.base(1));
    albedo_ += wet.albedo() * point.wetness;
    soft[2] = std::max(largest(wet.albedo()) - wet.reflected(), 0.f) * point.wetness;
    if (!(wet.reflected() > 0)) return;  // within the very liquid
    glints_.film_.emplace(wet.coat(1));
    // A film reflects little, but what it shows are lamps.
    const float looks = (soft[0] + soft[1] + soft[2]) * film_sampling;
    glints[2] = std::max(wet.reflected(), looks) * point.wetness;
  }

  void set_probabilities(const std::array<float, 3>& soft, const std::array<float, 3>& glints) {
    const float all_soft = soft[0] + soft[1] + soft[2],
                all_glints = glints[0] + glints[1] + glints[2];
    if (all_soft > 0)
      for (size_t k = 0; k < 3; ++k) soft_.probability_[k] = soft[k] / all_soft;
    if (all_glints > 0) {
      for (size_t k = 0; k < 3; ++k) glints_.probability_[k] = glints[k] / all_glints;
      glints_.group_probability_ = all_glints / (all_glints + all_soft);
    }
    soft_.group_probability_ = 1 - glints_.group_probability_;
  }

  Soft soft_;
  Glints glints_;
  V3f albedo_;
};

}  // namespace drench::render
