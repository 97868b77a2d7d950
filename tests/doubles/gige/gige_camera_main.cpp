// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
//
// A GigE Vision camera on this host:
//   gige-camera [--address A] [--serial S] [--size WxH] [--images PATH] [--chunks 0|1] [--breaks-up 0|1]
//               [--restarts-ids 0|1] [--arming-us N] [--clock good|still|epoch|rate|back]
// Serves counted frames, or one image or those of a folder. Prints its address, and then obeys the commands that it
// reads, a line each, and answers "ok" or "?", until "quit" or the end of the input.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "drivers/files/read_image.hpp"
#include "tests/doubles/gige/gige_camera.hpp"

namespace slsd::test {
namespace {

constexpr const char* kUsage =
    "usage: gige-camera [--address A] [--serial S] [--size WxH] [--images PATH] [--chunks 0|1] [--breaks-up 0|1]\n"
    "                   [--restarts-ids 0|1] [--arming-us N] [--clock good|still|epoch|rate|back]\n"
    "commands: lose SHARE | drop N | truncate N | stale N | silent 0|1 | gone 0|1 | resends 0|1 | stall MS |\n"
    "          misexpose N | misgain N | cut N | garble N |\n"
    "          blip MS | occupy 0|1 | pulse | status | quit\n";

std::vector<Grey8> images_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  if (std::filesystem::is_regular_file(folder)) paths.push_back(folder);
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) paths.push_back(entry.path());
  std::ranges::sort(paths);
  std::vector<Grey8> images;
  for (const auto& path : paths) {
    const auto image = read_image(path);
    if (image && std::holds_alternative<Grey8>(*image)) images.push_back(std::get<Grey8>(*image));
  }
  return images;
}

bool set_clock(const std::string& value, GigeCameraOptions& options) {
  const std::array<std::string, 5> names{"good", "still", "epoch", "rate", "back"};  // as ClockFault
  const auto* const found = std::ranges::find(names, value);
  if (found == names.end()) return false;
  options.clock_fault = static_cast<ClockFault>(found - names.begin());
  return true;
}

bool set_option(const std::string& name, const std::string& value, GigeCameraOptions& options) {
  if (name == "--address") return options.address = value, true;
  if (name == "--serial") return options.serial = value, true;
  if (name == "--size") return std::sscanf(value.c_str(), "%dx%d", &options.width_px, &options.height_px) == 2;
  if (name == "--chunks") return options.chunks = value != "0", true;
  if (name == "--breaks-up") return options.breaks_up = value != "0", true;
  if (name == "--restarts-ids") return options.restarts_ids = value != "0", true;
  if (name == "--arming-us") return options.arming = std::chrono::microseconds(std::atoi(value.c_str())), true;
  if (name == "--clock") return set_clock(value, options);
  if (name != "--images") return false;
  std::vector<Grey8> images = images_of(value);
  if (images.empty()) return false;
  options.width_px = images.front().width();
  options.height_px = images.front().height();
  options.frames = replayed_images(std::move(images));
  return true;
}

std::optional<GigeCameraOptions> parse(int count, char** words) {
  GigeCameraOptions options;
  for (int i = 1; i < count; i += 2)
    if (i + 1 == count || !set_option(words[i], words[i + 1], options)) return std::nullopt;
  return options;
}

void print_status(const GigeCamera& camera) {
  std::cout << camera.frames_exposed() << " frames exposed, " << camera.packets_lost() << " packets lost, "
            << camera.packets_sent_again() << " sent again\n";
}

/// The commands, each with what it does with its number.
std::map<std::string, std::function<void(double)>> commands_of(GigeCamera& camera, GigeFaults& faults) {
  const auto number = [&](int GigeFaults::*count) {
    return [&camera, &faults, count](double value) {
      camera.set_faults((faults.*count = static_cast<int>(value), faults));
    };
  };
  const auto state = [&](bool GigeFaults::*flag) {
    return [&camera, &faults, flag](double value) { camera.set_faults((faults.*flag = value != 0.0, faults)); };
  };
  const auto time = [](double value) { return std::chrono::milliseconds(static_cast<int>(value)); };
  return {{"lose", [&](double value) { camera.lose_packets(value); }},
          {"drop", number(&GigeFaults::drop_frames)},
          {"truncate", number(&GigeFaults::truncate_frames)},
          {"stale", number(&GigeFaults::stale_frames)},
          {"misexpose", number(&GigeFaults::misexposed_frames)},
          {"misgain", number(&GigeFaults::misgained_frames)},
          {"cut", number(&GigeFaults::short_chunk_frames)},
          {"garble", number(&GigeFaults::garbage_chunk_frames)},
          {"silent", state(&GigeFaults::silent)},
          {"gone", state(&GigeFaults::gone)},
          {"resends", state(&GigeFaults::resends)},
          {"stall", [&camera, time](double value) { camera.stall(time(value)); }},
          {"blip", [&camera, time](double value) { camera.blip(time(value)); }},
          {"occupy", [&](double value) { camera.occupy(value != 0.0); }},
          {"pulse", [&](double) { camera.pulse_line(); }},
          {"status", [&](double) { print_status(camera); }}};
}

int obey(GigeCamera& camera) {
  GigeFaults faults;
  const auto commands = commands_of(camera, faults);
  for (std::string line; std::getline(std::cin, line) && line != "quit";) {
    std::istringstream words(line);
    std::string name;
    double value = 0.0;
    words >> name >> value;
    const auto command = commands.find(name);
    const bool known = command != commands.end();
    if (known) command->second(value);
    // A count is used up by the camera, and must not be set again with the next fault.
    faults.drop_frames = faults.truncate_frames = faults.stale_frames = 0;
    faults.misexposed_frames = faults.misgained_frames = 0;
    faults.short_chunk_frames = faults.garbage_chunk_frames = 0;
    std::cout << (known ? "ok" : "?") << std::endl;
  }
  return 0;
}

}  // namespace
}  // namespace slsd::test

int main(int count, char** words) {
  const auto options = slsd::test::parse(count, words);
  if (!options) return std::cerr << slsd::test::kUsage, 2;
  try {
    slsd::test::GigeCamera camera(*options);
    std::cout << camera.address() << std::endl;
    return slsd::test::obey(camera);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
