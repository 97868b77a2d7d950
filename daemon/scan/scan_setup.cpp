// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scan_setup.hpp"

#include <algorithm>
#include <future>
#include <string_view>

#include <fmt/format.h>

#include "core/calibration_file/calibration_file.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/image_size.hpp"
#include "core/printable.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxFileBytes = 16 << 20;

Result<> check_size(int width_px, int height_px, const ProjectorOptions& projector, const std::string& what) {
  if (width_px == projector.width_px && height_px == projector.height_px) return {};
  return fail(ErrorCode::kMismatch, what + " is for a projector of " + size_text(width_px, height_px) +
                                        " px, but [projector] says " +
                                        size_text(projector.width_px, projector.height_px) + ": change one of them");
}

// Index in the calibration of each configured camera.
Result<std::vector<std::size_t>> calibrated_cameras(const Calibration& calibration,
                                                    const Configuration& configuration) {
  std::vector<std::size_t> indices;
  const std::string where = configuration.calibration_file.string();
  for (const CameraOptions& camera : configuration.cameras) {
    const CalibratedCamera* found = calibration.camera(camera.name());
    if (found == nullptr) {
      return fail(ErrorCode::kMismatch,
                  "no camera \"" + camera.name() +
                      "\" in the calibration: calibrate it, or name the [[camera]] as in the calibration",
                  where);
    }
    const auto index = static_cast<std::size_t>(found - calibration.cameras.data());
    if (std::ranges::find(indices, index) != indices.end()) {
      return fail(ErrorCode::kMismatch, "the calibration has one camera, the configuration several: calibrate them all",
                  where);
    }
    indices.push_back(index);
  }
  return indices;
}

// The decoder's buffers grow with its first frame. Warm up with the whole pattern, because no frame shows more. Then
// the first scan is as quick as later ones, and the service has its full size at start.
Result<> warm_up(Decoder& decoder, const Lens& lens, const Grey8& symbols, Crew& crew) {
  Grey8 frame(lens.width_px, lens.height_px);
  for (int y = 0; y < std::min(frame.height(), symbols.height()); ++y) {
    for (int x = 0; x < std::min(frame.width(), symbols.width()); ++x) frame.at(x, y) = symbols.at(x, y);
  }
  const auto decoded = decoder.decode(frame.view(), std::nullopt, nullptr, &crew);
  return decoded ? Result<>() : tl::unexpected(decoded.error());
}

// Each gets its own thread, because each takes some hundredths of a second.
Result<std::vector<Decoder>> make_lane(const ScanSetup& setup, const std::vector<std::size_t>& cameras,
                                       const DecodeOptions& options, const ScanSetup* earlier) {
  const IndexedPattern pattern(setup.pattern);
  std::vector<std::future<Result<Decoder>>> prepared;
  for (const std::size_t index : cameras) {
    const std::size_t camera = prepared.size();
    const bool was = earlier != nullptr && !earlier->lanes.empty() && camera < earlier->lanes.front().size();
    const Decoder* like = was ? &earlier->lanes.front()[camera] : nullptr;
    prepared.push_back(std::async(std::launch::async, [&, index, like]() -> Result<Decoder> {
      auto decoder = Decoder::create(pattern, *setup.calibration, index, options, like);
      if (!decoder) return decoder;
      const auto warm = warm_up(*decoder, setup.calibration->cameras[index].lens, setup.image, *setup.crew);
      if (!warm) return tl::unexpected(warm.error());
      return decoder;
    }));
  }
  std::vector<Decoder> lane;
  for (auto& each : prepared) {
    auto decoder = each.get();
    if (!decoder) return tl::unexpected(decoder.error());
    lane.push_back(std::move(*decoder));
  }
  return lane;
}

std::vector<Decoder> another_lane(const std::vector<Decoder>& first) {
  std::vector<Decoder> lane;
  for (const Decoder& decoder : first) lane.push_back(decoder.another());
  return lane;
}

Result<> place_at(Error error, const std::string& where) {
  if (error.where.empty()) error.where = where;
  return tl::unexpected(std::move(error));
}

}  // namespace

Result<Pattern> configured_pattern(const Configuration& configuration) {
  const auto& file = configuration.pattern_file;
  if (file.empty()) return make_pattern(configuration.pattern);
  auto text = read_file(file, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  auto pattern = read_pattern(*text, file.string());
  if (!pattern) return pattern;
  const PatternOptions& options = pattern->options;
  const auto fits =
      check_size(options.projector_width_px, options.projector_height_px, configuration.projector, "this pattern");
  if (!fits) return tl::unexpected(place_at(fits.error(), file.string()).error());
  return pattern;
}

Result<std::optional<Calibration>> configured_calibration(const Configuration& configuration) {
  const auto& file = configuration.calibration_file;
  if (file.empty()) return std::nullopt;
  auto text = read_file(file, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  auto calibration = read_calibration(*text, file.string());
  if (!calibration) return tl::unexpected(calibration.error());
  const Lens& lens = calibration->projector;
  const auto fits = check_size(lens.width_px, lens.height_px, configuration.projector, "this calibration");
  if (!fits) return tl::unexpected(place_at(fits.error(), file.string()).error());
  if (auto cameras = calibrated_cameras(*calibration, configuration); !cameras) return tl::unexpected(cameras.error());
  return std::optional(std::move(*calibration));
}

Result<std::optional<HandEyeCalibration>> configured_hand_eye(const Configuration& configuration) {
  const auto& file = configuration.frame.hand_eye;
  if (file.empty()) return std::nullopt;
  const auto text = read_file(file, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  auto hand_eye = read_hand_eye(*text, file.string());
  if (!hand_eye) return tl::unexpected(hand_eye.error());
  return std::optional(std::move(*hand_eye));
}

double FullLevels::raise(std::size_t camera, double level) {
  const std::lock_guard lock(mutex_);
  if (greatest_.size() <= camera) greatest_.resize(camera + 1, 0);
  return greatest_[camera] = std::max(greatest_[camera], level);
}

void DenseMappers::end_stream() {
  // If another thread is making a mapper, that takes a while, and there is nothing to free yet.
  if (const std::unique_lock lock(mutex_, std::try_to_lock); lock) {
    for (auto& [lane, mapper] : mappers_)
      if (mapper) mapper->end_stream();
  }
  const std::lock_guard lock(spare_->mutex);
  spare_->maps.clear();
}

void DenseMappers::drop(std::size_t lane) {
  {
    const std::lock_guard lock(mutex_);
    for (auto& [place, mapper] : mappers_)
      if (mapper) mapper->end_stream();
    std::erase_if(mappers_, [lane](const auto& mapper) { return mapper.first.second == lane || !mapper.second; });
  }
  const std::lock_guard lock(spare_->mutex);
  spare_->maps.clear();
}

std::shared_ptr<DenseCloud> DenseMappers::cloud() {
  constexpr std::size_t kSpareMost = 2;
  return {new DenseCloud, [spare = spare_](DenseCloud* cloud) {
            {
              const std::lock_guard lock(spare->mutex);
              for (DenseView& view : cloud->views)
                if (spare->maps.size() < kSpareMost) spare->maps.push_back(std::move(view.map));
            }
            delete cloud;
          }};
}

DenseMap DenseMappers::spare_map() {
  const std::lock_guard lock(spare_->mutex);
  if (spare_->maps.empty()) return {};
  DenseMap map = std::move(spare_->maps.back());
  spare_->maps.pop_back();
  return map;
}

DenseMapper& DenseMappers::of(std::size_t lane, std::size_t camera, const Decoder& decoder, const Pattern& pattern,
                              const Calibration& calibration, const DecodeOptions& options) {
  const std::lock_guard lock(mutex_);
  auto& mapper = mappers_[{camera, lane}];
  if (mapper) return *mapper;
  const auto other = mappers_.lower_bound({camera, 0});  // of another lane, or of this one
  mapper = other->second ? std::make_unique<DenseMapper>(other->second->another())
                         : std::make_unique<DenseMapper>(pattern, calibration, decoder.camera_index(), options);
  return *mapper;
}

Result<ScanSetup> ScanSetup::create(const Configuration& configuration, std::size_t lanes, const ScanSetup* earlier) {
  auto pattern = configured_pattern(configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  auto calibration = configured_calibration(configuration);
  if (!calibration) return tl::unexpected(calibration.error());
  auto hand_eye = configured_hand_eye(configuration);
  if (!hand_eye) return tl::unexpected(hand_eye.error());
  auto setup = of(std::move(*pattern), std::move(*calibration), configuration, lanes, earlier);
  if (!setup) return setup;
  setup->hand_eye = std::move(*hand_eye);
  // A box that moves with the robot is checked with each pose.
  const bool moves = setup->cloud.in_base() && setup->hand_eye && setup->hand_eye->mounted == Mounted::kArm;
  if (moves || !setup->calibration) return setup;
  const auto part = setup->part_of({});
  if (!part) return fail(part.error().code, part.error().message, "[cloud] box");
  return setup;
}

Result<ScanSetup> ScanSetup::of(Pattern pattern, std::optional<Calibration> calibration,
                                const Configuration& configuration, std::size_t lanes, const ScanSetup* earlier) {
  ScanSetup setup{std::move(pattern), {}, std::move(calibration), {}, {}, configuration.other_hardware};
  for (const CameraOptions& camera : configuration.cameras) {
    setup.texture_cameras += camera.measures() ? 0 : 1;
    setup.camera_names.push_back(camera.name());
    setup.camera_formats.push_back(camera.format());
    setup.colour_gains.push_back(camera.white_balance);
  }
  setup.image = draw_pattern(setup.pattern);
  setup.decode = configuration.decode;
  setup.cloud = configuration.cloud;
  setup.depth_min_mm = configuration.decode.depth_min_mm;
  setup.depth_max_mm = configuration.decode.depth_max_mm;
  if (!setup.calibration) return setup;
  auto cameras = calibrated_cameras(*setup.calibration, configuration);
  if (!cameras) return tl::unexpected(cameras.error());
  cameras->resize(setup.measuring_cameras());
  setup.doubts = calibration_doubts(*setup.calibration, {setup.depth_min_mm, setup.depth_max_mm});
  auto first = make_lane(setup, *cameras, configuration.decode, earlier);
  if (!first) return tl::unexpected(first.error());
  for (std::size_t lane = 1; lane < lanes; ++lane) setup.lanes.push_back(another_lane(*first));
  if (lanes > 0) setup.lanes.push_back(std::move(*first));
  if (setup.decode.density != Density::kPixels) return setup;
  // Makes the first scan wait for little but the field of its blur.
  for (std::size_t lane = 0; lane < setup.lanes.size(); ++lane) {
    for (std::size_t camera = 0; camera < cameras->size(); ++camera) {
      setup.dense->of(lane, camera, setup.lanes[lane][camera], setup.pattern, *setup.calibration, setup.decode)
          .warm_up();
    }
  }
  return setup;
}

Result<> ScanSetup::check(const ScanRequest& request) const {
  if (!calibration) {
    return fail(ErrorCode::kNotFound, "no calibration: calibrate, or set [calibration] file in the configuration");
  }
  if (auto part = part_of(request); !part) return tl::unexpected(part.error());
  if (auto known = check_camera(request.camera); !known) return known;
  if (camera_index(request.camera) < measuring_cameras()) return {};
  return fail(ErrorCode::kInvalidArgument,
              "camera \"" + printable(request.camera, 64) +
                  "\" is only for colour (use = \"texture\"), so slsd decodes none of its frames: name another camera, "
                  "or request its frame",
              "camera");
}

Result<> ScanSetup::check_robot_base() const {
  if (!hand_eye) {
    return fail(ErrorCode::kNotFound,
                "the scanner's pose in the robot's base is unknown: run slsctl hand-eye, and set [frame] hand_eye");
  }
  const std::string now = calibration ? calibration->report.date.value_or("") : "";
  if (now.empty() || hand_eye->calibration_date.empty() || now == hand_eye->calibration_date) return {};
  return fail(ErrorCode::kMismatch, "hand_eye was measured with the calibration of " + hand_eye->calibration_date +
                                        ", but the one in force is of " + now + ": run slsctl hand-eye again");
}

std::optional<RigidTransform> ScanSetup::base_from_rig(const std::optional<RigidTransform>& base_from_flange) const {
  if (!check_robot_base()) return std::nullopt;
  if (hand_eye->mounted == Mounted::kCell) return hand_eye->mount_from_rig;
  if (!base_from_flange) return std::nullopt;
  return base_from_flange->after(hand_eye->mount_from_rig);
}

Result<CloudPart> ScanSetup::part_of(const ScanRequest& request) const {
  const CloudOptions& wanted = request.part ? *request.part : cloud;
  if (!wanted.in_base()) return seen_part(wanted, {});
  if (auto possible = check_robot_base(); !possible) return tl::unexpected(possible.error());
  const auto base_from_here = base_from_rig(request.base_from_flange);
  if (base_from_here) return seen_part(wanted, *base_from_here);
  return fail(
      ErrorCode::kInvalidArgument,
      "box and plane are in the robot's base, and the scanner is on its arm: scan with the robot's pose, or set "
      "box_frame to \"rig\"",
      "box");
}

Result<CloudPart> ScanSetup::seen_part(const CloudOptions& wanted, const RigidTransform& frame_from_rig) const {
  CloudPart part = wanted.part(frame_from_rig);
  if (!part.box || lanes.empty()) return part;
  const bool seen = std::ranges::any_of(lanes.front(), [&](const Decoder& decoder) {
    const CalibratedCamera& camera = calibration->cameras[decoder.camera_index()];
    return pixels_of_box(*part.box, camera, depth_min_mm, depth_max_mm).has_value();
  });
  if (seen) return part;
  const std::string_view frame =
      wanted.in_base() ? "the robot's base" : "the frame of the first camera, x to the right, y down, z forward";
  return fail(
      ErrorCode::kInvalidArgument,
      fmt::format("no camera sees the box between depth_min_mm and depth_max_mm: its corners are in {}, in mm", frame),
      "box");
}

Result<> ScanSetup::check_camera(const std::string& name) const {
  if (camera_names.empty()) {
    return fail(ErrorCode::kNotFound, "no camera is configured: add a [[camera]] table to the configuration");
  }
  if (camera_index(name) < camera_names.size()) return {};
  std::string names;
  for (const std::string& each : camera_names) names += (names.empty() ? "" : ", ") + each;
  return fail(ErrorCode::kNotFound, "no camera is called \"" + printable(name, 64) + "\"; configured: " + names);
}

std::size_t ScanSetup::camera_index(const std::string& name) const {
  if (name.empty()) return 0;
  return static_cast<std::size_t>(std::ranges::find(camera_names, name) - camera_names.begin());
}

double ScanSetup::full_level_of(std::size_t camera, std::span<const GreyView> frames) const {
  const std::string format = camera < camera_formats.size() ? camera_formats[camera] : "";
  return full_levels->raise(camera, full_level(format, frames));
}

ScanFiles ScanSetup::files() const {
  return {write_pattern(pattern), calibration ? write_calibration(*calibration) : std::string(),
          hand_eye ? write_hand_eye(*hand_eye) : std::string()};
}

}  // namespace slsd
