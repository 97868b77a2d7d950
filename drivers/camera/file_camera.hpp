// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/camera/frame_pool.hpp"
#include "drivers/camera/image_folder.hpp"
#include "drivers/files/bayer.hpp"
#include "drivers/system/wake_event.hpp"

namespace slsd {

/// The keys of a [[camera]] table whose driver is "file".
struct FileCameraOptions {
  static constexpr std::string_view kDriver = "file";
  std::string name = "camera";
  std::filesystem::path path = {};  ///< a folder of PNG, TIFF, PGM, PPM or JPEG images, or one image
  bool loop = true;                 ///< start again after the last image; else kNotFound
  double rate_hz = 0.0;             ///< 0: exposes at the trigger; else delivers frames in free run, up to 1000
  std::optional<std::pair<int, int>> size_px = {};  ///< expected width and height; empty: those of the first image
  BayerPattern bayer = BayerPattern::kNone;         ///< grey images are Bayer mosaics of this pattern
  std::vector<double> exposures_us = {};            ///< the images have these exposures in turn; empty: all the same
  int frames_held_max = 8;                          ///< buffers, 2 to 64: how many frames may be held at once
  std::size_t cache_bytes = 64u << 20;  ///< limit of the decoded images kept in memory; others are decoded each time

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const FileCameraOptions&, const FileCameraOptions&) = default;
};

/// A camera that replays images, one for each trigger. The images of a folder come in the byte order of their names
/// ("2.png" after "10.png": use leading zeros). Skips hidden files, folders and other extensions. open() reads the
/// list. An image that is rewritten later is read again, so another program can keep one image up to date.
///
/// Replays white and dark frames from the folders "white" and "dark", within the folder or beside the single image. The
/// i-th pattern frame has the i-th image of each; if there are fewer, they start again. Without such a folder, the
/// capture gives kNotFound.
///
/// With exposures_us, the first image has the first exposure, the second image the second, and so on. The images of the
/// folders "white" and "dark" then have the exposures in the same order.
///
/// Besides the errors of every camera, capture() gives: kNotFound if loop is off and all images were shown; kMismatch
/// for an image of another size or depth than the first; errors of read_image(). That image's frame is lost, and the
/// camera continues with the next. kDisconnected means that the folder or file is gone, or that the first image now has
/// another size or depth, too: open() adopts it.
/// @thread thread-bound, except cancel()
class FileCamera final : public Camera {
 public:
  explicit FileCamera(FileCameraOptions options);

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  /// @errors kInvalidArgument (an option), kNotFound (path, or no image in it), kMismatch, and as read_image()
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  void expect(Picture light) override { light_ = light; }
  /// Chooses the next image with this exposure. @errors kUnsupported: not one of exposures_us
  [[nodiscard]] Result<> set_exposure(double exposure_us) override;
  [[nodiscard]] Result<> check() override;
  void cancel() override { wake_.wake(); }

 private:
  [[nodiscard]] Result<MonotonicTime> wait_for_exposure(MonotonicTime deadline);
  [[nodiscard]] Result<Frame> deliver(MonotonicTime exposure_start);
  [[nodiscard]] Result<> open_beside(const char* name, ImageFolder& folder);
  [[nodiscard]] Result<const GreyImage*> next_image();
  [[nodiscard]] Result<const GreyImage*> image_in_light();
  [[nodiscard]] std::size_t index_in_light() const;
  [[nodiscard]] ImageFolder& folder_in_light() { return light_ == Picture::kWhite ? white_ : dark_; }
  [[nodiscard]] const ImageFolder& folder_in_light() const { return light_ == Picture::kWhite ? white_ : dark_; }
  [[nodiscard]] std::uint64_t exposures() const { return std::max<std::uint64_t>(options_.exposures_us.size(), 1); }
  [[nodiscard]] Result<> configure(const FrameFormat& format);
  [[nodiscard]] tl::unexpected<Error> fail_late() const;
  [[nodiscard]] tl::unexpected<Error> fail_busy() const;
  [[nodiscard]] tl::unexpected<Error> fail_format(const FrameFormat& format);

  FileCameraOptions options_;
  CameraDescription description_;
  WakeEvent wake_;
  ImageFolder folder_;
  ImageFolder white_;  ///< empty if there is none
  ImageFolder dark_;
  Picture light_ = Picture::kPattern;
  std::uint64_t patterns_ = 0;  ///< pattern frames so far
  std::uint64_t exposure_ = 0;  ///< index in exposures_us
  std::optional<FramePool> pool_;
  MonotonicTime opened_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace slsd
