#pragma once
// More photons than memory holds: they come in rounds, one map after the other, and each round
// lights a part of the samples of every pixel. A pixel's mean averages them, so that radius, noise
// and blur are those of all photons (as in Knaus and Zwicker 2011, "Progressive Photon Mapping: A
// Probabilistic Approach").
//
// Which round lights a sample follows from the plan of its pass, whatever the order of tiles and
// wherever a frame was stopped.

#include "render/film/checkpoint_archive.h"
#include "render/integrator/photons.h"
#include "render/options.h"

namespace drench::render {

/// The rounds of a pass over the picture (SamplePlan).
class PhotonRounds {
 public:
  /// @param photons       of the frame, if all pixels get all their samples
  /// @param most_photons  of a round
  /// @param samples       of a pixel; each round lights eight at least
  PhotonRounds(double photons, double most_photons, int samples);

  /// Rounds begin that the samples of this pass have brought, or the last one goes on.
  /// @param fraction  of all samples that there will be after it
  void begin_pass(double fraction);
  void archive(CheckpointArchive& file);
  int first() const { return first_; }
  int end() const { return end_; }
  /// Samples of a pixel after a round of this pass. @param wanted  after the last
  int upto(int round, int wanted) const;
  PhotonRound at(int round) const;
  uint32_t photons() const { return photons_; }  // of each round
  /// Root mean square of the radii of all rounds, m. @param last  that of the last
  double radius(double last) const;

 private:
  uint32_t photons_;
  int most_, first_ = 0, end_ = 0;
  double spread_ =
      0;  // sum over rounds of the squared radius of their pass, where that of one is 1
};

/// The photons of the current round.
class FramePhotons {
 public:
  FramePhotons(const Scene& scene, const RenderSettings& settings, ManifoldWalks walks,
               uint32_t seed);

  /// Traces the photons of a round, where they are not there.
  /// @param rays  counts rays traced
  void trace_round(int round, const PhotonRounds& rounds, uint64_t& rays);
  /// Whether the frame has any.
  bool any() const { return any_; }
  PhotonRounds rounds(const RenderSettings& settings, double most_photons) const;
  const Caustics& caustics() const { return caustics_; }

 private:
  const Scene& scene_;
  bool any_;
  int samples_, round_ = -1;
  ManifoldWalks walks_;
  uint32_t seed_;
  Caustics caustics_;
};

}  // namespace drench::render
