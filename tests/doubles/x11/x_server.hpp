// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <sys/types.h>

namespace slsd::test {

/// A real X server without hardware, on a display number of its own. DISPLAY names it from its start on.
/// @thread thread-bound
class XServer {
 public:
  /// Xvfb: one monitor of that size. @return null where it is not installed or does not start
  [[nodiscard]] static std::unique_ptr<XServer> start_virtual(int width_px, int height_px);

  /// Xorg with the dummy driver: DUMMY0 of 1024x768 at +0+0, primary; further monitors are plugged in by Desktop. All
  /// may have the modes 640x360, 1280x800 and 1920x1080. @return as above
  [[nodiscard]] static std::unique_ptr<XServer> start_dummy();
  ~XServer();
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;

  [[nodiscard]] const std::string& display() const { return display_; }  ///< ":7"

  /// The server's end, as by a crash.
  void kill();
  /// Lets it hang: it takes connections and answers nothing, until thaw().
  void freeze();
  void thaw();
  /// Starts it again with the same display number. @return whether it came
  [[nodiscard]] bool restart();

 private:
  explicit XServer(std::vector<std::string> command) : command_(std::move(command)) {}
  [[nodiscard]] bool start(const std::string& display);
  [[nodiscard]] static std::unique_ptr<XServer> started(std::unique_ptr<XServer> server);

  std::vector<std::string> command_;
  std::string folder_;  ///< of its configuration and log; empty: none
  std::string display_;
  pid_t process_ = -1;
};

}  // namespace slsd::test
