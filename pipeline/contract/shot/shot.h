#pragma once
// A shot as the stages see it: every value checked, every default filled in. SI units; colours are
// linear ACEScg. Read from TOML by shot_file.h; the parameter table there is the one list of keys,
// and the enumerators here are the words that a file may say.

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace drench {

using Imath::V2i;
using Imath::V3d;
using Imath::V3f;

enum class Interpolation { linear, smooth, step };

/// How the camera sees an object that stands in the filmed plate, too, where it sees it directly;
/// light, shadows and mirrors know it as any other. holdout: a hole, alpha 0. shadow_catcher: as
/// nothing but what the other objects do to the light on it (render/film/matte.h).
enum class Matte { none, holdout, shadow_catcher };

/// A value over frames; one key is a constant. Frames are film frames and may be fractional.
template <class T>
struct Animated {
  std::vector<std::pair<double, T>> keys;  // sorted by frame, at least one
  Interpolation interpolation = Interpolation::linear;

  Animated(T constant = T{}) : keys{{0.0, constant}} {}

  T at(double frame) const {
    if (frame <= keys.front().first) return keys.front().second;
    if (frame >= keys.back().first) return keys.back().second;
    size_t k = 1;
    while (keys[k].first <= frame) ++k;
    double t = (frame - keys[k - 1].first) / (keys[k].first - keys[k - 1].first);
    if (interpolation == Interpolation::step) t = 0;
    if (interpolation == Interpolation::smooth) t = t * t * (3 - 2 * t);
    return keys[k - 1].second * (1 - t) + keys[k].second * t;
  }
};

/// Frames of the shot. Frame f stands at t = (f - first) / fps; the first is the initial state.
struct Timeline {
  int first = 1001, last = 1048;  // inclusive
  double fps = 24;
};

// walls: a plane at both ends of the domain; periodic: its two ends are one, and what leaves
// through one comes in at the other
enum class Axis { open, walls, periodic };

/// How fluid meets the domain's walls, an obstacle, a sheet; automatic: none where their influence
/// spreads by a spacing within a second, sqrt(nu 1 s) >= spacing, or where a wall moves; free
/// elsewhere.
enum class Slip { automatic, free, none };

struct WallVelocity {  // m/s, along the wall
  V3d x_low{0, 0, 0}, x_high{0, 0, 0}, y_low{0, 0, 0}, y_high{0, 0, 0}, z_low{0, 0, 0},
      z_high{0, 0, 0};
  std::array<V3d, 6> all() const { return {x_low, x_high, y_low, y_high, z_low, z_high}; }
};

struct Domain {
  V3d min{-1, 0, -1}, max{1, 2, 1};  // m; walls stand on these planes, seams of periodic axes too
  std::array<Axis, 3> axis{Axis::walls, Axis::walls, Axis::walls};
  Slip slip = Slip::automatic;
  WallVelocity wall_velocity;
  double contact_angle_deg = 90;  // of the fluid's surface at the walls, within the fluid
};

struct FluidBox {  // a lattice of round((max-min)/spacing) particles a side
  V3d min, max, velocity{0, 0, 0};
};
struct FluidSphere {
  V3d center;
  double radius = 0;
  V3d velocity{0, 0, 0};
};
enum class EmitterType { disc, rectangle, mesh };

/// An inlet, which particles leave as lattice layers, or a closed mesh that is kept full. As in
/// Obstacle, the mesh's own frame has the origin at `center`.
struct FluidEmitter {
  EmitterType type = EmitterType::disc;
  Animated<V3d> center{V3d(0)};            // m; the fluid takes on its velocity
  Animated<V3d> direction{V3d(0, -1, 0)};  // disc: any length but 0
  double radius = 0.05;                    // disc, m
  V3d u{0.1, 0, 0}, v{0, 0, 0.1};          // rectangle: half edges, m; fluid leaves along u x v
  double speed = 0;                        // disc, rectangle: m/s, relative to the inlet
  std::filesystem::path mesh_file;         // mesh: PLY or OBJ, absolute after reading
  Animated<V3d> rotation_deg{V3d(0)};      // mesh: about x, then y, then z of the world
  double scale = 1;                        // mesh: of its coordinates, to m
  double inset = 0.5;                      // mesh: as of FluidVolume, spacings
  V3d velocity{0, 0, 0};                   // mesh: m/s, besides the mesh's own
  double start = 0, stop = 1e9;            // s after the simulation's start
};
/// A closed mesh filled with lattice particles at the start. As in Obstacle, its own frame has the
/// origin at `position`.
struct FluidVolume {
  std::filesystem::path mesh_file;  // PLY or OBJ, absolute after reading
  V3d position{0, 0, 0};            // m
  V3d rotation_deg{0, 0, 0};        // about x, then y, then z of the world
  double scale = 1;                 // of its coordinates, to m
  double inset = 0.5;     // spacings: how deep inside the surface particles stand at least
  V3d velocity{0, 0, 0};  // m/s
};
struct FluidDrops {  // separate spheres with centres drawn evenly in a box, kept apart
  V3d min, max, velocity{0, 0, 0};
  double radius = 0;  // m
  int count = 0;      // drops
  int particles = 0;  // if > 0: exactly so many particles in all, lattice balls truncated by radius
};

/// automatic: incompressible, but for the published coupling, which is of the other.
enum class FluidSolver { automatic, incompressible, weakly_compressible };

struct Fluid {
  double spacing = 0.01;  // m, a
  FluidSolver solver = FluidSolver::automatic;
  double support_ratio = 0;    // support radius / spacing; 0: what suits the solver
  double tolerance = 1e-4;     // incompressible: mean density error over rest, a step
  double xsph = 0.01;          // incompressible: fraction of the neighbours' velocity, a step
  double rest_density = 1000;  // kg/m^3
  double kinematic_viscosity = 1e-6;             // m^2/s
  double surface_tension = 0;                    // N/m, incompressible
  double artificial_viscosity = 0.1;             // alpha of Monaghan 1992, dimensionless; 0 is none
  double sound_speed = 0;                        // m/s; 0: ten times the largest speed expected
  bool write_source = false, write_age = false;  // columns of the particle files
  std::string material = "water";
  std::vector<FluidBox> box;
  std::vector<FluidSphere> sphere;
  std::vector<FluidEmitter> emitter;
  std::vector<FluidDrops> drops;
  std::vector<FluidVolume> volume;
  bool present() const { return sources() > 0; }
  size_t sources() const {
    return box.size() + sphere.size() + drops.size() + volume.size() + emitter.size();
  }
};

/// A group of vertices that is held; exactly one of `vertices` and `box` is given. It stays where
/// it starts, moves as its keys do from there, or follows an obstacle.
struct ClothPin {
  static constexpr double never = 1e9;  // s
  std::vector<uint32_t> vertices;
  std::optional<std::pair<V3d, V3d>> box;  // every vertex inside at the start, m
  Animated<V3d> position{V3d(0)};      // m: what its keys change since the start moves the group
  Animated<V3d> rotation_deg{V3d(0)};  // about x, then y, then z of the world through the pivot
  std::optional<V3d> pivot{};          // m, at the start; none: the middle of the group's box
  std::string on{};                    // name of an obstacle that carries it; or empty
  double release = never;              // s after the simulation's start
  double stiffness = 0;                // N/m of a spring to its place, a vertex; 0: held there

  bool moves() const {
    return position.keys.size() > 1 || rotation_deg.keys.size() > 1 || !on.empty();
  }
  bool lets_go() const { return release < never; }
  /// Whether its vertices are held where they start, for good.
  bool stands() const { return !moves() && !lets_go() && stiffness == 0; }
};

/// An edge of a grid; u0 is the one where u starts.
enum class GridEdge { none, u0, u1, v0, v1 };

/// Springs from vertices of a sheet to as many of another one, or of its own: either side is an
/// edge of a grid or a list.
struct ClothSeam {
  GridEdge edge = GridEdge::none;
  std::vector<uint32_t> vertices;
  std::string to;  // name of the other sheet; empty: its own
  GridEdge to_edge = GridEdge::none;
  std::vector<uint32_t> to_vertices;
  double stiffness = 0;     // N/m, a pair; 0: ten times the stiffer sheet's modulus
  double rest_length = -1;  // m; -1: what contact keeps the sheets apart
  double time = 0;          // s from the start in which the seam is drawn to that length
};

/// automatic, which the shots of files have resolved: springs where any of their constants is given
/// or the fluid is weakly compressible, else a shell. In a shot that is no file's: springs.
enum class ClothModel { automatic, springs, shell };

struct Cloth {
  std::string name = "cloth";
  ClothModel model = ClothModel::automatic;
  // A grid (mesh_file empty): corner + i/nu u + j/nv v, with both diagonals as springs.
  V3d corner{-0.5, 1, -0.5}, u{1, 0, 0}, v{0, 0, 1};  // m
  V2i cells{64, 64};
  std::filesystem::path mesh_file;  // PLY or OBJ triangles, absolute after reading
  double weld =
      -1;  // m: vertices on free edges closer than this are one; < 0: 1e-5 of its diagonal
  std::vector<ClothPin> pin;
  std::vector<ClothSeam> seam;
  V3d velocity{0, 0, 0};            // m/s at the start
  double areal_density = 0.2;       // kg/m^2
  double adjacent_stiffness = 400;  // N/m, the 2-D modulus k_adj
  double diagonal_stiffness = 200;  // N/m, k_diag; isotropic when k_adj = 2 k_diag
  double damping = 0.5;             // 1/s, rate of eq (3): d = exp(-damping dt)
  double spring_damping = 0.1;      // fraction of critical, along each spring; momentum is kept
  double retardation_time = 0;      // s, viscosity over stiffness of each spring (Kelvin-Voigt)
  double thickness = 0.001;         // m
  // of a shell; what the file does not give is of the fabric (fabrics.h)
  std::string fabric = "cotton";
  double young_warp = 12000, young_weft = 8000, shear_modulus = 67.4;    // N/m
  double poisson = 0.2;                                                  // geometric mean of both
  double bend_warp = 1.96e-5, bend_weft = 1.37e-5, bend_bias = 1.27e-5;  // N m
  double stretch_limit = 1.05;           // length over rest length where it stiffens
  double damping_time = 0.005;           // s, viscosity over stiffness
  double friction = 0.5;                 // Coulomb's coefficient on itself
  bool self_collision = true;            // it meets itself and other shells
  bool soaks = false;                    // it takes up fluid that touches it
  double wetness = 0;                    // at the start: share of its pores that is full
  double water_capacity = 0.2526;        // kg/m^2 when full
  double soak_time = 0.5, dry_time = 0;  // s; dry_time 0: never
  double wet_modulus_ratio = 0.7, wet_friction = 0.7;  // of a full sheet: factor, coefficient
  double sleep_speed = -1;                             // m/s: see SheetRest; < 0: by its size
  bool write_strain = false;      // its files hold principal strains and stresses
  Slip slip = Slip::automatic;    // of fluid along it
  double contact_angle_deg = 90;  // of the fluid's surface at it, within the fluid
  std::string material = "cotton";
  Matte matte = Matte::none;
  int subdivision = -1;  // levels where it is meshed and drawn (subdivision.h); -1: by its size
};

enum class ObstacleType { plane, box, sphere, mesh };

/// A solid that the fluid flows around. Its own frame has the origin at `position`, turned by
/// `rotation_deg`.
struct Obstacle {
  ObstacleType type = ObstacleType::box;
  std::string name = "obstacle";
  Animated<V3d> position{V3d(0)};      // m: of the origin: a point of the plane, the centre
  Animated<V3d> rotation_deg{V3d(0)};  // about x, then y, then z of the world
  V3d normal{0, 1, 0};                 // plane: away from the solid half-space
  V3d size{1, 1, 1};                   // box: edges, m
  double radius = 0.5;                 // sphere, m
  std::filesystem::path mesh_file;     // mesh: PLY or OBJ, or a sequence: see obstacle.h
  double scale = 1;                    // mesh: of its coordinates, to m
  double friction = 0.3;               // Coulomb's coefficient of cloth on it
  Slip slip = Slip::automatic;         // of fluid along it
  double contact_angle_deg = 90;       // of the fluid's surface at it, within the fluid
  std::string material = "ground";
  bool visible = true;
  Matte matte = Matte::none;
};

/// A part of space that takes away the fluid in it. No solid, not drawn.
struct Sink {
  Obstacle shape;                // material and visible are unused
  double start = 0, stop = 1e9;  // s after the simulation's start
  Sink() { shape.name = "sink"; }
};

/// Air that drags fluid and cloth along. Without [wind] there is none.
struct Wind {
  bool present = false;
  Animated<V3d> velocity{V3d(0)};  // m/s
  double air_density = 1.2;        // kg/m^3
  double gust = 0;                 // m/s, RMS of what is added
  double gust_size = 1;            // m, longest wave of it
  double cloth_drag = 1.2;         // coefficient across a sheet; square plates have 1.17
  double cloth_friction = 0.02;    // along it, both sides
  double fluid_drag = 1;           // times the drag of drops
};

enum class CouplingScheme {
  exact,
  paper
};  // exact: mended; paper: Harada et al. 2007 as published

struct Coupling {
  CouplingScheme scheme = CouplingScheme::exact;
};

enum class ProbeType { height, pressure, force, tip, energy, volume, velocity, front };

/// A measurement of every simulation step; sim/probe_series.h says what the columns mean.
struct Probe {
  ProbeType type = ProbeType::height;
  std::string name = "probe";  // part of its file's name
  // m; height: the line's x and z, pressure, velocity: centre, tip: rest position
  V3d position{0, 0, 0};
  V3d normal{0, 1, 0};           // pressure: of the disc
  double radius = 0.01;          // pressure: of the disc, velocity: of the ball, m
  V3d direction{1, 0, 0};        // front: along which fluid is farthest
  std::string on;                // obstacle whose own coordinates position and normal are; or none
  double interval = 0;           // s between rows; 0: every step
  double window = 1e-3;          // pressure, force: the mean columns are over this time, s
  std::string target = "y_low";  // force: a wall, x_low to z_high, an obstacle or a sheet
  std::string cloth = "cloth";   // tip: name of the sheet
  int vertex = -1;               // tip: of the sheet; -1: the one nearest to position at rest
};

/// Kernels of the colour field; anisotropic: ellipsoids in sheets and threads.
enum class SurfaceKernel { isotropic, anisotropic };

struct SurfaceSettings {
  double voxel = 0.5;       // voxel edge / spacing
  double support = 2.5;     // kernel support / spacing
  double iso_value = 0.45;  // of the colour field
  int smoothing = 20;       // passes on the mesh, volume kept
  bool obj = false;         // also write fluid.####.obj
  bool level_set = false;   // also write fluid.####.vdb
  double memory_gib = 8;    // refuse grids that would need more
  SurfaceKernel kernel = SurfaceKernel::anisotropic;
};

/// Spray, foam and bubbles (surfacing/foam.h). Without [foam] there are none.
struct FoamSettings {
  bool present = false;
  // Particles that each fluid particle makes while a spacing is passed: of the fluid closing in on
  // it, and of its own out of the fluid at a crest.
  double trapped_air = 20, wave_crest = 5;
  double threshold = 0.1;    // speed from which air is caught / sqrt(g a + sigma / (rho a))
  double lifetime = 3;       // s, mean of foam
  double rise_speed = 0.25;  // m/s, of bubbles in still fluid
  double radius = 0.08;      // mean of a foam particle / spacing
};

/// A keyframed thin-lens camera, looking along -Z of its own frame.
struct Camera {
  Animated<V3d> position{V3d(0, 1, 3)}, target{V3d(0, 0.5, 0)};  // m
  Animated<double> fov_deg{40.0};                                // horizontal
  Animated<double> focus_distance{0.0};                          // m; 0: distance to target
  Animated<double> lens_radius{0.0};                             // m; 0: pinhole
  int blades = 0;                 // of the aperture, 3 or more; 0: round
  double blade_rotation_deg = 0;  // clockwise in the picture; 0: a corner is up
  double squeeze = 1;             // of an anamorphic lens: its aperture is narrower by this factor
  V3d up{0, 1, 0};
  double shutter_open = -0.25, shutter_close = 0.25;  // frames, around the frame
  double shutter_opening = 0, shutter_closing = 0;    // fractions of that time; sum at most 1
  double rolling_shutter = 0;  // how much later the last row is than the first, in shutter times
};

enum class LightType { rectangle, sphere, sun, environment, disk };

struct Light {
  LightType type = LightType::rectangle;
  std::string name = "light";
  std::string group;               // of its layer; empty: its name
  V3f radiance{1, 1, 1};           // W/(sr m^2), linear ACEScg; sun: irradiance facing it, W/m^2
  V3d center{0, 3, 0};             // rectangle, sphere, disk, m
  V3d u{0.5, 0, 0}, v{0, 0, 0.5};  // rectangle: half edges, m; emits along u x v
  double radius = 0.1;             // sphere, disk, m
  V3d direction{0, -1, 0};         // sun, disk: in which its light travels
  double angle_deg = 0.53;         // sun: apparent diameter
  std::filesystem::path map;       // environment: latitude-longitude picture; empty: constant
  double rotation_deg = 0;         // environment, about Y
  bool split_suns = true;          // environment: small bright regions of its map become suns
  V3f horizon{1, 1, 1};  // environment without a map: radiance at the horizon / at the zenith
  V3f below{1, 1, 1};    // the same below the horizon
};

enum class MaterialType { dielectric, cloth, diffuse, metal, coated };

struct Material {
  std::string name;
  MaterialType type = MaterialType::diffuse;
  V3f reflectance{0.5f, 0.5f, 0.5f};  // diffuse, cloth, under a coat; of metal facing it
  V3f edge{1, 1, 1};                  // metal: reflectance at 82 degrees over Schlick's there
  double roughness = 0;               // dielectric, metal, coat: its square is GGX's alpha
  V3f emission{0, 0, 0};              // diffuse, W/(sr m^2); of obstacles, from their outer side
  V3f transmittance{0, 0, 0};         // cloth: diffuse transmission; reflectance + it <= 1
  V3f sheen{0, 0, 0};                 // cloth: of its fuzz
  double sheen_roughness = 0.3;       // cloth: 1 over the power of the fuzz's sine
  V3f yarn_specular{0, 0, 0};         // cloth: of its yarns, along u and v; sheen + it <= 1
  double yarn_roughness = 0.4;        // cloth: its square is the slope of fibres along yarns
  double gap = 0;                     // cloth: fraction that is open between yarns
  double film_roughness = 0.4;        // cloth: of the water's surface where it is wet
  double ior = 1.333;                 // dielectric, coat, what wets cloth
  int priority = 0;                   // dielectric: of bodies at one point the highest is there
  V3f absorption{0, 0, 0};            // dielectric, 1/m
  std::filesystem::path texture;      // a picture, multiplies reflectance
  std::filesystem::path normal_map;   // a picture, tangent space, x along u, y along v
  double texture_size = 1;            // edge that both pictures cover, in uv; on the ground m
  bool checker = false;               // diffuse, coated: built-in checker of checker_size
  double checker_size = 0.1;          // m
};

/// A horizontal plane that the renderer draws under the scene.
struct Ground {
  bool present = false;
  double height = 0;      // m
  double half_size = 50;  // m, square around center
  V3d center{0, 0, 0};    // m; y is unused
  std::string material = "ground";
  Matte matte = Matte::none;
};

/// What the camera sees where there is nothing; clear: alpha 0, and the sky and suns are seen in
/// mirrors and by refraction only.
enum class Background { sky, clear };

/// Of smooth water and glass before a clear background or a matte object; transparent: a plate
/// shows through, undistorted.
enum class RefractionAlpha { opaque, transparent };

/// What takes noise away; regression: Drench's own, by neighbouring frames, too; oidn: Open Image
/// Denoise where it is installed, each frame alone.
enum class Denoiser { regression, oidn };

struct RenderSettings {
  int width = 960, height = 540;       // pixels
  V2i crop_min{0, 0}, crop_max{0, 0};  // pixels of it to render, from the top left; max is beyond
  int samples = 64;                    // camera samples a pixel, at most where there is a target
  double error = 0;                    // relative MSE to sample until; 0: all samples everywhere
  bool denoise = false;                // of the beauty, by its layers' help
  int denoise_frames = 1;              // before and after that help, too
  Denoiser denoiser = Denoiser::regression;
  int depth = 8;  // diffuse bounces; specular ones end by roulette
  bool motion_blur = true;
  Background background = Background::sky;
  RefractionAlpha refraction_alpha = RefractionAlpha::opaque;
  double photons = 0.2;  // of caustics, for each camera sample; 0: caustics by paths alone
  uint32_t seed = 1;
};

/// Layers that a frame's EXR holds besides the beauty; what is off costs nothing.
struct LayerSettings {
  bool albedo = false;        // albedo.RGB of what is seen, through water and glass
  bool normal = false;        // N.XYZ of what is met first, unit, of the world
  bool depth = false;         // depth.Z, m along the view; 1e10: nothing
  bool position = false;      // P.XYZ, m, of the world
  bool motion = false;        // motion.XYZ, to the next frame: pixels right and up, m away
  bool variance = false;      // variance.RGB of the beauty's error
  bool samples = false;       // samples.Y, camera samples that the pixel got
  bool light_groups = false;  // light_GROUP.RGB; they sum to the beauty
  bool cryptomatte = false;   // CryptoObject, CryptoMaterial
  bool opacity = false;       // opacity.RGB, alpha by colour
};

/// How PNGs and movies show a frame; nothing given: by the built-in transform.
struct ViewSettings {
  std::filesystem::path ocio_config;  // empty, with a display or view: $OCIO
  std::string display, view;          // names in the config; empty: its default
};

/// A whole shot.
struct Shot {
  std::string name;            // file stem
  std::filesystem::path file;  // as given
  Timeline timeline;
  double preroll = 0;  // s simulated before the first frame
  uint32_t seed = 1;
  Animated<V3d> gravity{V3d(0, -9.81, 0)};  // m/s^2
  // The domain turns about an axis; what moves is seen from it. Of keys, linear between them.
  Animated<double> frame_rotation_deg{0};
  V3d frame_axis{0, 1, 0}, frame_center{0, 0, 0};  // any length but 0; m, a point of the axis
  double time_step = 0;  // s; 0: adaptive. Fixed steps above the stable one are refused
  Domain domain;
  Fluid fluid;
  std::vector<Cloth> cloth;
  std::vector<Obstacle> obstacle;
  std::vector<Sink> sink;
  Wind wind;
  Coupling coupling;
  std::vector<Probe> probe;
  SurfaceSettings surface;
  FoamSettings foam;
  Camera camera;
  std::vector<Light> light;
  std::vector<Material> material;  // built-in water, cotton, ground unless redefined
  Ground ground;
  RenderSettings render;
  LayerSettings layers;
  ViewSettings view;
};

/// What `automatic` and 0 stand for.
inline bool is_incompressible(const Shot& shot) {
  return shot.fluid.solver == FluidSolver::incompressible ||
         (shot.fluid.solver == FluidSolver::automatic &&
          (shot.cloth.empty() || shot.coupling.scheme == CouplingScheme::exact));
}
/// Whether what has this slip holds the fluid beside it.
inline bool holds_fluid(const Shot& shot, Slip slip) {
  if (slip != Slip::automatic) return slip == Slip::none;
  return std::sqrt(shot.fluid.kinematic_viscosity * 1.0) >= shot.fluid.spacing;  // m after 1 s
}
/// What water makes of a sheet of springs is not modelled.
inline bool is_ever_wet(const Cloth& cloth) {
  return cloth.model == ClothModel::shell && (cloth.soaks || cloth.wetness > 0);
}
/// Cosine of a contact angle, 0 of a right one.
inline double wetting_of(double contact_angle_deg) {
  return contact_angle_deg == 90 ? 0 : std::cos(contact_angle_deg * 3.14159265358979323846 / 180);
}
inline double support_ratio(const Shot& shot) {
  if (shot.fluid.support_ratio > 0) return shot.fluid.support_ratio;
  return is_incompressible(shot) ? 2.15 : 2.0;
}

}  // namespace drench
