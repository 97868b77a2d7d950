// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
//
// Measures the way of frames from the GigE Vision double through AravisCamera: gige-rate [FRAMES [SHARE_LOST]]
// Prints frames a second at 1600x1200, how many were identical to those sent, and what was lost.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/drivers/camera/aravis/gige_backend.hpp"

namespace {

using namespace slsd;
using std::chrono::steady_clock;

constexpr double kFreeRateHz = 60.0;

struct Setting {
  const char* name;
  AravisTrigger trigger;
  int packet_bytes;
  bool packet_socket;
  bool chunks = true;
};

struct Outcome {
  int identical = 0;
  int wrong = 0;
  int failed = 0;
};

void count(const Result<Frame>& frame, Outcome& outcome) {
  if (!frame)
    ++outcome.failed;
  else if (test::counter_of(frame->image()))
    ++outcome.identical;
  else
    ++outcome.wrong;
}

int measure(const Setting& setting, int frames, double share_lost) {
  test::GigeCameraOptions large;
  large.width_px = 1600;
  large.height_px = 1200;
  test::GigeCamera device(large);
  AravisCameraOptions options = test::options_for(device);
  options.trigger = setting.trigger;
  options.rate_hz = setting.trigger == AravisTrigger::kFreeRun ? kFreeRateHz : 0.0;
  options.packet_bytes = setting.packet_bytes;
  options.packet_socket = setting.packet_socket;
  options.chunks = setting.chunks;
  options.exposure_us = 1000.0;
  AravisCamera camera(options);
  if (const auto opened = camera.open(); !opened)
    return std::fprintf(stderr, "%s\n", to_string(opened.error()).c_str()), 1;
  device.lose_packets(share_lost);
  Outcome outcome;
  const auto begin = steady_clock::now();
  for (int i = 0; i < frames; ++i) count(camera.capture(begin + std::chrono::hours(1)), outcome);
  const double seconds = std::chrono::duration<double>(steady_clock::now() - begin).count();
  const AravisStatistics lost = camera.statistics();
  std::printf(
      "%-30s %6.1f frames/s; %d of %d identical, %d wrong, %d failed; %llu frames lost, %llu torn; %llu packets "
      "lost, %llu sent again\n",
      setting.name, frames / seconds, outcome.identical, frames, outcome.wrong, outcome.failed,
      static_cast<unsigned long long>(lost.lost), static_cast<unsigned long long>(lost.torn),
      static_cast<unsigned long long>(device.packets_lost()),
      static_cast<unsigned long long>(device.packets_sent_again()));
  return outcome.wrong;
}

}  // namespace

int main(int arguments, char** words) {
  const int frames = arguments > 1 ? std::atoi(words[1]) : 200;
  const double share_lost = arguments > 2 ? std::atof(words[2]) : 0.0;
  int wrong = 0;
  for (const Setting& setting : {Setting{"triggered, 1400 bytes", AravisTrigger::kSoftware, 1400, false},
                                 Setting{"triggered, 9000 bytes", AravisTrigger::kSoftware, 9000, false},
                                 Setting{"triggered, without chunks", AravisTrigger::kSoftware, 9000, false, false},
                                 Setting{"free run at 60 Hz, 9000 bytes", AravisTrigger::kFreeRun, 9000, false},
                                 Setting{"triggered, packet socket", AravisTrigger::kSoftware, 9000, true}})
    wrong += measure(setting, frames, share_lost);
  return wrong == 0 ? 0 : 1;
}
