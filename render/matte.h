#pragma once
// A film that goes over a filmed plate: what of the plate shows, and shadow catchers.
//
// A plate P stands for what the camera sees unhindered, or through smooth water and glass, of a
// clear background, of holdouts and of shadow catchers. Of a pixel's camera samples let
//   b  be the mean share of light that comes from the background and holdouts: 1 where nothing is
//      before them, less, by colour, through water;
//   c  the same of shadow catchers;
//   W  what catchers send to the camera with all objects in place;
//   O  what they would send in the plate's world: lights, catchers and holdouts alone;
//   R  the rest of the picture.
// Then, with the pixel's means of W and O,
//   s       = min(1, W_r / O_r, W_g / O_g, W_b / O_b)     (a colour without light there is left
//   out) beauty  = R + W - s O,  which no W and O make negative opacity = 1 - b - s c,  by colour,
//   and alpha its mean over the colours,
// so that beauty + (1 - alpha) P dims the plate where objects take light away, and adds what they
// bring (caustics, bounces, the colour of a shadow) as the catcher's material shows it. Over P = O
// where a catcher is, the sum is R + W: the picture itself, colour by colour.
//
// A ratio of means is biased as one over the number of samples. W and O share theirs: where objects
// change nothing they have the same bits, and s is 1.

#include <functional>
#include <vector>

#include "render/denoise.h"
#include "render/pixel_sum.h"

namespace drench {

/// What one camera sample met of the plate, shares of light by colour.
struct MatteRecord {
  V3f background{0, 0, 0}, catcher{0, 0, 0};  // b, c
  V3f with{0, 0, 0}, without{0, 0, 0};        // W, O in W/(sr m^2)
  std::vector<V3f> light;                     // W of each group of lights; empty: not asked for
};

/// Adds up samples of the plate, what of them is needed: 300 bytes a pixel for shadow catchers, and
/// as many for shares of light that the denoiser is to smooth.
class PlateFilm {
 public:
  /// @param catchers  pixels; 0: the scene has no shadow catchers
  /// @param shares    pixels; 0: b and c stay as they are
  PlateFilm(size_t catchers, size_t shares)
      : with_(catchers), without_(catchers), background_(shares), caught_(shares) {}

  bool has_catchers() const { return !with_.empty(); }
  bool has_shares() const { return !background_.empty(); }
  /// Every sample of the picture, in order.
  void add(size_t pixel, const MatteRecord& record) {
    if (has_catchers()) {
      with_[pixel].add(record.with, 0);
      without_[pixel].add(record.without, mean(record.catcher));
    }
    if (!has_shares()) return;
    background_[pixel].add(record.background, 0);
    caught_[pixel].add(record.catcher, 0);
  }
  /// s of a pixel.
  float light_left(size_t pixel) const {
    if (!has_catchers()) return 1;
    return smooth_.empty() ? dimmest(pixel).left : smooth_[pixel];
  }
  /// What smoothing adds to b + s c.
  V3f more_plate(size_t pixel) const {
    if (smooth_plate_.empty()) return V3f(0);
    const V3f smooth(smooth_plate_[0][pixel], smooth_plate_[1][pixel], smooth_plate_[2][pixel]);
    return smooth - mean_of(plate(pixel));
  }
  /// W and W - s O of a pixel's means.
  V3f with(size_t pixel) const { return mean_of(with_[pixel]); }
  V3f added(size_t pixel) const {
    return with(pixel) - mean_of(without_[pixel]) * light_left(pixel);
  }
  /// R + W - s O and alpha of each pixel. @param all  sums of R + W and 1 - b
  std::vector<PixelSum> beauty(const std::vector<PixelSum>& all) const;

  /// s as a picture of three equal colours, and b + s c with the s that is known by then, for the
  /// denoiser.
  NoisyPicture shadows(int width, int height) const;
  NoisyPicture shares(int width, int height) const;
  /// Puts a smoother s in its place. What is 1 without noise stays 1 to the bit.
  void smooth_shadows(NoisyPicture::Plane light_left);
  /// The same for b + s c. @param seen  whether a pixel has anything but the plate; else it stays
  void smooth_shares(std::vector<NoisyPicture::Plane> smooth,
                     const std::function<bool(size_t)>& seen);

 private:
  static float mean(const V3f& v) { return (v.x + v.y + v.z) / 3; }
  static V3f mean_of(const PixelSum& sum) { return {sum.mean(0), sum.mean(1), sum.mean(2)}; }
  /// s, and the colour that has it.
  struct Dimmest {
    float left = 1;
    int colour = 0;
  };
  Dimmest dimmest(size_t pixel) const {
    Dimmest out;
    for (int c = 0; c < 3; ++c) {
      const float without = without_[pixel].mean(c);
      if (without > 0 && with_[pixel].mean(c) < out.left * without)
        out = {with_[pixel].mean(c) / without, c};
    }
    return out;
  }

  PixelSum plate(size_t pixel) const {
    return background_[pixel].less(caught_[pixel], -light_left(pixel));
  }

  std::vector<PixelSum> with_, without_, background_, caught_;
  NoisyPicture::Plane smooth_;
  std::vector<NoisyPicture::Plane> smooth_plate_;
};

}  // namespace drench
