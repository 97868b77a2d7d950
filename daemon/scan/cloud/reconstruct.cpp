// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/reconstruct.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "core/calibrate/watch/stray_symbols.hpp"
#include "core/cloud/shade_points.hpp"
#include "core/decode/decoder.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/geometry/robust.hpp"
#include "core/utc_text.hpp"
#include "daemon/scan/cloud/seen_light.hpp"
#include "daemon/scan/cloud/texture_cameras.hpp"
#include "drivers/camera/frame_image.hpp"
#include "drivers/files/encode_png.hpp"
#include "picture/draw_decoding.hpp"

namespace slsd {
namespace {

using std::chrono::steady_clock;

std::chrono::system_clock::time_point utc_time(MonotonicTime time) {
  return std::chrono::system_clock::now() - (steady_clock::now() - time);
}

void append(const Decoding& decoding, std::uint8_t camera, ScanResult& result) {
  result.cloud.points.insert(result.cloud.points.end(), decoding.points.begin(), decoding.points.end());
  for (std::size_t i = 0; i < decoding.counts.size(); ++i) result.regions[i] += decoding.counts[i];
  for (std::size_t i = 0; i < decoding.rules.size(); ++i) result.rules[i] += decoding.rules[i];
  for (const RegionSeen& region : decoding.regions) {
    if (region.status == RegionStatus::kDecoded) continue;
    result.reasons.push_back({region.centre_px.x(), region.centre_px.y(), camera, region.rule, region.guard});
  }
}

ScanResult describe(const FrameSet& set, const ScanSetup& setup, const std::string& scan_id) {
  ScanResult result;
  result.capture_time = set.capture_time;
  result.skew = set.skew;
  result.received = set.received();
  result.cloud.lattice_columns = setup.pattern.whole_columns();
  result.cloud.lattice_rows = setup.pattern.whole_rows();
  result.cloud.cameras = static_cast<int>(setup.calibration->cameras.size());
  result.cloud.scan_id = scan_id;
  result.exposed = utc_time(set.frames.front().exposure_start());
  result.cloud.time = utc_text_ms(result.exposed);
  result.cloud.frame = set.frames.front().sequence();
  return result;
}

Result<> keep_frames(const std::vector<Frame>& frames, Picture light, const ScanSetup& setup, FrameCoding coding,
                     ScanResult& result) {
  for (std::size_t i = 0; coding != FrameCoding::kNone && i < frames.size(); ++i) {
    auto image = image_of(frames[i], coding, setup.camera_names[i]);
    if (!image) return tl::unexpected(image.error());
    image->light = light;
    result.frames.push_back(std::move(*image));
  }
  return {};
}

Result<> keep_frames(const FrameSet& set, const ScanSetup& setup, FrameCoding coding, ScanResult& result) {
  auto kept = keep_frames(set.frames, Picture::kPattern, setup, coding, result);
  if (kept) kept = keep_frames(set.white, Picture::kWhite, setup, coding, result);
  if (kept) kept = keep_frames(set.dark, Picture::kBlack, setup, coding, result);
  return kept;
}

// Measures the light of one camera's points.
void shade(std::span<CloudPoint> points, const SceneLight& light, ScanResult& result) {
  if (!light.white && !light.dark) return;
  const std::size_t saturated = shade_points(points, light);
  if (light.white) result.saturated = result.saturated.value_or(0) + saturated;
}

/// Limits the next frame to the pixels that can see the box, if there is one.
/// @param mapper  null without a dense cloud
void limit_to_box(const CloudPart& part, const ScanSetup& setup, Decoder& decoder, DenseMapper* mapper) {
  std::optional<PixelRectangle> pixels;
  if (part.box) {
    const CalibratedCamera& camera = setup.calibration->cameras[decoder.camera_index()];
    pixels = pixels_of_box(*part.box, camera, setup.depth_min_mm, setup.depth_max_mm).value_or(PixelRectangle{});
  }
  if (mapper != nullptr) mapper->set_part(pixels);
  decoder.set_part(mapper != nullptr ? mapper->part_of_symbols() : pixels);
}

/// A camera's frame under the pattern, and what decodes it.
struct CameraFrame {
  GreyView image;
  Decoder& decoder;
  DenseMapper* mapper;  ///< null without a dense cloud
  std::size_t camera;   ///< index in the setup
  const SceneLight& light;
};

/// A point for each pixel of a camera, from the symbols of its frame.
DenseView measure_pixels(const CameraFrame& frame, ScanSetup& setup, const ScanRequest& request, ScanResult& result) {
  const auto& [image, decoder, mapper, camera, light] = frame;
  DecodedSymbols symbols = decoder.symbols(*setup.crew);
  if (light.white) symbols.noise = measure_noise(image, light.full);  // the symbols may come from the quotient image
  if (DenseMap& map = mapper->map(); map.pixels.empty()) map = setup.dense->spare_map();
  DenseMap& map = request.of_stream ? mapper->measure_next(image, light.full, symbols, *setup.crew)
                                    : mapper->measure(image, light.full, symbols, *setup.crew);
  DenseView view{std::exchange(map, {}),
                 mapper->rays(),
                 setup.calibration->cameras[decoder.camera_index()].rig_from_camera,
                 decoder.camera_index(),
                 setup.camera_names[camera],
                 mapper->epipolar_offset_px()};
  if (light.white || light.dark) {
    const std::size_t saturated = shade_view(view, light, request.colour);
    if (light.white) result.dense_saturated = result.dense_saturated.value_or(0) + saturated;
  }
  return view;
}

/// Adds the surface outside the box, too: it may hide the box from a texture camera. The cloud itself stays the same as
/// without colours.
Result<> add_whole_surface(const CameraFrame& frame, ScanSetup& setup, const ScanRequest& request,
                           TextureCameras& textures) {
  limit_to_box({}, setup, frame.decoder, frame.mapper);
  const auto decoding = decode_in_light(frame.decoder, frame.image, frame.light, nullptr, setup.crew.get());
  if (!decoding)
    return fail(decoding.error().code, decoding.error().message, "camera " + setup.camera_names[frame.camera]);
  const std::vector<CloudPoint> points((*decoding)->points.begin(), (*decoding)->points.end());
  ScanResult ignored;
  std::optional<DenseView> pixels;
  if (frame.mapper != nullptr) pixels = measure_pixels(frame, setup, request, ignored);
  textures.add(setup, frame.decoder.camera_index(), points, pixels ? &*pixels : nullptr);
  if (pixels) frame.mapper->map() = std::move(pixels->map);
  return {};
}

// Waits for half of the time left. A stream does not wait: its next cloud carries the answer.
std::string why_empty(const FrameSet& set, const ScanSetup& setup, std::size_t lane, const ScanRequest& request,
                      const ScanResult& result) {
  const auto now = steady_clock::now();
  const MonotonicTime until = request.of_stream || request.deadline < now ? now : now + (request.deadline - now) / 2;
  std::vector<std::size_t> cameras;
  for (const Decoder& decoder : setup.lanes[lane]) cameras.push_back(decoder.camera_index());
  const ScanBasis basis{setup.pattern, setup.calibration, {setup.depth_min_mm, setup.depth_max_mm}, setup.doubts};
  return setup.empty_clouds->explain(basis, set, cameras, result, until);
}

}  // namespace

Result<ScanResult> reconstruct(const FrameSet& set, ScanSetup& setup, std::size_t lane, const ScanRequest& request,
                               const std::string& scan_id) {
  ScanResult result = describe(set, setup, scan_id);
  const std::size_t pictured = setup.camera_index(request.camera);
  StageClock clock;
  const Crew::Turn turn(*setup.crew);
  const auto wanted = setup.part_of(request);
  if (!wanted) return tl::unexpected(wanted.error());
  const CloudPart& part = *wanted;
  auto dense = request.formats.dense() ? setup.dense->cloud() : nullptr;
  auto textures = request.colour ? TextureCameras::of(set, setup) : TextureCameras();
  if (!textures) return tl::unexpected(std::move(textures.error()));
  const bool own_colours = request.colour && textures->empty();
  bool sees_colours = !textures->empty();
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    clock.start();
    const auto begin = steady_clock::now();
    Decoder& decoder = setup.lanes[lane][i];
    SeenLight seen;
    if (auto lit = read_light(set, setup, i, own_colours, seen); !lit) return tl::unexpected(std::move(lit.error()));
    const SceneLight& light = seen.light;
    sees_colours = sees_colours || light.white_colours != nullptr;
    result.full_levels.push_back(light.full);
    DenseMapper* mapper =
        dense ? &setup.dense->of(lane, i, decoder, setup.pattern, *setup.calibration, setup.decode) : nullptr;
    const CameraFrame frame{set.frames[i].image(), decoder, mapper, i, light};
    if (part.box && !textures->empty()) {
      if (auto added = add_whole_surface(frame, setup, request, *textures); !added)
        return tl::unexpected(added.error());
    }
    limit_to_box(part, setup, decoder, mapper);
    const auto decoding = decode_in_light(decoder, set.frames[i].image(), light, &clock, setup.crew.get());
    result.decode_time += steady_clock::now() - begin;
    if (!decoding) {
      return fail(decoding.error().code, decoding.error().message, "camera " + setup.camera_names[i]);
    }
    const std::size_t before = result.cloud.points.size();
    append(**decoding, decoder.camera_index(), result);
    if (!light.white) result.light.push_back({setup.camera_names[i], (*decoding)->light});
    const std::vector<CloudPoint> strays = stray_symbols(**decoding, decoder.camera_index());
    result.strays.insert(result.strays.end(), strays.begin(), strays.end());
    const std::span points = std::span(result.cloud.points).subspan(before);
    shade(points, light, result);
    if (light.white_colours != nullptr)
      if (const auto balance = white_balance_of(points, light.gains))
        result.white_balance.push_back({setup.camera_names[i], *balance});
    if (dense) {
      const auto dense_begin = steady_clock::now();
      dense->views.push_back(measure_pixels(frame, setup, request, result));
      const auto took = steady_clock::now() - dense_begin;
      result.dense_time += took, result.decode_time += took;
    }
    const auto surfaces_begin = steady_clock::now();
    if (!part.box) textures->add(setup, decoder.camera_index(), points, dense ? &dense->views.back() : nullptr);
    result.decode_time += steady_clock::now() - surfaces_begin;
    if (!request.picture || i != pictured) continue;
    const auto look = request.why ? DecodingLook::kReasons : DecodingLook::kSymbols;
    auto picture = encode_png(draw_decoding(set.frames[i].image(), **decoding, setup.pattern, look));
    if (!picture) return tl::unexpected(picture.error());
    result.picture_png = std::move(*picture);
  }
  if (request.colour && !sees_colours)
    return fail(
        ErrorCode::kUnsupported,
        "no camera sends colour: configure a colour format, such as \"BayerRG8\" or \"YUYV\", or scan without colour");
  result.cloud.coloured = request.colour;
  if (dense) {
    const auto dense_begin = steady_clock::now();
    keep_part(dense->views, part);
    textures->paint(dense->views, *setup.crew, result);
    const auto took = steady_clock::now() - dense_begin;
    result.dense_time += took, result.decode_time += took;
    dense->scan_id = result.cloud.scan_id, dense->time = result.cloud.time, dense->frame = result.cloud.frame;
    result.dense = std::move(dense);
  }
  result.stage_times = clock.times();
  if (result.cloud.points.empty()) {
    result.empty = why_empty(set, setup, lane, request, result);
    if (part.box) result.empty = "in the part of the picture that can see the box: " + result.empty;
  } else {
    std::vector<double> depths_mm;
    for (const CloudPoint& point : result.cloud.points) depths_mm.push_back(point.z);
    const auto sigma_mm = setup.calibration->report.depth_sigma_mm(median_of(std::move(depths_mm)));
    if (sigma_mm) result.cloud.sigma_calibration_mm = static_cast<float>(*sigma_mm);
  }
  const std::size_t decoded = result.cloud.points.size();
  keep_part(result.cloud.points, part);
  const auto paint_begin = steady_clock::now();
  textures->paint(result);
  result.decode_time += steady_clock::now() - paint_begin;
  if (decoded > 0 && result.cloud.points.empty())
    result.empty =
        "none of the " + std::to_string(decoded) + " points lies " +
        (part.box ? "within the box: make it larger, or move it" : "in front of the plane: move it, or turn it");
  if (auto kept = keep_frames(set, setup, request.frames, result); !kept) return tl::unexpected(kept.error());
  return result;
}

}  // namespace slsd
