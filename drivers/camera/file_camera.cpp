// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/file_camera.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <variant>

#include "core/image_size.hpp"

namespace slsd {
namespace {

constexpr double kRateMaxHz = 1000.0;

std::string format_text(const FrameFormat& format) {
  return size_text(format.width_px, format.height_px) + " with " + std::to_string(8 * format.bytes_per_pixel) + " bits";
}

/// The first tick at or after the time; ticks are periods counted from the start.
MonotonicTime next_tick(MonotonicTime start, std::chrono::nanoseconds period, MonotonicTime time) {
  const auto ticks = (time - start + period - std::chrono::nanoseconds(1)) / period;
  return start + ticks * period;
}

}  // namespace

Result<> FileCameraOptions::validate() const {
  if (name.empty()) return fail(ErrorCode::kInvalidArgument, "a camera needs a name", "name");
  if (path.empty()) return fail(ErrorCode::kInvalidArgument, "a file camera needs a folder or an image", "path");
  if (!(rate_hz >= 0.0 && rate_hz <= kRateMaxHz) || (rate_hz > 0.0 && rate_hz < 1e-3))
    return fail(ErrorCode::kInvalidArgument, "must be 0, or between 0.001 and 1000", "rate_hz");
  if (size_px && (size_px->first < 1 || size_px->second < 1))
    return fail(ErrorCode::kInvalidArgument, "width and height must be at least 1", "size_px");
  if (frames_held_max < 2 || frames_held_max > 64)
    return fail(ErrorCode::kInvalidArgument, "must be between 2 and 64", "frames_held_max");
  return {};
}

FileCamera::FileCamera(FileCameraOptions options)
    : options_(std::move(options)), description_{options_.name, "file", options_.path.string(), 0, 0} {}

Result<> FileCamera::open() {
  pool_.reset();
  wake_.reset();
  if (auto wake = wake_.open(); !wake) return wake;
  if (auto valid = options_.validate(); !valid) return valid;
  ReadImageOptions reading;
  reading.bayer = options_.bayer;
  if (auto listed = folder_.open(options_.path, reading, options_.cache_bytes); !listed) return listed;
  if (auto opened = open_beside("white", white_); !opened) return opened;
  if (auto opened = open_beside("dark", dark_); !opened) return opened;
  const auto first = folder_.image(0);
  if (!first) return tl::unexpected(first.error());
  return configure(format_of(view(**first)));
}

Result<> FileCamera::open_beside(const char* name, ImageFolder& folder) {
  folder = {};
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(options_.path, ignored);
  const auto path = (is_folder ? options_.path : options_.path.parent_path()) / name;
  if (!std::filesystem::is_directory(path, ignored)) return {};
  ReadImageOptions reading;
  reading.bayer = options_.bayer;
  return folder.open(path, reading, options_.cache_bytes);
}

Result<> FileCamera::configure(const FrameFormat& format) {
  if (options_.size_px && *options_.size_px != std::pair(format.width_px, format.height_px))
    return fail(ErrorCode::kMismatch,
                "the first image is " + size_text(format.width_px, format.height_px) +
                    " pixels, the configuration says " + size_text(options_.size_px->first, options_.size_px->second) +
                    "; change one of them",
                options_.path.string());
  description_.width_px = format.width_px;
  description_.height_px = format.height_px;
  description_.rate_hz = options_.rate_hz;
  pool_.emplace(format, options_.frames_held_max);
  opened_ = std::chrono::steady_clock::now();
  next_sequence_ = 0;
  patterns_ = 0;
  exposure_ = 0;
  return {};
}

Result<Frame> FileCamera::capture(MonotonicTime deadline) {
  if (!pool_) return fail(ErrorCode::kDisconnected, "the camera is not open; open it", options_.name);
  const auto exposure_start = wait_for_exposure(deadline);
  if (!exposure_start) return tl::unexpected(exposure_start.error());
  auto frame = deliver(*exposure_start);
  if (!frame && frame.error().code == ErrorCode::kDisconnected) pool_.reset();
  if (frame && frame->received() > deadline) return fail_late();
  return frame;
}

Result<> FileCamera::check() {
  std::error_code ignored;
  if (pool_ && std::filesystem::exists(options_.path, ignored)) return {};
  pool_.reset();
  return fail(ErrorCode::kDisconnected, "the folder or file is gone; restore it", options_.path.string());
}

Result<MonotonicTime> FileCamera::wait_for_exposure(MonotonicTime deadline) {
  const MonotonicTime now = std::chrono::steady_clock::now();
  MonotonicTime exposure_start = now;
  if (options_.rate_hz > 0.0) {
    const auto period = std::chrono::nanoseconds(std::llround(1e9 / options_.rate_hz));
    exposure_start = next_tick(opened_, period, now);
  }
  const bool cancelled = wake_.sleep_until(std::min(exposure_start, deadline));
  if (cancelled) return fail(ErrorCode::kCancelled, "the capture was cancelled", options_.name);
  if (exposure_start > deadline) return fail_late();
  return exposure_start;
}

Result<Frame> FileCamera::deliver(MonotonicTime exposure_start) {
  if (pool_->all_lent()) return fail_busy();  // checked first, so that no image is skipped
  const auto image = light_ == Picture::kPattern ? next_image() : image_in_light();
  if (!image) return tl::unexpected(image.error());
  const GreyView pixels = view(**image);
  if (const FrameFormat format = format_of(pixels); format != pool_->format()) return fail_format(format);
  auto frame = pool_->lend(pixels, next_sequence_ - 1, exposure_start);
  if (!frame) return fail_busy();
  if (light_ == Picture::kPattern) return std::move(*frame);
  return std::move(*frame).with_colours(folder_in_light().colours(index_in_light()));
}

Result<> FileCamera::set_exposure(double exposure_us) {
  const auto found = std::ranges::find(options_.exposures_us, exposure_us);
  if (found == options_.exposures_us.end())
    return fail(ErrorCode::kUnsupported, "no image has this exposure; correct exposures_us", options_.name);
  exposure_ = static_cast<std::uint64_t>(found - options_.exposures_us.begin());
  return {};
}

Result<const GreyImage*> FileCamera::next_image() {
  while (patterns_ % exposures() != exposure_) ++patterns_;  // a scan may have ended before its last exposure
  if (patterns_ >= folder_.size() && !options_.loop)
    return fail(ErrorCode::kNotFound,
                "all " + std::to_string(folder_.size()) + " images have been replayed; set loop = true to start over",
                options_.path.string());
  ++next_sequence_;
  return folder_.image(patterns_++ % folder_.size());
}

// The image that belongs to the last pattern frame, and has the exposure.
std::size_t FileCamera::index_in_light() const {
  const std::uint64_t set = (patterns_ == 0 ? 0 : patterns_ - 1) / exposures();
  return (set * exposures() + exposure_) % folder_in_light().size();
}

Result<const GreyImage*> FileCamera::image_in_light() {
  ImageFolder& folder = folder_in_light();
  if (folder.size() == 0)
    return fail(ErrorCode::kNotFound,
                "such frames need a folder \"" + std::string(light_name(light_)) +
                    "\" beside the images: add one, or scan without them",
                options_.path.string());
  ++next_sequence_;
  return folder.image(index_in_light());
}

tl::unexpected<Error> FileCamera::fail_late() const {
  return fail(ErrorCode::kFrameLate, "no frame arrived before the deadline; allow more time or raise rate_hz",
              options_.name);
}

tl::unexpected<Error> FileCamera::fail_busy() const {
  return fail(ErrorCode::kBusy,
              "all " + std::to_string(options_.frames_held_max) + " frames are held; release some first",
              options_.name);
}

// If the first image has another format now, too, others have replaced the images: opening adopts them.
tl::unexpected<Error> FileCamera::fail_format(const FrameFormat& format) {
  if (const auto first = folder_.image(0); first && format_of(view(**first)) != pool_->format())
    return fail(ErrorCode::kDisconnected,
                "other images replaced those of " + format_text(pool_->format()) + ": the camera opens again",
                options_.path.string());
  const std::string which =
      light_ == Picture::kPattern
          ? "image " + std::to_string((patterns_ - 1) % folder_.size() + 1) + " of " + std::to_string(folder_.size())
          : "an image in the folder \"" + std::string(light_name(light_)) + "\"";
  return fail(ErrorCode::kMismatch,
              which + " is " + format_text(format) + ", the first is " + format_text(pool_->format()) +
                  "; keep images of one kind in a folder",
              options_.path.string());
}

}  // namespace slsd
