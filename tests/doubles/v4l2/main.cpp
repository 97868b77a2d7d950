// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// A V4L2 double as a program: v4l2-double [IMAGE [RATE_HZ]] serves one image, or numbered frames of 160x120. It prints
// the path of its device, then takes a command to a line on standard input and answers "ok" or "?": unplug, replug,
// trigger, drop N, flag N, short N, age N, stall MILLISECONDS, eio N, die. It ends with its input. Exit status 77: no
// FUSE here.
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "drivers/files/read_image.hpp"
#include "tests/doubles/v4l2/v4l2_double.hpp"

namespace {

using namespace slsd;
using namespace slsd::test;

constexpr int kSkipped = 77;

Result<DoubleOptions> serve(const std::string& file, double rate_hz) {
  auto image = read_image(file);
  if (!image) return tl::unexpected(image.error());
  const auto* grey = std::get_if<Grey8>(&*image);
  if (grey == nullptr) return fail(ErrorCode::kUnsupported, "the image must have 8 bits", file);
  DoubleOptions options;
  options.rates_hz = {rate_hz};
  options.formats = {{V4L2_PIX_FMT_GREY, {{grey->width(), grey->height()}}}};
  options.controls = uvc_controls();
  options.source = [picture = *grey](std::uint64_t, Grey8& frame) { frame = picture; };
  return options;
}

bool obey(V4l2Double& camera, const std::string& command, int count) {
  static const std::map<std::string, int DoubleFaults::*> kFaults{{"drop", &DoubleFaults::drop},
                                                                  {"flag", &DoubleFaults::flag},
                                                                  {"short", &DoubleFaults::shorten},
                                                                  {"age", &DoubleFaults::age},
                                                                  {"eio", &DoubleFaults::fail_dequeue}};
  if (const auto fault = kFaults.find(command); fault != kFaults.end()) {
    camera.inject([&](DoubleFaults& faults) { faults.*fault->second = count; });
    return true;
  }
  if (command == "unplug")
    camera.unplug();
  else if (command == "replug")
    camera.replug();
  else if (command == "trigger")
    camera.trigger();
  else if (command == "die")
    camera.inject([](DoubleFaults& faults) { faults.dead = true; });
  else if (command == "stall")
    camera.stall(std::chrono::milliseconds(count));
  else
    return false;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const Result<DoubleOptions> options =
      argc > 1 ? serve(argv[1], argc > 2 ? std::atof(argv[2]) : 60.0) : DoubleOptions{};
  if (!options) return std::cerr << to_string(options.error()) << "\n", 1;
  const auto camera = V4l2Double::create(*options);
  if (!camera) return std::cerr << to_string(camera.error()) << "\n", kSkipped;
  std::cout << (*camera)->path().string() << std::endl;
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string command;
    int count = 1;
    words >> command;
    if (!words.eof()) words >> count;
    std::cout << (obey(**camera, command, count) ? "ok" : "?") << std::endl;
  }
}
