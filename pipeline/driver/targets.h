#pragma once
// The targets of a run: frames and steps asked for, and what the shot says of them.

#include <map>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "pipeline/driver/manifest.h"
#include "pipeline/driver/step.h"

namespace drench {

/// What a stage depends on besides the files of the stage before.
struct StageKey {
  Digest digest;   // settings, build, device class, contents of files the shot names
  KeyParts parts;  // the same by name, short digests, to say what changed
};
/// A digest as key parts show it.
std::string short_hex(const Digest& digest);

/// The state an output folder should be brought to. Plain data: planning does no input or output.
struct Targets {
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

  bool includes(Step step) const;
  bool includes(int frame) const;
};

/// Hashes the settings and the files that the shot names (cloth meshes, maps, textures).
/// @param device_class  "cpu" or "cuda": their simulations differ in bits.
/// @throws Error if a named file cannot be read.
Targets targets_of(const Shot& shot, std::vector<int> frames, std::vector<Step> steps,
                   const std::string& device_class);

}  // namespace drench
