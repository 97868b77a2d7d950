// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/doubles/gige/control_port.hpp"
#include "tests/doubles/gige/frames/sensor.hpp"
#include "tests/doubles/gige/gige_camera_options.hpp"
#include "tests/doubles/gige/gige_faults.hpp"
#include "tests/doubles/gige/register_file.hpp"
#include "tests/doubles/gige/stream_sender.hpp"
#include "tests/doubles/gige/tick_clock.hpp"

namespace slsd::test {

/// A GigE Vision camera, real on the wire: GVCP on its address' port 3956, GVSP to whoever controls it; triggered by
/// software, by a line, by an action command or running freely. It lives on a thread of its own.
/// @thread thread-safe
class GigeCamera {
 public:
  /// Throws where the address cannot be had.
  explicit GigeCamera(GigeCameraOptions options = {});
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  [[nodiscard]] const std::string& address() const { return options_.address; }

  void lose_packets(double share, std::uint32_t seed = 1);
  void set_faults(const GigeFaults& faults);
  void set_clock_fault(ClockFault fault);
  void stall(std::chrono::milliseconds duration);
  /// Off for so long, and on again with nothing of what was set.
  void blip(std::chrono::milliseconds off);
  /// As if another application had taken control, or had gone.
  void occupy(bool by_another);
  /// A rising edge on both lines.
  void pulse_line();
  /// The register keeps its value whatever is written to it.
  void hold(Register address);

  [[nodiscard]] std::uint32_t read(std::uint32_t address) const;
  [[nodiscard]] double read_double(std::uint32_t address) const;
  [[nodiscard]] std::uint32_t frames_exposed() const;
  /// When the exposure of the frame of this counter began, of the last 1024.
  [[nodiscard]] std::chrono::steady_clock::time_point exposure_of(std::uint32_t counter) const;
  /// When the last frame's exposure began.
  [[nodiscard]] std::chrono::steady_clock::time_point last_exposure() const;
  [[nodiscard]] std::uint64_t packets_lost() const;
  [[nodiscard]] std::uint64_t packets_sent_again() const;
  [[nodiscard]] int times_taken() const;
  /// Neither answers nor sends, as told or because it died.
  [[nodiscard]] bool is_gone() const;
  [[nodiscard]] ActionCounts actions() const;

 private:
  using Time = std::chrono::steady_clock::time_point;

  void run(const std::stop_token& stop);
  void wait_for_work();
  [[nodiscard]] Time next_work(Time now) const;
  void power_up();
  [[nodiscard]] ControlEvents control_events();
  void read_commands(int socket);
  void note_write(std::uint32_t address, std::uint32_t value);
  void send_frames(Time now);
  [[nodiscard]] StreamTarget target() const;
  void wake();

  GigeCameraOptions options_;
  int control_socket_ = -1;
  int broadcast_socket_ = -1;
  int wake_event_ = -1;
  mutable std::mutex mutex_;
  std::unique_ptr<RegisterFile> registers_;
  std::optional<TickClock> clock_;
  std::unique_ptr<ControlPort> port_;
  std::unique_ptr<StreamSender> sender_;
  GigeTrouble trouble_;
  Sensor sensor_{trouble_};
  std::vector<std::uint8_t> command_;
  std::jthread thread_;
};

}  // namespace slsd::test
