#include "render/integrator/photon_rounds.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/film/pixel_sum.h"

namespace drench::render {

PhotonRounds::PhotonRounds(double photons, double most_photons, int samples)
    : most_(int(std::clamp(std::ceil(photons / most_photons), 1.,
                           std::max(1., double(samples / PixelSum::smallest_batch))))) {
  photons_ = uint32_t(std::clamp(photons / most_, 1., most_photons));
}

void PhotonRounds::begin_pass(double fraction) {
  const int end = std::clamp(int(std::ceil(fraction * most_)), 1, most_);
  first_ = std::min(end_, end - 1);
  spread_ += (end - end_) / std::sqrt(double(end));
  end_ = end;
}

void PhotonRounds::archive(CheckpointArchive& file) {
  file.value(first_), file.value(end_), file.value(spread_);
}

/// Rounds take even parts of what a pass adds: at most half of a pixel's samples, but for the
/// first. Parts are of whole batches, so that each sees all subsets of its photons.
int PhotonRounds::upto(int round, int wanted) const {
  if (round + 1 == end_) return wanted;
  const int before = first_ == 0 ? 0 : wanted / 2;
  const double part = double(round + 1 - first_) / (end_ - first_);
  return int((before + part * (wanted - before)) / PixelSum::smallest_batch) *
         PixelSum::smallest_batch;
}

PhotonRound PhotonRounds::at(int round) const {
  constexpr unsigned max_slots_log2 = 8;  // log2: with 24 bits for the photons of a round
  return {round, end_, std::min(unsigned(std::bit_width(unsigned(most_ - 1))), max_slots_log2)};
}

double PhotonRounds::radius(double last) const {
  return last * std::sqrt(spread_ / std::sqrt(double(end_)));
}

FramePhotons::FramePhotons(const Scene& scene, const RenderSettings& settings, ManifoldWalks walks,
                           uint32_t seed)
    : scene_(scene),
      any_(settings.photons > 0 && can_trace_photons(scene)),
      samples_(settings.samples),
      walks_(walks),
      seed_(seed) {}

PhotonRounds FramePhotons::rounds(const RenderSettings& r, double most_photons) const {
  return {any_ ? r.photons * r.samples * r.width * r.height : 0, most_photons, r.samples};
}

void FramePhotons::trace_round(int round, const PhotonRounds& rounds, uint64_t& rays) {
  if (!any_ || round == round_) return;
  caustics_ = {};  // two maps are more than there may be room for
  caustics_ =
      trace_photons(scene_, seed_, rounds.photons(), samples_, walks_, rays, rounds.at(round));
  round_ = round;
}

}  // namespace drench::render
