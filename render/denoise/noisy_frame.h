#pragma once
// A frame as it was rendered, with what denoising it and its neighbours takes, in an EXR: the
// layers that are delivered, and beside them
//   denoise_first.RGB, denoise_second.RGB  the beauty by two halves of the samples
//   denoise_variance.RGB                   of a half's mean
//   denoise_guide.*, denoise_scatter.*     guides and their variance
//   denoise_motion.*                       pixels right and down to the frame before and after

#include <filesystem>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "render/denoise/denoise.h"
#include "render/film/film.h"

namespace drench::render {

/// @throws Error if Open Image Denoise is asked for and not there; it leaves out the neighbours.
std::vector<NoisyPicture::Plane> denoised_by(Denoiser denoiser, NoisyPicture picture,
                                             Neighbours neighbours = {});

/// Puts the denoised beauty in the place of the noisy one, which becomes the layer "noisy".
void put_clean(Film& film, const std::vector<NoisyPicture::Plane>& clean);

/// Rounds to what a file holds of it, so that a picture is denoised the same before and after.
void round_as_stored(NoisyPicture& picture);

/// The layers above.
void add_picture(Film& film, NoisyPicture picture);

/// @throws Error if the film has no such layers.
NoisyPicture picture_of(const Film& film);

/// A frame's film by files of noisy frames, as render_frame gives it, with their header.
/// @param before, after  files of the frames beside it, the nearest first
/// @throws Error if one cannot be read, holds no such layers or is of another size.
Film denoised_film(const std::filesystem::path& frame,
                   const std::vector<std::filesystem::path>& before,
                   const std::vector<std::filesystem::path>& after,
                   Denoiser denoiser = Denoiser::regression);

}  // namespace drench::render
