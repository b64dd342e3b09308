#pragma once
// Everything a ray can meet in one frame: Embree scenes of the fluid and the cloth, the ground, the
// lights, and which features of the path loop the frame needs.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <bit>

#include "pipeline/contract/frames.h"
#include "pipeline/contract/hash.h"
#include "render/bsdf/bsdf.h"
#include "render/bsdf/material.h"
#include "render/frame_geometry.h"
#include "render/light/lights.h"
#include "render/options.h"
#include "render/packed.h"
#include "render/scene/camera.h"
#include "render/scene/embree.h"

namespace drench::render {

/// The dielectric bodies that a point is in, one bit each; of several the highest is the medium.
using Bodies = uint32_t;

/// What fills a point of space.
struct Medium {
  V3f absorption{0, 0, 0};  // 1/m
  float ior = 1;
};

class RotationalMotion;

/// What a ray met first.
struct Hit {
  enum class Kind { nothing, light, ground, object };
  Kind kind = Kind::nothing;
  float distance = 0;     // m; infinity for nothing
  uint32_t index = 0;     // of the light or object
  uint32_t triangle = 0;  // or sphere
  float u = 0, v = 0;     // barycentric weights of vertices 1 and 2
};

/// Of a triangle.
struct Corners {
  Packed position[3];  // m
  Packed normal[3];    // of any length; of what moves straight those of shutter open

  Packed across() const { return cross(position[1] - position[0], position[2] - position[0]); }
};

/// One mesh, or many spheres, at shutter open and, if it moves, at shutter close.
struct SceneObject {
  struct Key {
    std::vector<V3f> position, normal;
  };

  std::string name, material_name;
  std::vector<Imath::Vec3<uint32_t>> triangle;
  std::vector<V3f> position, position_close;  // m; the last entry is padding for Embree
  std::vector<Key> key;  // at even times of the shutter, of what does not move straight; else empty
  std::vector<Imath::V4f> sphere, sphere_close;  // m: centre and radius; in place of triangles
  std::vector<V3f> normal;                       // unit, per vertex; empty: flat
  std::vector<V2f> uv;                           // may be empty
  std::vector<V3f> velocity;     // m/s; kept for the layer of motion and the denoiser only
  std::vector<uint8_t> contact;  // by triangle, 1: lies on a sheet; may be empty
  std::vector<float> wetness;    // of cloth, 0 to 1; may be empty
  uint32_t material = 0;
  int light = -1;   // its number among the meshes that shine
  Bodies body = 0;  // its bit, if it is a dielectric
  Matte matte = Matte::none;
  Digest contents;      // of what stands; 0 of what moves
  Imath::Box3f bounds;  // over the shutter
  EmbreeScene scene;  // its own, so that motion keys and robustness are paid for by this mesh only

  bool moves() const { return !position_close.empty() || !sphere_close.empty(); }
  /// Positions at even times of the shutter; one if it stands.
  std::vector<const V3f*> keys() const {
    std::vector<const V3f*> out;
    for (const Key& k : key) out.push_back(k.position.data());
    if (out.empty()) out.push_back(position.data());
    if (key.empty() && !position_close.empty()) out.push_back(position_close.data());
    return out;
  }
  /// At a time of the shutter.
  Corners corners(uint32_t of, float time) const {
    if (!position_close.empty()) return moved(of, time);
    const auto& t = triangle[of];
    const V3f *p = position.data(), *n = normal.data();
    return {{Packed::load(p[t.x]), Packed::load(p[t.y]), Packed::load(p[t.z])},
            {Packed::load(n[t.x]), Packed::load(n[t.y]), Packed::load(n[t.z])}};
  }
  /// How far a point of a triangle moves on its straight segment, along each axis, m. By so much
  /// the ends, between which a position is interpolated, may be larger than that position.
  V3f displacement(const Hit& hit, float time) const;

 private:
  Corners moved(uint32_t of, float time) const;
  std::pair<Packed, Packed> moved_vertex(uint32_t vertex, float time) const;
  size_t segment(float time) const {
    return std::min(size_t(time * float(key.size() - 1)), key.size() - 2);
  }
};

/// What rays meet: all there is, or what the plate shows, holdouts and shadow catchers alone.
enum class World { whole, plate };

/// A point of a surface.
struct Surface {
  V3f position;          // m
  float reach = 0;       // m, along the normal: |computed - exact| of the position is less
  V3f geometric_normal;  // unit, outward
  V3f shading_normal;    // unit, in the hemisphere of geometric_normal
  V2f uv;
  const ShadingMaterial* material = nullptr;
  int light = -1;  // the object's
  uint32_t triangle = 0;
  Bodies body = 0;       // whose surface it is; 0: of no dielectric
  bool contact = false;  // of the fluid with a sheet: no air meets water here
  bool small = false;    // a sphere of foam: too small for a density of photons

  /// From the triangle up to the curved patch that the normals of its corners make of it, on the
  /// side that was met, m; 0 of what ends light by its triangles, or is hollow. Hanika 2021,
  /// "Hacking the Shadow Terminator".
  V3f lift{0, 0, 0};
  bool lifts() const { return !is_black(lift); }

  /// Of coats and fabric: the normal that light must be in front of, and that to shade with. Where
  /// the patch is they are one.
  std::pair<V3f, V3f> normals(const V3f& outgoing) const {
    if (!lifts()) return {geometric_normal, shading_normal};
    const V3f facing = FacingFrame(outgoing, geometric_normal, shading_normal).basis.normal;
    return {facing, facing};
  }

  /// Whether a direction leads out of the patch and into the triangle.
  bool passes_over(const V3f& direction) const {
    if (!lifts()) return false;
    const float up = dot(lift, geometric_normal);
    return up * dot(direction, geometric_normal) < 0 && up * dot(direction, shading_normal) > 0;
  }

  /// Where a ray in `direction` starts: moved off the surface just beyond the rounding error, off
  /// the patch where it passes over the triangle.
  V3f leave(const V3f& direction) const {
    if (passes_over(direction)) return position + lift + off(lift);
    return position + off(direction);
  }

  /// Starts a ray there in that direction. It is read soon, as Packed::load does.
  void send(Ray& ray, const V3f& direction) const {
    Packed(leave(direction)).store(ray.origin);
    Packed(direction).store(ray.direction);
  }

 private:
  V3f off(const V3f& towards) const {
    return geometric_normal * (dot(towards, geometric_normal) > 0 ? reach : -reach);
  }
};

class Scene {
 public:
  /// @throws Error for a mesh, material, light or camera that cannot be rendered.
  Scene(const Shot& shot, int frame, const FrameGeometry& geometry, const RenderOptions& options);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  Hit intersect(const Ray& ray, Coherence coherence, World world = World::whole) const;
  enum class Gaps { closed, open };  // open: what has gaps is not there
  /// What a ray is aimed at: how far away it is, and its number if it is a lamp.
  struct Target {
    float distance;  // m
    int lamp = -1;
  };
  /// Whether anything lies on the ray before (1 - 1e-4) of the distance of what it is aimed at.
  bool occluded(const Ray& ray, const Target& target, World world = World::whole,
                Gaps gaps = Gaps::closed) const;
  /// The fraction of light that comes along the ray: 0, 1, or what gaps of cloth let through.
  float transmitted(const Ray& ray, const Target& target, World world = World::whole) const;
  /// Whether the fluid is the medium in these bodies.
  bool in_fluid(Bodies in) const { return &medium(in) != &medium(in & ~fluid_); }
  /// Whether the fluid is where a ray starts that came through a gap of cloth.
  bool fluid_beyond(const Ray& ray) const;
  /// Asks for what `surface` will read, first which vertices and then these.
  void prefetch_triangle(const Hit& hit) const {
    const SceneObject* object = triangles_hit(hit);
    if (object) __builtin_prefetch(&object->triangle[hit.triangle]);
  }
  void prefetch_vertices(const Hit& hit) const {
    const SceneObject* object = triangles_hit(hit);
    if (!object) return;
    const auto& t = object->triangle[hit.triangle];
    for (const uint32_t vertex : {t.x, t.y, t.z}) {
      __builtin_prefetch(&object->position[vertex]);
      __builtin_prefetch(&object->normal[vertex]);
      if (object->moves()) __builtin_prefetch(&object->position_close[vertex]);
    }
  }
  Surface surface(const Ray& ray, const Hit& hit) const;
  /// Of cloth: where u and v grow, the directions of warp and weft; 0 where there are no uv.
  std::pair<V3f, V3f> yarns_along(const Hit& hit, float time) const;
  /// Of cloth: the fraction that is wet, 0 to 1.
  float wetness(const Hit& hit) const;
  /// The bodies that a point lies in.
  Bodies bodies_at(const V3f& point, float time) const;
  const Medium& medium(Bodies in) const { return medium_[size_t(std::bit_width(in))]; }
  /// Of a rough body's surface seen from within the bodies `in`; null if it divides equal indices.
  const AlbedoTable* interface_albedo(const Surface& surface, Bodies in) const;
  /// Of a coat that lies in the bodies `in`.
  const AlbedoTable& coat_albedo(const ShadingMaterial& material, Bodies in) const {
    return *material.albedo_outside[size_t(std::bit_width(in))];
  }

  Matte matte(const Hit& hit) const {
    return hit.kind == Hit::Kind::object ? objects_[hit.index].matte : ground_matte_;
  }
  bool has_catchers() const;
  /// Bodies of the plate's world.
  Bodies plate_bodies() const;
  /// Whether a drawn light is there in the plate's world, too.
  bool in_plate(const LightSample& light) const;

  const ShutterCamera& camera() const { return camera_; }
  const Lights& lights() const { return lights_; }
  const SceneObject& object(uint32_t index) const { return objects_[index]; }
  size_t object_count() const { return objects_.size(); }
  /// m/s, of what was hit; 0 unless the layer of motion is asked for.
  V3f velocity(const Hit& hit) const;
  bool is_rough(const SceneObject& object) const { return materials_[object.material].alpha > 0; }
  const std::vector<uint32_t>& bodies() const { return bodies_; }  // objects, by bit
  const ShadingMaterial& fluid_material() const { return materials_[objects_[0].material]; }
  Bodies fluid() const { return fluid_; }  // 0: no dielectric
  bool lights_in_bodies() const { return lights_in_bodies_; }
  bool lamps_in_bodies() const { return lamps_in_bodies_; }
  unsigned features() const { return features_; }

 private:
  static constexpr float visible_motion = 0.1f;  // pixels over the shutter

  void add_obstacle(const Shot& shot, int frame, const ObstacleFrame& obstacle);
  void add_foam(const FoamFrame& foam);
  void add_object(const TriangleMesh& mesh, const std::string& name, const std::string& what,
                  uint32_t material, Matte matte, const RotationalMotion* motion = nullptr);
  /// Straight segments that its course over the shutter takes; 0: its velocity says enough.
  int segments_of(const TriangleMesh& mesh, const RotationalMotion& motion) const;
  void add_motion_keys(SceneObject& object, const TriangleMesh& mesh,
                       const RotationalMotion& motion, int segments) const;
  void check_yarns(const SceneObject& object, const std::string& what) const;
  void find_fabrics();
  void add_wetness(SceneObject& object, const TriangleMesh& mesh, const std::string& what);
  uint32_t add_material(const Shot& shot, const std::string& name);
  enum class FirstObject { fluid, other };
  void find_bodies(FirstObject first);
  void find_mesh_lights();
  void find_lights_in(uint32_t body);
  /// Whether anything in a box may lie within a body, or on its surface, while the shutter is open.
  bool holds(uint32_t body, const Imath::Box3f& part) const;
  bool is_inside(uint32_t object, const V3f& point, float time) const;
  void find_albedos();
  void build(SceneObject& object);
  Digest contents_of(const TriangleMesh& mesh, const std::string& name, uint32_t material) const;
  EmbreeGeometry triangles_of(const SceneObject& object) const;
  EmbreeGeometry spheres_of(const SceneObject& object) const;
  void find_features(Background background);
  bool has_mattes() const;
  bool moves_visibly(const TriangleMesh& mesh) const;
  bool moves_visibly(const FoamFrame& foam) const;
  /// Null if it is no object of triangles.
  const SceneObject* triangles_hit(const Hit& hit) const {
    if (hit.kind != Hit::Kind::object || !objects_[hit.index].sphere.empty()) return nullptr;
    return &objects_[hit.index];
  }
  /// The nearest point of one object.
  Hit meet(uint32_t object, const Ray& ray, float reach) const;
  /// The same, written where it is nearer than what was there.
  void meet(uint32_t object, const Ray& ray, Coherence coherence, Hit& nearest) const;
  float ground_distance(const V3f& origin, const V3f& direction) const;

  double open_ = 0, close_ = 0;  // shutter of all rows relative to the frame, frames
  double fps_ = 24;
  bool keeps_velocities_ = false;
  ShutterCamera camera_;
  std::shared_ptr<SceneCache> cache_;
  Lights lights_;
  std::vector<ShadingMaterial> materials_;
  std::vector<std::string> material_names_;
  std::vector<SceneObject> objects_;
  bool has_ground_ = false;
  V3f ground_center_;
  float ground_half_size_ = 0;
  uint32_t ground_material_ = 0;
  Matte ground_matte_ = Matte::none;
  std::vector<uint32_t> bodies_;
  std::vector<Medium> medium_{{}};  // air, and each body's
  Bodies fluid_ = 0;
  bool lights_in_bodies_ = false, lamps_in_bodies_ = false;
  bool has_gaps_ = false;
  unsigned features_ = 0;
};

}  // namespace drench::render
