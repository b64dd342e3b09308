#pragma once
// The coupled simulator: SPH fluid and cloth that push each other, frame by frame. By default the
// fluid is incompressible and the cloth implicit; the method of Harada, Koshizuka, Kawaguchi 2007
// is there as well. docs/theory has its equations, files and tests.

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot.h"
#include "sim/cloth_contacts.h"

namespace drench {

enum class Device { automatic, cpu, cuda };

struct SimulatorOptions {
  Device device = Device::automatic;  // automatic: CUDA when there is a device, else CPU
  LevelSetMaker level_set = {};       // make_level_set; needed for obstacles of type mesh
};

/// What the last call to advance did, for logs and stats.jsonl.
struct StepReport {
  int steps = 0, cloth_substeps = 0;                 // fluid steps; cloth steps in all
  double time = 0, smallest_dt = 0, largest_dt = 0;  // s
  std::string limit;               // which limit ruled most steps: "sound speed", "force", ...
  size_t particles = 0, near = 0;  // near: within the support radius of cloth at the end
  double max_speed = 0;            // m/s
  double mean_compression = 0, max_compression = 0;  // max(rho/rho0 - 1, 0)
  double kinetic_energy = 0;                         // J, fluid and cloth
  std::array<double, 3> momentum{};                  // kg m/s, of the same
  int iterations = 0;           // of the incompressible solver's pressure solves
  int unconverged = 0;          // steps in which these did not reach fluid.tolerance
  double worst_residual = 0;    // mean density error that a solve left, the largest of the steps
  int viscous_iterations = 0;   // of the solves for viscosity
  int sheet_sweeps = 0;         // of the conjugate gradients of the sheets, in all
  int sheets_asleep = 0;        // at the end
  int sheets_cut_short = 0;     // steps in which the sheets' solve did not reach its tolerance
  int viscous_unconverged = 0;  // steps in which these did not reach their tolerance
  double worst_viscous_residual = 0;  // RMS that one left over the RMS of the velocity
  uint64_t guard_hits = 0;            // particles that continuous collision held back
  sim::ClothContacts cloth_contacts;  // of the last step
  double water_in_cloth = 0;          // kg, that sheets hold; the fluid's particles have it as well
  uint64_t memory = 0;                // bytes of the state on its device, room to grow included
  std::vector<std::pair<std::string, uint64_t>> drained;  // particles that each sink took
  uint64_t emitted = 0;                                   // particles that emitters added
  uint64_t lost = 0;  // particles that left the domain through an open side
};

/// A probe's file: CSV with its units, after lines that begin with '#' and say what it holds.
struct ProbeText {
  std::string name, csv;
};

/// The state is not finite or far too fast: says frame, time, particle and the last good
/// checkpoint.
class BlowUp : public Error {
 public:
  BlowUp(const std::string& text, std::filesystem::path last_good)
      : Error(text), checkpoint(std::move(last_good)) {}
  std::filesystem::path checkpoint;  // that the text names; empty: none was written or read
};

class Simulator {
 public:
  /// Builds the initial state, before any pre-roll. @throws Error if fluid overlaps cloth, a cloth
  /// mesh is degenerate or not manifold, nothing is to be simulated, or cuda is asked for and
  /// absent.
  Simulator(const Shot& shot, const SimulatorOptions& options);
  ~Simulator();
  Simulator(Simulator&&) noexcept;

  /// Runs the pre-roll, if any is left: the state is the first frame's then. To be called before
  /// the first frame is read, unless the state comes from a checkpoint.
  /// @param keep_going  asked before every step; false throws Stopped after the current state is
  /// whole.
  /// @throws Error, BlowUp among them.
  StepReport preroll(const std::function<bool()>& keep_going = {});
  /// Advances from frame to frame + 1; steps land exactly on frames. What is left of the pre-roll
  /// goes first. @param keep_going, @throws as above.
  StepReport advance_frame(const std::function<bool()>& keep_going = {});

  int frame() const;  // film frame of the current state
  /// How far the state is on the way to the next frame, 0 to 1; between steps.
  double share_of_frame() const;
  ParticleFrame particles() const;
  std::vector<ClothFrame> cloth() const;
  /// What the shot's probes have measured from the start to now, a row for every step. It belongs
  /// to the state: a checkpoint brings it back.
  std::vector<ProbeText> probes() const;

  /// Every state the next step reads, lossless: a resumed run has the same bits.
  WrittenFile write_checkpoint(const std::filesystem::path& path) const;
  /// @throws Error if damaged or made by another shot or build of the state's layout.
  void read_checkpoint(const std::filesystem::path& path);

  std::string device_name() const;

  struct Implementation;

 private:
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace drench
