// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/frame_pool.hpp"
#include "drivers/camera/v4l2/exposure_clock.hpp"
#include "drivers/camera/v4l2/frame_layout.hpp"
#include "drivers/camera/v4l2/grey_converter.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_stream.hpp"
#include "drivers/system/wake_event.hpp"

namespace slsd {

/// The counts of a device's frames since the camera was made.
struct V4l2FrameCounts {
  std::uint64_t delivered = 0;
  std::uint64_t before_trigger = 0;  ///< exposed before the request, or while the camera settled
  std::uint64_t dropped = 0;         ///< missing in the driver's sequence while buffers were free, or lost by a fault
  std::uint64_t torn = 0;            ///< flagged by the driver, too short, or not decodable
};

/// A V4L2 camera in free run since open(). Each capture() waits for the first frame whose exposure began after the
/// call. Grey frames are the driver's own buffers; others are converted into pool buffers. Frame numbers count
/// delivered and lost frames, but not frames that no capture waited for.
///
/// Reopens an unplugged device by the same name, which should therefore be one of /dev/v4l/by-id. capture() gives
/// kFrameStale if frames came but all their stamps lie before the trigger.
///
/// A stream may die silently: uvcvideo does not queue failed transfers again. If no frame comes for missed_frames_max
/// periods, capture() or check() closes the stream with kDisconnected. open() verifies that frames arrive.
/// @thread thread-bound, except cancel()
class V4l2Camera final : public Camera {
 public:
  explicit V4l2Camera(V4l2CameraOptions options);

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void set_found(std::function<void()> found) override { found_ = std::move(found); }
  /// @errors kInvalidArgument (an option, or outside the device's range), kNotFound, kPermissionDenied, kUnsupported,
  ///         kMismatch (the device did not take a setting), kBusy (another program uses it), kNoSpace, kDisconnected,
  ///         kIo, kTimeout (no frame arrives), kCancelled
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  /// Frames that the driver dropped in between count as lost, and show as a gap in the numbers. If the previous frame
  /// is older than a few periods, works as capture().
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime deadline) override;
  void expect(Picture light) override { light_ = light; }
  /// Makes the next capture pass over the frames under way, and at least settle_frames.
  [[nodiscard]] Result<> set_exposure(double exposure_us) override;
  [[nodiscard]] Result<> check() override;
  void tell_figures(std::vector<DriverFigure>& figures) const override;
  void cancel() override { wake_.wake(); }

  [[nodiscard]] const V4l2FrameCounts& counts() const { return counts_; }

 private:
  struct Capture {
    MonotonicTime trigger;
    MonotonicTime deadline;
    int in_flight = 0;  ///< unstamped frames that must pass first
    int stale = 0;
    bool next = false;  ///< accept any frame after the previous one
  };
  [[nodiscard]] Result<Frame> run(const Capture& capture);
  void close();
  [[nodiscard]] Result<> configure(V4l2Device device);
  [[nodiscard]] Result<> wait_for_first_frame();
  [[nodiscard]] Result<Frame> capture_after(Capture capture);
  [[nodiscard]] Result<> drop_waiting();
  [[nodiscard]] MonotonicTime dead_at() const;
  [[nodiscard]] tl::unexpected<Error> fail_dead() const;
  [[nodiscard]] tl::unexpected<Error> fail_gone() const;
  void note_stamp(const v4l2_buffer& buffer, MonotonicTime received);
  [[nodiscard]] Result<> wait(const Capture& capture);
  [[nodiscard]] tl::unexpected<Error> fail_late(const Capture& capture) const;
  [[nodiscard]] Result<std::optional<Frame>> take(Capture& capture);
  [[nodiscard]] Result<std::optional<Frame>> judge(const v4l2_buffer& buffer, Capture& capture);
  [[nodiscard]] MonotonicTime exposure_start(const v4l2_buffer& buffer, MonotonicTime received, Capture& capture) const;
  [[nodiscard]] std::uint32_t note_order(const v4l2_buffer& buffer);
  [[nodiscard]] bool is_whole(const v4l2_buffer& buffer) const;
  [[nodiscard]] Result<Frame> deliver(const v4l2_buffer& buffer, MonotonicTime exposure_start, MonotonicTime received);
  [[nodiscard]] Result<Frame> convert(const v4l2_buffer& buffer, MonotonicTime exposure_start, MonotonicTime received);
  [[nodiscard]] tl::unexpected<Error> lose(ErrorCode code, std::uint64_t frames, std::string message);
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message) const;

  V4l2CameraOptions options_;
  CameraDescription description_;
  std::function<void()> found_;
  WakeEvent wake_;
  V4l2FrameCounts counts_;
  std::optional<V4l2Stream> stream_;
  std::optional<GreyConverter> converter_;
  std::optional<FramePool> pool_;
  FrameLayout layout_;
  Picture light_ = Picture::kPattern;
  ExposureClock clock_;
  bool clock_warned_ = false;
  std::size_t held_max_ = 0;
  int settling_ = 0;
  int faults_in_a_row_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::optional<MonotonicTime> last_start_;     ///< start of the previous frame's exposure
  std::optional<std::uint32_t> last_sequence_;  ///< the driver's number; empty while a gap has no meaning
};

}  // namespace slsd
