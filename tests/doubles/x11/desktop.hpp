// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/image.hpp"

struct xcb_connection_t;
struct xcb_screen_t;

namespace slsd::test {

/// What a person sees and does at an X server: takes screenshots, plugs monitors in and out (by xrandr(1)), puts
/// windows over others. Shares no code with the projector.
/// @thread thread-bound
class Desktop {
 public:
  explicit Desktop(const std::string& display);
  ~Desktop();
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;

  /// The desktop's part from (x, y) on, every channel. Empty where there is none.
  [[nodiscard]] ColourImage screenshot(int x, int y, int width, int height) const;

  /// Runs xrandr with those arguments. @return whether it did what was asked
  bool xrandr(const std::string& arguments) const;
  /// Plugs a monitor in. @param place  as in "--right-of DUMMY0"
  bool plug(const std::string& output, const std::string& mode, const std::string& place) const;
  bool unplug(const std::string& output) const;
  /// Gives the monitor an EDID with that serial number.
  void set_serial(const std::string& output, const std::string& serial) const;

  /// A white window over everything, until uncover().
  void cover(int x, int y, int width, int height);
  void uncover();

 private:
  std::string display_;
  xcb_connection_t* connection_;
  const xcb_screen_t* screen_;
  std::uint32_t window_ = 0;
};

/// An EDID's first block of a made-up monitor.
[[nodiscard]] std::vector<std::uint8_t> edid_with(const std::string& model, const std::string& serial);

}  // namespace slsd::test
