// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/double_options.hpp"

namespace slsd::test {

std::vector<DoubleControl> uvc_controls() {
  return {{V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", 0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY, V4L2_CTRL_TYPE_MENU},
          {V4L2_CID_EXPOSURE_AUTO_PRIORITY, "Exposure, Dynamic Framerate", 0, 1, 1, 1, V4L2_CTRL_TYPE_BOOLEAN},
          {V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 1, 5000, 1, 157},
          {V4L2_CID_GAIN, "Gain", 0, 96, 2, 10},
          {V4L2_CID_AUTO_WHITE_BALANCE, "White Balance, Automatic", 0, 1, 1, 1, V4L2_CTRL_TYPE_BOOLEAN},
          {V4L2_CID_POWER_LINE_FREQUENCY, "Power Line Frequency", 0, 2, 1, 2, V4L2_CTRL_TYPE_MENU},
          {V4L2_CID_FOCUS_AUTO, "Focus, Automatic Continuous", 0, 1, 1, 1, V4L2_CTRL_TYPE_BOOLEAN},
          {V4L2_CID_FOCUS_ABSOLUTE, "Focus, Absolute", 0, 250, 5, 0}};
}

}  // namespace slsd::test
