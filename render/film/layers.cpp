#include "render/film/layers.h"

#include <algorithm>

namespace drench::render {

namespace {

/// Where the camera's shutter stands in frames, without blur on the frame.
double shutter(const Shot& shot, double at) { return shot.render.motion_blur ? at : 0; }

std::vector<float> ids_of(const NameIndex& things) {
  std::vector<float> ids;
  for (const std::string& name : things.name) ids.push_back(cryptomatte_id(name));
  return ids;
}

}  // namespace

void NameIndex::add(const std::string& next) {
  const auto found = std::find(name.begin(), name.end(), next);
  index.push_back(int(found - name.begin()));
  if (found == name.end()) name.push_back(next);
}

LayerFilm::LayerFilm(const Shot& shot, int frame, const Scene& scene, int width, int height)
    : scene_(&scene),
      want_(shot.layers),
      features_(shot.render.denoise),
      width_(width),
      height_(height),
      corner_(shot.render.crop_min),
      fps_(shot.timeline.fps),
      shutter_open_(shutter(shot, shot.camera.shutter_open)),
      shutter_frames_(shutter(shot, ShutterCurve::end(shot.camera)) - shutter_open_),
      frame_camera_(shot.camera, frame, frame + 1, shot.render.width, shot.render.height),
      before_camera_(shot.camera, frame - 1, frame, shot.render.width, shot.render.height),
      catchers_(scene.has_catchers()) {
  const size_t pixels = size_t(width_) * height_;
  if (records()) pixel_.resize(pixels);
  if (want_.opacity) background_.resize(pixels, Imath::V3d(0));
  for (size_t k = 0; k < scene.object_count(); ++k) {
    objects_.add(scene.object(uint32_t(k)).name);
    materials_.add(scene.object(uint32_t(k)).material_name);
  }
  // Which layers there are must not differ between the frames of a shot.
  if (want_.light_groups) {
    groups_ = scene.lights().groups();
    groups_.push_back("caustics");
    light_.resize(pixels * groups_.size(), Imath::V3d(0));
    if (catchers_) caught_ = light_;
    shown_groups_ = groups_.size() - (shot.render.photons > 0 ? 0 : 1);
  }
  objects_.add("ground");
  materials_.add(shot.ground.material);
}

bool LayerFilm::records() const {
  return features_ || catchers_ || want_.opacity || want_.albedo || want_.normal || want_.depth ||
         want_.position || want_.motion || want_.light_groups || want_.cryptomatte;
}

PathRecord LayerFilm::blank() const {
  PathRecord record;
  record.light.resize(groups_.size());
  if (catchers_) record.matte.light.resize(groups_.size());
  clear(record);
  return record;
}

void LayerFilm::clear(PathRecord& record) const {
  for (std::vector<V3f>* light : {&record.light, &record.matte.light})
    std::fill(light->begin(), light->end(), V3f(0));
  record.matte.background = record.matte.catcher = record.matte.with = record.matte.without =
      V3f(0);
  record.first = Hit{};
  record.albedo = record.normal = V3f(0);
  record.shaded = false;
}

void LayerFilm::archive(CheckpointArchive& file) {
  for (auto* column : {&light_, &caught_, &background_}) file.column(*column);
  for (Pixel& p : pixel_) {
    for (V3f* sum : {&p.albedo, &p.normal, &p.albedo2, &p.normal2}) file.value(*sum);
    file.value(p.inverse_depth), file.value(p.inverse_depth2), file.value(p.nearest);
    file.value(p.usual);
    p.object.archive(file), p.material.archive(file);
  }
}

/// Rows count down, the layer up.
V3f LayerFilm::motion_of(const PathRecord& record, const CameraPose& eye, float frames) const {
  const V3f per_frame = scene_->velocity(record.first) * float(1 / fps_);
  const double since_frame = shutter_open_ + record.time * shutter_frames_;
  const V3f now = record.position - per_frame * float(since_frame);
  const V3f then = now + per_frame * frames;
  const CameraPose& here = frame_camera_.open();
  const V2f from = frame_camera_.project(here, now), to = frame_camera_.project(eye, then);
  const float depth = dot(now - here.position, here.forward);
  return {to.x - from.x, from.y - to.y, dot(then - eye.position, eye.forward) - depth};
}

/// Of what is infinitely far away.
V3f LayerFilm::motion_of_sky(size_t pixel, const CameraPose& eye) const {
  const V2f film(float(corner_.x + int(pixel % size_t(width_))) + 0.5f,
                 float(corner_.y + int(pixel / size_t(width_))) + 0.5f);
  const Ray ray = frame_camera_.ray<CameraMotion::still, Lens::pinhole>(film, V2f(0), 0);
  const V2f to = frame_camera_.project(eye, eye.position + ray.direction);
  return {to.x - film.x, film.y - to.y, 0};
}

void LayerFilm::add_light(size_t pixel, const PathRecord& record) {
  const size_t groups = record.light.size();
  for (size_t g = 0; g < groups; ++g) light_[pixel * groups + g] += Imath::V3d(record.light[g]);
  for (size_t g = 0; g < record.matte.light.size(); ++g)
    caught_[pixel * groups + g] += Imath::V3d(record.matte.light[g]);
}

/// A group's part of the beauty: of what catchers have of it the fraction that the beauty has of
/// all.
Imath::V3d LayerFilm::light(size_t pixel, size_t group, int samples, const PlateFilm& plate) const {
  const size_t k = pixel * groups_.size() + group;
  Imath::V3d sum = light_[k];
  if (caught_.empty()) return sum / samples;
  const V3f with = plate.with(pixel), added = plate.added(pixel);
  for (int c = 0; c < 3; ++c)
    if (with[c] > 0) sum[c] -= caught_[k][c] * (1 - double(added[c]) / with[c]);
  return sum / samples;
}

void LayerFilm::add(size_t pixel, const PathRecord& record) {
  add_light(pixel, record);
  if (!background_.empty()) background_[pixel] += Imath::V3d(record.matte.background);
  Pixel& p = pixel_[pixel];
  p.albedo += record.albedo;
  p.albedo2 += record.albedo * record.albedo;
  const int object = record.first.kind == Hit::Kind::ground   ? int(scene_->object_count())
                     : record.first.kind == Hit::Kind::object ? int(record.first.index)
                                                              : no_object;
  if (features_) vote(p.usual, object, record);
  if (object == no_object) return;
  p.normal += record.normal;
  p.normal2 += record.normal * record.normal;
  const CameraPose& eye = frame_camera_.open();
  const float depth = dot(record.position - eye.position, eye.forward);
  p.inverse_depth += 1 / depth;
  p.inverse_depth2 += 1 / (depth * depth);
  if (depth < p.nearest.depth) {
    p.nearest = {depth, record.position};
    if (want_.motion) p.nearest.motion = motion_of(record, frame_camera_.close(), 1);
  }
  if (!want_.cryptomatte) return;
  p.object.add(objects_.index[size_t(object)]);
  p.material.add(materials_.index[size_t(object)]);
}

void LayerFilm::vote(Usual& usual, int object, const PathRecord& record) const {
  if (usual.votes > 0) {
    usual.votes += usual.object == object ? 1 : -1;
    return;
  }
  usual = {object, 1};
  if (object == no_object) return;
  usual.after = motion_of(record, frame_camera_.close(), 1);
  usual.before = motion_of(record, before_camera_.open(), -1);
}

FilmLayer LayerFilm::layer(const std::string& name, const std::vector<std::string>& channels,
                           FilmLayer::Precision precision) const {
  return {name, channels, precision,
          std::vector<float>(channels.size() * size_t(width_) * height_)};
}

std::vector<FilmLayer> LayerFilm::finish(const std::vector<PixelSum>& pixels,
                                         const PlateFilm& plate) const {
  using enum FilmLayer::Precision;
  std::vector<FilmLayer> out;
  const std::vector<std::string> rgb{"R", "G", "B"}, xyz{"X", "Y", "Z"};
  const auto fill = [&](const std::string& name, const std::vector<std::string>& channels,
                        FilmLayer::Precision precision, auto&& value) {
    out.push_back(layer(name, channels, precision));
    const size_t n = channels.size();
    for (size_t p = 0; p < pixels.size(); ++p) {
      const auto v = value(p);
      for (size_t c = 0; c < n; ++c) out.back().value[n * p + c] = float(v[int(c)]);
    }
  };
  const auto mean = [&](const V3f& sum, size_t p) { return sum * (1.f / pixels[p].samples()); };
  if (want_.albedo) fill("albedo", rgb, half, [&](size_t p) { return mean(pixel_[p].albedo, p); });
  if (want_.normal) fill("N", xyz, half, [&](size_t p) { return mean(pixel_[p].normal, p); });
  if (want_.depth) fill("depth", {"Z"}, full, [&](size_t p) { return &pixel_[p].nearest.depth; });
  if (want_.position) fill("P", xyz, full, [&](size_t p) { return pixel_[p].nearest.position; });
  if (want_.motion) fill("motion", xyz, full, [&](size_t p) { return pixel_[p].nearest.motion; });
  if (want_.variance)
    fill("variance", rgb, full, [&](size_t p) {
      return V3f(pixels[p].variance(0), pixels[p].variance(1), pixels[p].variance(2));
    });
  if (want_.samples)
    fill("samples", {"Y"}, full, [&](size_t p) { return std::array{pixels[p].samples()}; });
  for (size_t g = 0; g < shown_groups_; ++g)
    fill("light_" + groups_[g], rgb, half,
         [&](size_t p) { return light(p, g, pixels[p].samples(), plate); });
  if (want_.opacity)
    fill("opacity", rgb, half, [&](size_t p) {
      return Imath::V3d(1) - background_[p] / pixels[p].samples() - Imath::V3d(plate.seen(p));
    });
  if (want_.cryptomatte) {
    add_matte(out, "CryptoObject", objects_, &Pixel::object, pixels);
    add_matte(out, "CryptoMaterial", materials_, &Pixel::material, pixels);
  }
  return out;
}

void LayerFilm::add_matte(std::vector<FilmLayer>& out, const std::string& name,
                          const NameIndex& things, CryptomattePixel Pixel::*which,
                          const std::vector<PixelSum>& pixels) const {
  const std::vector<float> ids = ids_of(things);
  const size_t first = out.size();
  for (int part = 0; part < CryptomattePixel::ranks / 2; ++part)
    out.push_back(
        layer(name + "0" + std::to_string(part), {"R", "G", "B", "A"}, FilmLayer::Precision::full));
  for (size_t p = 0; p < pixels.size(); ++p) {
    const auto ranked = (pixel_[p].*which).ranked(ids, pixels[p].samples());
    for (size_t k = 0; k < ranked.size(); ++k) out[first + k / 4].value[4 * p + k % 4] = ranked[k];
  }
}

void LayerFilm::add_features(NoisyPicture& picture, const std::vector<PixelSum>& pixels) const {
  const auto add = [&](auto&& sum, auto&& squares, double unit) {
    NoisyPicture::Plane mean(pixels.size()), variance(pixels.size());
    for (size_t p = 0; p < pixels.size(); ++p) {
      const double n = pixels[p].samples(), m = sum(pixel_[p]) / n;
      mean[p] = float(m / unit);
      variance[p] = float(std::max(0., squares(pixel_[p]) / n - m * m) / ((n - 1) * unit * unit));
    }
    picture.feature.push_back(std::move(mean));
    picture.feature_variance.push_back(std::move(variance));
  };
  for (int c = 0; c < 3; ++c)
    add([c](const Pixel& p) { return double(p.albedo[c]); },
        [c](const Pixel& p) { return double(p.albedo2[c]); }, 1);
  for (int c = 0; c < 3; ++c)
    add([c](const Pixel& p) { return double(p.normal[c]); },
        [c](const Pixel& p) { return double(p.normal2[c]); }, 1);
  double largest_nearness = 0;
  for (size_t p = 0; p < pixels.size(); ++p)
    largest_nearness =
        std::max(largest_nearness, double(pixel_[p].inverse_depth) / pixels[p].samples());
  if (!(largest_nearness > 0)) largest_nearness = 1;
  add([](const Pixel& p) { return double(p.inverse_depth); },
      [](const Pixel& p) { return double(p.inverse_depth2); }, largest_nearness);
  picture.feature_unit.assign(picture.feature.size(), 1);
  picture.feature_unit.back() = float(largest_nearness);
}

void LayerFilm::add_motion(NoisyPicture& picture) const {
  for (auto& side : picture.motion)
    for (NoisyPicture::Plane& plane : side) plane.resize(pixel_.size());
  for (size_t p = 0; p < pixel_.size(); ++p) {
    const bool sky = pixel_[p].usual.object == no_object;
    const V3f before = sky ? motion_of_sky(p, before_camera_.open()) : pixel_[p].usual.before;
    const V3f after = sky ? motion_of_sky(p, frame_camera_.close()) : pixel_[p].usual.after;
    picture.motion[0][0][p] = before.x, picture.motion[0][1][p] = -before.y;
    picture.motion[1][0][p] = after.x, picture.motion[1][1][p] = -after.y;
  }
}

std::vector<std::pair<std::string, std::string>> LayerFilm::header() const {
  if (!want_.cryptomatte) return {};
  auto out = cryptomatte_header("CryptoObject", objects_.name);
  const auto material = cryptomatte_header("CryptoMaterial", materials_.name);
  out.insert(out.end(), material.begin(), material.end());
  return out;
}

}  // namespace drench::render
