// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <linux/videodev2.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/image.hpp"

namespace slsd::test {

/// Draws the frame with a number into an image of the double's size.
using FrameSource = std::function<void(std::uint64_t number, Grey8& image)>;

/// What a V4L2 double can deliver.
struct DoubleFormat {
  std::uint32_t fourcc = V4L2_PIX_FMT_GREY;  ///< GREY, Y16, Y12, Y10, a mosaic of 8 or 16 bits, NV12, YUV420, YUYV,
                                             ///< UYVY or MJPG
  std::vector<std::pair<int, int>> sizes{{160, 120}};
};

struct DoubleControl {
  std::uint32_t id = 0;
  std::string name;
  int minimum = 0;
  int maximum = 1;
  int step = 1;
  int value = 0;
  v4l2_ctrl_type type = V4L2_CTRL_TYPE_INTEGER;
  std::vector<std::int64_t> choices = {};  ///< of a menu of numbers
};

/// What the double is, until its end.
struct DoubleOptions {
  std::string driver = "slsd-double";
  std::vector<DoubleFormat> formats{{}};
  std::vector<DoubleControl> controls;
  std::vector<double> rates_hz{200.0, 100.0, 50.0};  ///< the first is in force
  bool triggered = false;                            ///< one frame to a trigger; else one to each period
  bool waits_for_buffer = true;  ///< without a free buffer it exposes nothing; else it drops the frame and counts on
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::chrono::nanoseconds stamp_offset{0};  ///< of the clock that stamps, to CLOCK_MONOTONIC
  std::chrono::microseconds exposure{500};
  std::chrono::microseconds readout{500};
  int buffers_max = VIDEO_MAX_FRAME;
  int padding_bytes = 0;                             ///< after each row; even
  bool changes_format = false;                       ///< S_FMT says that it made frames lower by 8 px than asked for
  std::vector<std::uint32_t> refused_controls = {};  ///< they keep their values and say that they took others
  FrameSource source;                                ///< without one numbered_frame() of numbered_frame.hpp
};

/// A UVC camera's controls, as an ordinary one has them: everything automatic on.
[[nodiscard]] std::vector<DoubleControl> uvc_controls();

}  // namespace slsd::test
