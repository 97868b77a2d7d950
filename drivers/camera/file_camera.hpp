// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
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
  std::filesystem::path path = {};  ///< a folder of PNG, TIFF, PGM, PPM or BMP images, or one image
  bool loop = true;                 ///< after the last image from the first on again; else kNotFound
  double rate_hz = 0.0;  ///< 0: exposes at the trigger; else runs freely and delivers the next frame, up to 1000
  std::optional<std::pair<int, int>> size_px = {};  ///< width and height expected; without it those of the first image
  BayerPattern bayer = BayerPattern::kNone;         ///< grey images are mosaics of this pattern
  int frames_held_max = 8;                          ///< buffers, 2 to 64: how many frames may be held at once
  std::size_t cache_bytes = 64u << 20;  ///< decoded images that are kept; what does not fit is decoded each time

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const FileCameraOptions&, const FileCameraOptions&) = default;
};

/// A camera that replays images: one to a trigger, a folder's in the order of their names' bytes ("2.png" after
/// "10.png": number with leading zeros). Hidden files, folders and other extensions are passed over. The list is read
/// by open(); an image that is rewritten afterwards is read anew, so that one image may be kept up to date by others.
///
/// What the scene looks like in white and without the projector's light is replayed from the folders "white" and "dark"
/// within the folder, or beside the one image: to the i-th frame of the pattern belongs the i-th image of each, and
/// where there are fewer they begin anew. Without such a folder such a capture gives kNotFound.
///
/// Besides the errors of every camera, capture() gives kNotFound when loop is off and all images were shown;
/// kMismatch for an image of another size or depth than the first; and what read_image() gives. That image's frame is
/// lost and the camera goes on with the next. kDisconnected when the folder or file is gone.
/// @thread thread-bound, but for cancel()
class FileCamera final : public Camera {
 public:
  explicit FileCamera(FileCameraOptions options);

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  /// @errors kInvalidArgument (an option), kNotFound (path, or no image in it), kMismatch, and as read_image()
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  void expect(Picture light) override { light_ = light; }
  [[nodiscard]] Result<> check() override;
  void cancel() override { wake_.wake(); }

 private:
  [[nodiscard]] Result<MonotonicTime> wait_for_exposure(MonotonicTime deadline);
  [[nodiscard]] Result<Frame> deliver(MonotonicTime exposure_start);
  [[nodiscard]] Result<> open_beside(const char* name, ImageFolder& folder);
  [[nodiscard]] Result<const GreyImage*> next_image();
  [[nodiscard]] Result<const GreyImage*> image_in_light();
  [[nodiscard]] Result<> configure(const FrameFormat& format);
  [[nodiscard]] tl::unexpected<Error> fail_late() const;
  [[nodiscard]] tl::unexpected<Error> fail_busy() const;
  [[nodiscard]] tl::unexpected<Error> fail_format(const FrameFormat& format) const;

  FileCameraOptions options_;
  CameraDescription description_;
  WakeEvent wake_;
  ImageFolder folder_;
  ImageFolder white_;  ///< empty where there is none
  ImageFolder dark_;
  Picture light_ = Picture::kPattern;
  std::uint64_t patterns_ = 0;  ///< frames of the pattern so far
  std::optional<FramePool> pool_;
  MonotonicTime opened_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace slsd
