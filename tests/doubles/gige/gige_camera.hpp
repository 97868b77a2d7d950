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
#include "tests/doubles/gige/counter_frame.hpp"
#include "tests/doubles/gige/gige_faults.hpp"
#include "tests/doubles/gige/register_file.hpp"
#include "tests/doubles/gige/stream_sender.hpp"

namespace slsd::test {

struct GigeCameraOptions {
  std::string serial = "DOUBLE-1";  ///< at most 15 letters; the vendor is "Aravis"
  std::string address = {};         ///< of this host; empty: one of 127.0.0.0/8 that is free
  int width_px = 64;
  int height_px = 48;
  ExposureSource frames = counter_frames();
  std::uint16_t first_frame_id = 65530;  ///< near its end, where many a receiver is wrong
  std::uint64_t tick_frequency_hz = 125'000'000;
  double drift_ppm = 40.0;                ///< how much faster than the host's the device's clock goes
  std::uint32_t packet_bytes_max = 9000;  ///< larger test packets get lost, as by a switch without jumbo frames
  bool chunks = true;                     ///< it has a chunk mode
  bool chunks_in_ns = false;              ///< the chunks' time stamp is in nanoseconds, and not in ticks
  std::uint32_t chunk_payload = 0x4001;   ///< how a frame with chunks is called
  bool software_trigger = true;           ///< it can be triggered by a command
  /// By how much the time stamp that a frame begins with is later than its exposure's start, as of the readout.
  std::chrono::milliseconds stamp_delay{0};
};

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
  /// When the last frame's exposure began.
  [[nodiscard]] std::chrono::steady_clock::time_point last_exposure() const;
  [[nodiscard]] std::uint64_t packets_lost() const;
  [[nodiscard]] std::uint64_t packets_sent_again() const;
  [[nodiscard]] int times_taken() const;

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Exposure {
    std::uint16_t id;
    std::uint32_t counter;
    Time begin;
  };

  void run(const std::stop_token& stop);
  void wait_for_work();
  void power_up();
  void read_commands(int socket);
  void note_write(std::uint32_t address, std::uint32_t value);
  void trigger(std::uint32_t source);
  void set_tick_frequency(std::uint64_t frequency_hz);
  void act_when_due(Time now);
  void run_freely(Time now);
  void expose(Time begin);
  void send_frames(Time now);
  void begin_frame(const Exposure& exposure);
  void add_chunks(WireFrame& frame, const Exposure& exposure);
  [[nodiscard]] bool sends(Time now) const;
  [[nodiscard]] bool follows_network() const;
  [[nodiscard]] std::uint64_t tick_frequency() const;
  [[nodiscard]] Time time_at(std::uint64_t ticks) const;
  [[nodiscard]] std::uint64_t ticks_at(Time time) const;
  [[nodiscard]] StreamTarget target() const;
  void wake();

  GigeCameraOptions options_;
  int control_socket_ = -1;
  int broadcast_socket_ = -1;
  int wake_event_ = -1;
  mutable std::mutex mutex_;
  std::unique_ptr<RegisterFile> registers_;
  std::unique_ptr<ControlPort> port_;
  std::unique_ptr<StreamSender> sender_;
  GigeFaults faults_;
  std::optional<Time> back_at_;
  std::vector<Exposure> exposures_;  ///< not yet sent
  std::uint16_t next_id_ = 1;
  std::uint32_t counter_ = 0;
  Time last_exposure_;
  Time power_up_;
  std::optional<Time> next_free_;
  std::optional<Time> act_at_;
  std::vector<std::uint8_t> command_;
  std::jthread thread_;
};

}  // namespace slsd::test
