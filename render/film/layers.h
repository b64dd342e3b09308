#pragma once
// The layers of a film besides its beauty: what each camera sample met, put together by pixel.

#include <string>
#include <vector>

#include "render/film/checkpoint_archive.h"
#include "render/film/cryptomatte.h"
#include "render/film/film.h"
#include "render/film/matte.h"
#include "render/film/noisy_picture.h"
#include "render/film/path_record.h"
#include "render/film/pixel_sum.h"
#include "render/scene/scene.h"

namespace drench::render {

/// Names without repetition, with a number for each of a list that may repeat them.
struct NameIndex {
  std::vector<std::string> name;
  std::vector<int> index;

  void add(const std::string& next);
};

/// Adds up what the path loop records.
class LayerFilm {
 public:
  /// @param scene          must outlive this
  /// @param width, height  of the part of the frame that is rendered
  LayerFilm(const Shot& shot, int frame, const Scene& scene, int width, int height);

  /// Whether camera samples must be recorded at all.
  bool records() const;
  /// A record to hand to the path loop, cleared.
  PathRecord blank() const;
  void clear(PathRecord& record) const;
  /// Adds a sample to a pixel, row by row from the top left.
  void add(size_t pixel, const PathRecord& record);
  void archive(CheckpointArchive& file);
  /// The finished layers, those that were asked for.
  std::vector<FilmLayer> finish(const std::vector<PixelSum>& pixels, const PlateFilm& plate) const;
  /// What guides the denoiser, with the variance of each: albedo, normal, nearness.
  void add_features(NoisyPicture& picture, const std::vector<PixelSum>& pixels) const;
  /// And where what is seen is in the frames before and after.
  void add_motion(NoisyPicture& picture) const;
  /// Whether a camera sample of a pixel met the ground or an object that is no matte.
  bool saw_something(size_t pixel) const { return pixel_[pixel].nearest.depth < no_depth; }
  /// Header entries that belong to them.
  std::vector<std::pair<std::string, std::string>> header() const;

 private:
  /// What is nearest to the camera in a pixel: depths of an edge's two sides must not be mixed.
  struct Nearest {
    float depth = no_depth;
    V3f position{0, 0, 0};
    V3f motion{0, 0, 0};  // to the next frame
  };
  static constexpr int no_object = -1;
  /// What most samples of a pixel see, by majority vote (Boyer and Moore 1991): a streak of spray
  /// that few see does not take along what lies behind.
  struct Usual {
    int object = no_object, votes = 0;
    V3f after{0, 0, 0}, before{0, 0, 0};  // motion to the frames beside
  };
  struct Pixel {
    V3f albedo{0, 0, 0}, normal{0, 0, 0};
    V3f albedo2{0, 0, 0}, normal2{0, 0, 0};  // sums of squares
    float inverse_depth = 0, inverse_depth2 = 0;
    Nearest nearest;
    Usual usual;
    CryptomattePixel object, material;
  };
  static constexpr float no_depth = 1e10f;

  void vote(Usual& usual, int object, const PathRecord& record) const;
  void add_light(size_t pixel, const PathRecord& record);
  Imath::V3d light(size_t pixel, size_t group, int samples, const PlateFilm& plate) const;
  V3f motion_of(const PathRecord& record, const CameraPose& eye, float frames) const;
  V3f motion_of_sky(size_t pixel, const CameraPose& eye) const;
  FilmLayer layer(const std::string& name, const std::vector<std::string>& channels,
                  FilmLayer::Precision precision) const;
  void add_matte(std::vector<FilmLayer>& out, const std::string& name, const NameIndex& things,
                 CryptomattePixel Pixel::*which, const std::vector<PixelSum>& pixels) const;

  const Scene* scene_;
  LayerSettings want_;
  bool features_;
  std::vector<std::string> groups_;  // of light, the last is photons'
  size_t shown_groups_ = 0;
  int width_, height_;
  V2i corner_;  // of the part in the frame, pixels
  double fps_;
  double shutter_open_, shutter_frames_;  // of all rows together
  ShutterCamera frame_camera_;            // at this frame and the next
  ShutterCamera before_camera_;           // at the frame before and this one
  NameIndex objects_, materials_;
  std::vector<Pixel> pixel_;
  std::vector<Imath::V3d> light_;       // by pixel, then group
  std::vector<Imath::V3d> caught_;      // that of shadow catchers in it; empty without any
  std::vector<Imath::V3d> background_;  // fractions of light from it; empty: not asked for
  bool catchers_;
};

}  // namespace drench::render
