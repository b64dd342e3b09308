#pragma once
// What a shot wants made, and the keys that say whether it is: everything a step depends on,
// hashed.
//
//   simulate(f) = H(stage, f, simulate(f - 1))        stage = settings, input files, build, device
//   mesh(f)     = H(stage, f, digest of particles)    digests, not keys: inputs that come out the
//   foam(f)     = H(stage, f, digests of particles    same stop a change from spreading further;
//                   f - 1 and f and of foam f - 1)    foam is made in order, frame by frame
//   render(f)   = H(stage, f, digests of meshes and
//                   of foam)
//   denoise(f)  = H(stage, f, digests of noisy         as they were rendered: no frame depends on
//                   frames f, f - 1, f + 1, ...)         one that is denoised

#include <map>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "pipeline/driver/manifest.h"

namespace drench {

enum class Step { simulate, mesh, foam, render, denoise, contact_sheet, movie };
std::string_view step_name(Step step);

/// What a stage depends on besides the files of the stage before.
struct StageKey {
  Digest digest;   // settings, build, device class, contents of files the shot names
  KeyParts parts;  // the same by name, short digests, to say what changed
};

/// The state an output folder should be brought to. Plain data: planning does no input or output.
struct Wanted {
  std::string shot;                // file stem
  int first = 1001;                // of the shot's timeline: where simulation starts
  std::vector<int> frames;         // to deliver, sorted, at least one
  std::vector<Step> steps;         // steps that may run; a later one alone takes what lies there
  bool fluid = false;              // false: nothing to mesh
  bool obj = false;                // mesh also writes an OBJ
  bool level_set = false;          // mesh also writes a VDB
  bool has_foam = false;           // every frame from the first on has a file of foam
  std::vector<std::string> cloth;  // names of the sheets
  std::map<int, Digest> sequence;  // by frame: of the files that obstacles have for every frame
  bool obstacles_move = false;     // equal particles then do not make equal meshes
  std::vector<std::string> probe;  // names of the probes: one file each for all frames
  bool denoised_later = false;     // by a step of its own, of files of noisy frames
  int denoise_frames = 0;          // before and after one that it is denoised by
  StageKey simulate, mesh, foam, render, denoise, dailies;  // dailies: contact sheet and movie
  bool has_ffmpeg = false;

  bool may(Step step) const;
  bool wants(int frame) const;
};

/// Hashes the settings and the files that the shot names (cloth meshes, maps, textures).
/// @param device_class  "cpu" or "cuda": their simulations differ in bits.
/// @throws Error if a named file cannot be read.
Wanted want(const Shot& shot, std::vector<int> frames, std::vector<Step> steps,
            const std::string& device_class);

/// Files a frame of the simulation consists of: particles if there is fluid, one for each sheet.
std::vector<std::string> simulated_files(const Wanted& wanted, int frame);
/// Files of the probes, which hold every frame up to the one they are recorded with.
std::vector<std::string> probe_files(const Wanted& wanted);
std::vector<std::string> mesh_files(const Wanted& wanted, int frame);
/// Files that a frame's foam is made of: the fluid of the frame, and fluid and foam of the frame
/// before unless it is the first.
std::vector<std::string> foam_inputs(const Wanted& wanted, int frame);
/// Files that rendering a frame reads.
std::vector<std::string> render_inputs(const Wanted& wanted, int frame);
/// The file that rendering a frame makes: the image, or a noisy frame to be denoised later.
std::string render_file(const Wanted& wanted, int frame);

/// A key and what it is made of.
struct Key {
  Digest digest;
  KeyParts parts;
};

/// Names and digests of files, in order.
using InputDigests = std::vector<std::pair<std::string, Digest>>;
/// Of what Wanted::sequence has for these frames.
InputDigests sequence_inputs(const Wanted& wanted, int first, int last);

/// Keys of frames first ... last of the simulation, in order; their parts are
/// wanted.simulate.parts.
std::vector<Digest> simulation_keys(const Wanted& wanted, int last);
/// Key of a step made from files.
Key step_key(const StageKey& stage, Step step, int frame, const InputDigests& inputs);

}  // namespace drench
