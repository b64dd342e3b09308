#pragma once
// A film that goes over a filmed plate: what of the plate shows, and shadow catchers.
//
// A plate P stands for what the camera sees unhindered, or through smooth water and glass, of a
// clear background, of holdouts and of shadow catchers. Of a pixel's camera samples let
//   b  be the mean fraction of light from the background and holdouts: 1 where nothing is before
//      them, less, by colour, through water;
//   c  the same of shadow catchers;
//   W  what catchers send to the camera with all objects in place;
//   O  what they would send in the plate's world: lights, catchers and holdouts alone;
//   R  the rest of the picture.
// Then by colour, with the pixel's means of W and O,
//   s       = min(1, W / O)         (1 where O is 0)
//   beauty  = R + W - s O = R + max(0, W - O)
//   opacity = 1 - b - s c,          and alpha is its mean over the colours,
// so that beauty + (1 - opacity) P dims the plate where objects take light away, and adds what they
// bring beyond that (caustics, bounces) as the catcher's material shows it. Over P = O where a
// catcher is, the sum is R + W: the picture itself. With alpha in place of opacity what is coloured
// of shadows and of clear water is lost, not their brightness.
//
// A ratio of means is biased as one over the number of samples. W and O have the same samples:
// where objects change nothing they have the same bits, and s is 1.

#include <algorithm>
#include <functional>
#include <vector>

#include "render/film/checkpoint_archive.h"
#include "render/film/noisy_picture.h"
#include "render/film/path_record.h"
#include "render/film/pixel_sum.h"

namespace drench::render {

/// Adds up samples of the plate, what of them is needed: 150 bytes a pixel each of W, O and c for
/// shadow catchers, of b and c for fractions of light that the denoiser is to smooth.
class PlateFilm {
 public:
  /// @param catchers  pixels; 0: the scene has no shadow catchers
  /// @param coverage  pixels; 0: b and c stay as they are
  PlateFilm(size_t catchers, size_t coverage)
      : with_(catchers),
        without_(catchers),
        caught_(std::max(catchers, coverage)),
        background_(coverage) {}

  bool has_catchers() const { return !with_.empty(); }
  bool has_coverage() const { return !background_.empty(); }
  /// Before it is smoothed.
  void archive(CheckpointArchive& file) {
    for (std::vector<PixelSum>* sums : {&with_, &without_, &caught_, &background_})
      file.column(*sums);
  }
  /// Every sample of the picture, in order.
  void add(size_t pixel, const MatteRecord& record) {
    if (has_catchers()) {
      with_[pixel].add(record.with, 0);
      without_[pixel].add(record.without, 0);
    }
    if (has_coverage()) background_[pixel].add(record.background, 0);
    if (!caught_.empty()) caught_[pixel].add(record.catcher, 0);
  }
  /// W and W - s O of a pixel's means.
  V3f with(size_t pixel) const { return mean_of(with_[pixel]); }
  V3f added(size_t pixel) const {
    return with(pixel) - mean_of(without_[pixel]) * shadow_ratio(pixel);
  }
  /// s c of a pixel, with what smoothing adds to b + s c.
  V3f seen(size_t pixel) const;
  /// R + W - s O of each pixel. @param all  sums of R + W
  std::vector<PixelSum> beauty(const std::vector<PixelSum>& all) const;

  /// s as a picture, and b + s c with the s that is known by then, for the denoiser.
  NoisyPicture shadows(int width, int height) const;
  NoisyPicture coverage(int width, int height) const;
  /// Puts a smoother s in its place. What is 1 without noise stays 1 to the bit.
  void smooth_shadows(std::vector<NoisyPicture::Plane> smooth);
  /// The same for b + s c. @param objects  whether a pixel has anything but the plate; else it
  /// stays
  void smooth_coverage(std::vector<NoisyPicture::Plane> smooth,
                       const std::function<bool(size_t)>& objects);

 private:
  static V3f mean_of(const PixelSum& sum) { return {sum.mean(0), sum.mean(1), sum.mean(2)}; }
  static V3f at(const std::vector<NoisyPicture::Plane>& colours, size_t pixel) {
    return {colours[0][pixel], colours[1][pixel], colours[2][pixel]};
  }
  /// s of a pixel, as its samples have it and as it is used.
  V3f noisy_shadow_ratio(size_t pixel) const;
  V3f shadow_ratio(size_t pixel) const;
  PixelSum plate(size_t pixel) const {
    return background_[pixel].less(caught_[pixel], -shadow_ratio(pixel));
  }

  std::vector<PixelSum> with_, without_, caught_, background_;
  std::vector<NoisyPicture::Plane> smooth_shadows_, smooth_plate_;
};

}  // namespace drench::render
