#pragma once
// The state of a simulation on one backend: columns of particles, vertices, springs and triangles.

#include <functional>
#include <memory>
#include <vector>

#include "sim/backend/queue.h"
#include "sim/frame_now.h"
#include "sim/neighbours/grid.h"
#include "sim/neighbours/neighbours.h"
#include "sim/parameters.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/passes/obstacle/obstacle_distance.h"
#include "sim/setup/wall_table.h"
#include "sim/vertex_range.h"
#include "sim/wet_law.h"
#include "sim/wind_now.h"

namespace drench::sim::DRENCH_BACKEND {

struct VecColumn {
  Column<float> x, y, z;
  VecView view() { return {x.data(), y.data(), z.data()}; }
  ConstVecView view() const { return {x.data(), y.data(), z.data()}; }
  void resize(size_t n) { x.resize(n), y.resize(n), z.resize(n); }
  void swap(VecColumn& o) noexcept { x.swap(o.x), y.swap(o.y), z.swap(o.z); }
  void clear(Queue& queue) {
    for (Column<float>* c : {&x, &y, &z}) c->clear_bytes(queue, 0);
  }
};

/// Particles, sorted by cell at the start of every step.
struct FluidState {
  int count = 0;
  // kept from step to step
  VecColumn position, velocity;  // m local, m/s
  Column<int> id;
  Column<int> memory_triangle;  // triangle whose side is remembered, -1 none   (exact coupling)
  Column<int> memory_side;      // +1 or -1
  VecColumn owed;  // kg m/s that continuous collision took and cloth has not received yet
  // rebuilt every step
  VecColumn acceleration;                                 // m/s^2
  Column<float> density, pressure_term, inverse_density;  // kg/m^3, p / rho^2, m^3/kg
  Column<int> cell, order;
  Column<int> cell_start;
  GridShape grid{};
  // coupling
  Column<int> triangle;          // nearest triangle within the support radius, -1 none
  Column<float> beyond_support;  // m, how much nearer a sheet must come to be within the support; a
                                 // lower bound. Negative where it is within
  Column<float> weight_b, weight_c;  // barycentric weights of its foot point
  VecColumn normal;                  // unit, from the sheet to the particle's side; 0 where none
  Column<float> cloth_distance;      // m along normal; 1e30 where there is no sheet
  Column<float> plane;  // m, cloth_distance - normal . position: > -normal . x in front. 1e29
                        // beyond a free edge, where all is in front; 1e30 without a sheet in reach
  Column<float> edge;   // 0 beyond a free edge .. 1 half a spacing inside it
  Column<int>
      shaded;  // 1 where a sheet may hide neighbours; after the density pass: where one does
  Column<float> cloth_density;  // share of density that the sheet replaces
  VecColumn impulse;            // kg m/s, of the sheet it is near      (published coupling)
  VecColumn end;                // m, where its path ends or, incompressible, would end
  VecColumn start;              // m, position at the start of the step
  VecColumn drift;              // m, of a path beside dt times the velocity (incompressible)
  Column<int> moved;            // 1: cannot meet a sheet, has made its whole step
  Column<int> held,
      stopped;  // by continuous collision for this substep; triangle it stopped, -1 none
};
/// All sheets in one: vertices, springs by vertex, triangles.
struct ClothState {
  int vertices = 0, triangles = 0;
  int polygons = 0;  // the triangles, and after them those that close seams to the fluid
  // kept from step to step
  VecColumn position, velocity;
  // fixed
  Column<float> mass, inverse_mass;  // kg; inverse 0 where pinned
  Column<float> damping_rate;        // 1/s
  int padded = 0, spring_slots = 0;  // vertices up to a multiple of 8; springs of the busiest one
  int first_seam_slot = 0;           // of spring_slots, those of seams are the last
  Column<int> spring_end;            // other vertex, slot s of vertex i at s padded + i
  Column<int> slot_offset;  // other vertex - vertex, where it is the same all over a slot; else 0
  Column<float> rest_length, stiffness, spring_damping;  // m, N/m, N s/m
  Column<int> corner;                                    // 3 a triangle
  Column<int> neighbour;             // 3 a triangle: across edges ab, bc, ca; -1 is a free edge
  Column<int> sheet;                 // of a triangle
  Column<float> half_thickness;      // m, of a triangle
  Column<float> wetting;             // of a triangle: cosine of its contact angle; or empty
  Column<float> no_slip;             // of a triangle: 1 where it holds fluid; only where any does
  VecColumn rest_centroid;           // m
  Column<int> fan_start, fan_entry;  // CSR by vertex: 3 triangle + corner
  Column<int> rim;                   // 1 where a vertex lies on a free edge
  bool asleep = false;               // all sheets: held where they are (Solver::sleep)
  int loose = 0;                     // sheets without a pin or a seam
  Column<VertexRange> loose_sheet;   // these
  // where seams sew edges (SeamStrips), else empty
  Column<int> seam_pair;                       // 4 a strip: two pairs of vertices that are sewn
  Column<float> seam_reach;                    // m, of a strip: farther apart they leave it open
  Column<int> seam_open;                       // of a strip, every step: 1 while it is
  Column<int> seam_fan_start, seam_fan_entry;  // as fan_start, of all polygons
  float widest_seam = 0;                       // m, that a strip may be
  int seams_closed = 0;                        // strips that began to be closed with this step
  // where a sheet is joined to itself across a seam, else empty (passes/coupling/polygon_grid.h)
  bool joined = false;
  VecColumn corner_shift;           // m, of a triangle's corner from its vertex
  VecColumn spring_shift;           // m, of a spring's other end from its vertex, slot by slot
  Column<Vec3<float>> rest_period;  // m, of a sheet: periods that it spans; 0 along other axes
  // rebuilt
  VecColumn next, next_velocity;  // the substep being made
  VecColumn start;                // at the start of the step
  VecColumn centroid;
  Column<int> cell, order, cell_start;              // polygons by centroid
  VecColumn sorted_low, sorted_high;                // m, bounding boxes in that order, padded by 8
  Column<PreparedTriangle<float>> sorted_triangle;  // in that order as well, a cache line each
  VecColumn sorted_shift;  // m, of the image that stands there; only where an axis is periodic
  GridShape grid{};
  float largest_radius = 0;   // m
  Vec3<float> low{}, high{};  // m, bounds of all vertices
  VecColumn predicted;        // m/s, mean over the step
  Column<float> share;        // sum of contact weights
  VecColumn air_diagonal,
      air_cross;               // kg/s, see AirDrag; these and air_push only where there is air
  Column<float> air_share;     // see ClothTopology
  VecColumn air_push;          // N
  VecColumn force;             // N from the fluid, constant over the step
  Column<int> held;            // by continuous collision for this substep
  Column<long long> stop_sum;  // 4 a vertex: see ContinuousCollision
};

/// Scalars of the conjugate gradients of the sheets, in the memory of the backend.
struct ClothControl {
  int done = 0, sweeps = 0;
  double reference = 0, energy = 0, step = 1, turn = 0;  // r . z of the loads, of the residual
};

/// Columns of the implicit step of the sheets (passes/cloth/cloth_implicit.h), rebuilt every step.
struct ClothSystem {
  Column<float> tension;  // kg, across a spring, slot by slot as ClothState::spring_end
  VecColumn axis;         // sqrt(kg), along a spring: the rest of its stiffness is axis axis^T
  Column<float> inertia;  // kg
  Column<float> factor;   // 6 fields a vertex: L D L^T of its block, D inverted
  VecColumn base;    // kg m, forces on the sheet where its velocity takes it, but for the fluid's
  VecColumn right;   // kg m, with the fluid's
  VecColumn free;    // 1 along axes that a vertex may move on, 0 where a pin or a wall holds it
  VecColumn change;  // m, off the place where its velocity takes it: the unknown
  VecColumn answer;  // m, to the same pressure all over the sheets
  VecColumn normal;  // unit, of the obstacle that holds a vertex; 0 where none. Only with obstacles
  Column<int> grip;  // that obstacle; -1 none, -2 let go in this step. Only with obstacles
  Column<float> free_factor;  // as factor, of what may move. Only with obstacles
  Column<float> slides;       // 0 where friction holds a vertex, else 1. Only with obstacles
  VecColumn rub;              // kg m, friction of what slides on them. Only with obstacles
  Column<float> cling;  // kg, across the normal, of shells that friction holds. Only with obstacles
  VecColumn residual, scaled, image, direction, direction_image;
  Column<float> drag_factor;  // as factor, with the fluid's drag; only where sheets hold fluid
  Column<float> anchor;       // kg, of soft pins; only where there are any
  VecColumn anchor_pull;      // kg m, of soft pins where straight paths end; as anchor
  Column<ClothControl> control;
};

/// Sheets that are shells (passes/cloth/shell_system.h). Columns are empty without any.
struct ShellState {
  bool any = false;
  // kept from step to step
  VecColumn landed;    // m, where the last step left a vertex: what has moved it since stopped it
  VecColumn rounding;  // m, what that place lacks
  VecColumn left;      // m/s, the velocity that it was left with
  VecColumn lost;      // m/s, what that velocity lacks
  VecColumn acceleration;  // m/s^2, over that step
  VecColumn friction;      // N, of the obstacle that it slid on over it
  VecColumn internal;      // N, of the sheet on the vertex, as it acted over that step
  double dt = 0;           // s, of it; 0: there is none
  // fixed; triangles by fields of `triangles`, padded to a multiple of eight
  int triangles = 0;
  Column<float> area, gradient;  // m^2; 4 fields, 1/m
  Column<int> corner, sheet;     // 3 fields, 1 field
  VecColumn edge_shift;          // m, 2 fields: of corners 1 and 2 against 0; only across seams
  Column<float> law;             // 11 fields of `sheets`: ShellLaw
  int sheets = 0;
  // rows, by slices of eight vertices (sliced ELLPACK)
  Column<int> ring_start, row_start;  // first slot of a slice's blocks, of its entries
  Column<int> end, offset;  // of an entry: the other vertex; of a slot: end - row where that is the
                            // same in all of the slice, else 0
  Column<float> bend;       // N/m, of an entry
  Column<int> fan_slot;     // 2 a fan entry: slots of the triangle's next corner and the one after
  VecColumn push;           // N, of bending across seams
  int ring_slots = 0;       // of all slices
  // Bending patches, PatchTopology: by slices of eight triangles, and of a vertex the entries and
  // triangles in whose patches it is.
  bool patches = false, curved = false;
  Column<int> patch_start, patch_node, patch_of_start, patch_of, patch_of_triangle;
  Column<float> patch_weight, patch_rest;  // 1/m, 3 fields of entries; 1, 3 fields of triangles
  VecColumn patch_shift;                   // 1, 3 fields of triangles
  int patch_entries = 0;
  // rebuilt every step
  VecColumn path;             // m/s, of the straight path
  VecColumn about, from;      // m, off the straight paths: where the step is taken to end, at
                              // first as accelerated as the last one was, then as solved for; and
                              // where the last solve of the step started
  int linearised = 1;         // times in the step
  Column<float> element;      // 42 fields of `triangles`: ElementFields
  Column<float> block;        // kg, 9 fields of ring entries, by rows
  Column<float> tension;      // kg, of ring entries: see TensionMatrix
  Column<float> diagonal;     // kg, 6 fields of vertices: xx xy xz yy yz zz
  VecColumn moment;           // N m^(1/2), 3 fields of `triangles`: ShellBending
  Column<float> bend_factor;  // s^2, of a vertex: by it `bend` stands in the matrix
  VecColumn base;             // kg m, the sheet's own part of ClothSystem::base
};

/// Sheets that water changes (passes/cloth/wet_cloth.h). Columns are empty where none is ever wet.
struct WetState {
  bool any = false;
  // kept from step to step
  Column<float> wetness;  // of a vertex, 0 to 1
  // fixed
  Column<WetLaw> law;                         // of a sheet
  std::vector<VertexRange> sheets;            // their vertices
  Column<float> dry_mass, dry_law, dry_bend;  // as ClothState, ShellState
  VecColumn dry_push;
  // rebuilt every step
  Column<float> softness;  // of a sheet: its stiffness over that of the dry one
};

/// Coarse levels of the sheets' solve (passes/cloth/cloth_levels.h). None without shells.
struct ClothLevels {
  static constexpr int most = 12, functions = 4;
  struct Level {
    int first, count;  // of its aggregates: a is the parent of 4 a to 4 a + 3 of the one before
  };
  int levels = 0, aggregates = 0;  // of all levels, each padded to a multiple of eight
  bool on = false;                 // they take part: no obstacle holds a sheet in this step
  Level level[most];
  // fixed
  Column<int> leaf;           // of a vertex: its aggregate of the finest level
  Column<int> leaf_vertex;    // eight of these by slots: see slot()
  Column<float> leaf_weight;  // 1, and 0 of slots that hold none
  Column<int> reach;          // of a vertex: the coarsest level at which it has a neighbour in
                              // another aggregate of the one before
  VecColumn rest, centre;     // m, of vertices, and of aggregates
  VecColumn local,
      slot_local;  // m, of vertices from the centre of their finest aggregate, by slots
  // rebuilt every step
  Column<double> partial, strain;  // kg, kg m, kg m^2, of aggregates: sums of energies
  Column<float> held;              // kg, of vertices: what holds them but moving neighbours
  Column<float> inverse;           // 78 fields of aggregates: lower half of the inverse of B_l
  Column<float> moment, answer;    // 12 fields of aggregates

  /// Of the vertices of the finest aggregates those of eight stand slot by slot.
  static DRENCH_HD int slot(int a, int k) { return (a >> 3) * 64 + 8 * k + (a & 7); }
#if !defined(__CUDACC__)
  static DRENCH_HD Lanes slot(Lanes a, int k) { return {8 * a.base + 8 * k}; }
#endif
};

/// Pins that do more than hold where a vertex starts (passes/cloth/cloth_pins.h). Entries are those
/// of ClothTopology::pin_vertex, by PinsNow.
struct PinState {
  int count = 0;
  bool soft = false;   // any ever pulls
  bool drive = false;  // any moves in this step
  Column<int> vertex;
  Column<float> pull;              // N/m; 0: held; -1: let go
  VecColumn place, low, velocity;  // m, m, m/s
};

/// What contact among sheets asks of a vertex.
struct SheetVertex {
  Vec3<float> rest;      // m
  float half_thickness;  // m
  float root_friction;   // of Coulomb's coefficient
  int sheet;
  int point;  // the same of vertices that are sewn together: sewn_points
};

/// A vertex and its way in a step, as the search for pairs reads them.
struct SheetPoint {
  Vec3<float> x, way;    // m
  float half_thickness;  // m
  int vertex;
};

/// Two pieces of sheets that share no vertex: a vertex and the corners of a triangle, or the ends
/// of one edge and of another.
struct SheetPair {
  int vertex[4];
  int triangle;  // -1: edges
};

/// A pair in the sheets' system (passes/cloth/self_contact.h). Vectors of weights w_j: sum w_j x_j
/// is from the second piece to the first. Of a triangle at an obstacle the second is the obstacle:
/// the fourth weight is 0.
struct SheetRow {
  int vertex[4];
  float weight[4];
  int obstacle;           // -1: none
  Vec3<float> normal;     // unit, from the second to the first
  float gap;              // m, at the end of the straight paths
  float thickness;        // m, that the pair keeps apart
  bool pressed;           // by two obstacles, less than four thicknesses apart
  float target;           // m, gap that is asked for
  Vec3<float> slip;       // m, across the normal along the straight paths
  Vec3<float> speed;      // m/s, across the normal at the start of the step
  float mass;             // kg, reduced; 0: no row
  float friction;         // Coulomb's coefficient
  float stiffness, grip;  // kg, along the normal and across it; 0: none
  Vec3<float> rub;        // kg m, friction of what slides
  int released;           // times that the row was let go in this step
};

/// What A has of a row that bears.
struct BearingRow {
  int vertex[4];
  float weight[4];
  Vec3<float> normal;
  float along, across;  // kg, of the normal beyond what holds in all directions
  int row;
};

/// Contact of shells with themselves and each other (passes/cloth/self_contact_pairs.h).
struct SelfContact {
  bool any = false;     // sheets take part, or triangles meet obstacles
  float thickness = 0;  // m, of the thickest pair
  float edge = 0;       // m, mean
  float slack = 0;      // m, that a vertex may end off the path that the pairs were found for
  int pairs = 0, rows = 0, bearing = 0;
  // fixed
  Column<SheetVertex> vertex;
  Column<int> owned;  // of a triangle, bits: corners 0, 1, 2 and sides 01, 12, 20 that it stands
                      // for; -1: takes no part
  // rebuilt every step
  VecColumn to;  // m, ends of the paths that the pairs were found for
  Column<SheetPoint> point;
  VecColumn low, high;                  // m, boxes of the triangles' paths
  VecColumn sorted_low, sorted_high;    // m, in the order of the grid
  Column<int> cell, order, cell_start;  // triangles by the middle of their boxes
  GridShape grid{};
  Column<int> count, first;  // of a triangle: its pairs
  Column<SheetPair> pair;
  Column<SheetRow> row;
  Column<BearingRow> bears;
  Column<Vec3<float>> pull;       // kg m, of rows that bear, of the vector asked for last
  Column<int> key, start, entry;  // of a vertex: 4 bearing row + corner
  Column<float> entry_weight;
  Column<float> block;                 // as ClothSystem::factor, without rows; where there are any
  VecColumn load;                      // kg m, of the rows on a vertex, as it is in the right side
  VecColumn wanted;                    // m, ends of the paths that the guard shortens
  Column<float> portion, stop;         // of a vertex' path that it may go; of a pair's
  Column<int> pair_start, pair_entry;  // of a vertex: 4 pair + corner
};

/// A triangle and an obstacle that may meet.
struct TrianglePair {
  int triangle, obstacle;
  float distance;  // m, at the start of the step
};

/// A point of a triangle that an obstacle is nearest to.
struct TriangleTouch {
  int triangle, obstacle;
  float weight[3];
  float distance;  // m, at the start of the step
};

/// Triangles of shells at obstacles (passes/cloth/triangle_obstacles.h).
struct TriangleObstacles {
  bool any = false;  // there are shells and obstacles
  int pairs = 0, touches = 0;
  Column<int> side;  // of a triangle, bits: sides 01, 12, 20 that it stands for; -1: of springs
  // rebuilt every step
  Column<int> count, first;  // of a triangle: its pairs
  Column<TrianglePair> pair;
  Column<int> touch_count, touch_first;  // of a pair
  Column<TriangleTouch> found, touch;    // 4 a pair; those of all pairs
  Column<float> stop;                    // of a pair: how much of their paths its vertices may go
  Column<int> carrier;  // of a vertex: the obstacle that takes along what it stops; -1: none
};

/// Contacts sorted by triangle.
struct ContactState {
  Column<int> key, order, start;
  int near = 0;   // particles within the support radius of a sheet: the first of order
  int close = 0;  // of these, those that the contact distance may concern in this step
  // rows of the near list (ContactRows), rebuilt every step
  int stride = 0;        // from one corner's field to the next
  Column<int> particle;  // -1: empty
  Column<int> vertex;    // 3 fields
  Column<float> weight;  // 3 fields
  VecColumn change;      // kg m/s exact, kg m incompressible: what a row gives to its vertices
  // of the exact coupling (ExactContacts)
  VecColumn normal, velocity, drag;  // unit; m/s, of the particle; kg m/s
  Column<float> inverse_row;         // kg, 0 at and beyond a free edge
  Column<float> pressure_target, pressure_rate, pressure_scale;  // kg m/s, kg, 1
  Column<float> least;                                           // m/s, least speed of separation
  Column<float> drag_rate, drag_scale;                           // kg, 1
  Column<float> lambda;                                          // kg m/s
  // of the incompressible fluid (ClothRows)
  VecColumn gradient;                     // kg/m^4, G
  Column<float> recovery;                 // m, that the row may ask for in this step
  Column<float> compliance;               // kg^2/m^8
  Column<float> gap, open;                // m; fraction of the density that the cloth leaves
  Column<float> rate_along, rate_across;  // 1, of cloth that holds the fluid beside it
  VecColumn impulse;                 // 3 a triangle: what its contacts give to its corners, kg m/s
  Column<int> guarded, guard_start;  // places in order of the particles whose paths are tested
  int guard_count = 0;
  float cloth_reach = 0;  // m, how far cloth may move in the step before all are tested
};

/// Scalars of a pressure solve, in the memory of the backend: no iteration waits for the host.
struct SolveControl {
  int done = 0, iterations = 0;
  float residual = 1e30f, least_residual = 1e30f;  // mean, over the rest density
  float relaxation = 0.4f;  // below 1 / the largest eigenvalue of the scaled matrix: 0.5 diverges
  float momentum = 1.f, extrapolation = 0.f;
  float mean = 0.f;  // where the fluid is full: of the first guess, then kg/m^3, of the source
  int spent = 0;     // iterations of a solve before in the same step, and what it left
  float left = 0.f;
  int levels = 1;    // 1 while coarse levels take part
  float peak = 0.f;  // p / rho_0, m^2/s^2: the greatest of a column at rest with the same moments
};

/// Scalars of a viscous solve.
struct ViscousControl {
  int done = 0, converged = 0, iterations = 0;
  float residual = 0;        // RMS, over the RMS of the velocity
  float step = 0, turn = 0;  // along the direction, and of the old direction in the next
  double product = 0;        // of the residual with itself preconditioned
  double size = 0;           // what residuals are compared with: a sum of squares, m^2/s^2
  double sheet_square = 0, sheet_product = 0, sheet_curvature = 0;  // what sheets add to the sums
};

/// Columns of the implicit viscosity (passes/viscosity/viscosity_solve.h), allocated by the first
/// step that needs them.
struct ViscosityState {
  Column<Float4> solution, residual, direction, product;  // m/s
  Column<Float4> diagonal, cross;  // inverse blocks: xx, yy, zz and xy, yz, zx
  // What brakes a particle, see WallDrag; only where obstacles or sheets do
  // (passes/viscosity/body_drag.h).
  Column<Float4> body_rate, body_cross, body_source;
  Column<ViscousControl> control;
};

/// Nodes of a coarse level of the pressure solve along one axis.
struct NodeAxis {
  int n;       // 1: functions are constant along the axis
  int wraps;   // 1 on a periodic axis
  int halved;  // 1: half as many as on the finer level, which stand at its even nodes
  float edge;  // m, between nodes

  /// The nodes among which k of the finer level lies, b of weight 1 - a; it may be the same one.
  struct Parents {
    int a, b;
  };
  DRENCH_HD Parents parents(int k) const {
    if (!halved) return {k, k};
    if (n == 1) return {0, 0};
    const int a = k / 2, b = a + k % 2;
    return {a, b == n ? 0 : b};
  }
};

/// Nodes of a coarse level of the pressure solve (passes/pressure/multilevel.h), x fastest.
struct NodeLevel {
  NodeAxis x, y, z;
  int first;  // place of the first node in the columns

  DRENCH_HD int count() const { return x.n * y.n * z.n; }
  DRENCH_HD int index(int i, int j, int k) const { return (k * y.n + j) * x.n + i; }
  DRENCH_HD Vec3<int> place(int n) const { return {n % x.n, n / x.n % y.n, n / (x.n * y.n)}; }
};

/// Coarse levels of the pressure solve, rebuilt every solve.
struct Hierarchy {
  static constexpr int most = 12;
  int levels = 0;
  NodeLevel level[most];
  Vec3<int> shift, blocks;        // log2 of the cells along a block of the finest level; blocks
  Column<float> partial;          // 8 a block
  Column<float> answer, inverse;  // of the nodes of all levels: z, and 1 / stiffness
};

/// Columns of the incompressible solver, rebuilt every step (passes/pressure/pressure_rows.h). Its
/// warm start is FluidState::pressure_term.
struct PressureState {
  NeighbourLists lists;
  Column<Float4> place;  // m, position; w: a pressure
  // Scratch of a pass over the lists and what it is read by: vector fields, w: 0, and a scalar one.
  Column<Float4> scratch_a, scratch_b;
  Column<Float4> wall;  // kg/m^4, rho_0 times the gradient of the walls' share; w: times the share
  Column<Float4> correction, correction_cross;  // L of the gradients: xx, yy, zz and xy, yz, zx
  Column<Float4> mean_displacement;             // m, see MeanDisplacement; only in a closed domain
  Column<float> inverse_diagonal, source, before, next, product;
  Column<SolveControl> control;
  Hierarchy hierarchy;
};

/// Columns of surface tension (passes/tension/surface_tension.h), rebuilt every step.
struct TensionState {
  Column<Float4> normal;  // unit, outwards; w: 0 inside
  Column<Float4>
      wetting;  // unit normal of a wall; w: its surface (passes/tension/contact_angle.h). Or empty
};

/// Obstacles and their images as the step has them (obstacle_placement.h) and the level sets they
/// point to.
struct ObstacleState {
  struct Field {
    Column<int> block;
    Column<float> value;
    FieldView shape{};  // without pointers
  };
  int count = 0;  // with images
  Column<ObstacleView> view;
  std::vector<Field> field;   // two an obstacle
  Column<long long> stopped;  // 4 an obstacle: see StopSums
  ObstacleViews views() const { return {view.data(), count}; }
};

struct ClothFactor;  // passes/cloth/cloth_factor.h

struct State {
  Parameters parameters;
  WallTableData wall_table{};  // of the paper coupling
  FluidState fluid;
  PressureState pressure;
  ViscosityState viscosity;
  TensionState tension;
  ClothState cloth;
  ClothSystem cloth_system;
  ShellState shell;
  WetState wet;
  ClothLevels cloth_levels;
  std::shared_ptr<ClothFactor> cloth_factor;  // where it pays, on the CPU
  PinState pins;
  SelfContact self_contact;
  TriangleObstacles triangle_obstacles;
  ContactState contact;
  ObstacleState obstacles, sinks;
  WindNow wind;
  FrameNow frame;       // where Parameters::turns
  mutable Queue queue;  // where launches go, of what only reads the state as well
  Column<float> swap_float;
  double dt = 0;     // s, of the step being made
  int substeps = 1;  // cloth steps in it
  bool owes = true;  // FluidState::owed may hold something
  std::function<void()>
      after_substep;  // of an observer: called when all of a coupled substep is in place
  std::vector<uint64_t> removed;  // particles since the start, see HostState
  uint64_t guard_hits = 0;        // particles held back by continuous collision, since the start
  uint64_t guard_holds = 0;       // substeps in which vertices had to be stopped
};

/// Whether a step has nothing to do about sheets.
inline bool all_sheets_sleep(const State& state) {
  return state.cloth.asleep && state.contact.near == 0;
}

}  // namespace drench::sim::DRENCH_BACKEND
