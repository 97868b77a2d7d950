// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bridge.hpp"
#include "clients/usage/usage.hpp"
#include "core/geometry/robot_pose.hpp"
#include "merge.hpp"
#include "tf/robot_poses.hpp"

namespace {

int failed(const slsd::Error& error) {
  std::fprintf(stderr, "slsd-dds: %s\n", to_string(error).c_str());
  return error.code == slsd::ErrorCode::kInvalidArgument ? 2 : 1;
}

int describe(const slsd::dds::BridgeOptions& options, const std::string& calibration) {
  const auto text = slsd::dds::describe(options, calibration);
  if (!text) return failed(text.error());
  return std::fputs(text->c_str(), stdout) < 0 || std::fflush(stdout) != 0 ? 1 : 0;
}

slsd::Result<slsd::dds::Network> join(slsd::dds::NetworkOptions network, std::string doubt) {
  network.discovery = slsd::dds::read_discovery([](const char* variable) {
    const char* value = std::getenv(variable);
    return std::string(value ? value : "");
  });
  if (!doubt.empty()) network.discovery.warnings.push_back(std::move(doubt));
  for (const std::string& warning : network.discovery.warnings) std::fprintf(stderr, "slsd-dds: %s\n", warning.c_str());
  return slsd::dds::Network::open(network);
}

/// Leaves the networks, in ten seconds at most: it waits for writes under way and for Fast DDS, which has no limit.
void leave_in_time() {
  constexpr std::chrono::seconds kLongest(10);
  std::promise<void> left;
  std::future<void> leaving = left.get_future();
  std::thread([left = std::move(left)]() mutable {  // may outlive this function
    slsd::dds::leave_networks();
    left.set_value();
  })
      .detach();
  if (leaving.wait_for(kLongest) != std::future_status::ready)
    std::fprintf(stderr, "slsd-dds: ends without leaving the network in order: others notice when its lease ends\n");
}

/// @return false: a write hangs
bool wait_for_signal(const sigset_t& signals) {
  constexpr timespec kLook{1, 0};
  while (sigtimedwait(&signals, nullptr, &kLook) < 0)
    if (slsd::dds::write_hangs()) return false;
  return true;
}

int print_pose(const slsd::dds::NetworkOptions& options, const slsd::dds::RobotFrames& frames) {
  const auto network = join(options, {});
  if (!network) return failed(network.error());
  const auto poses = slsd::dds::RobotPoses::open(*network, frames);
  if (!poses) return failed(poses.error());
  const auto pose = (*poses)->standing();
  if (!pose) return failed(pose.error());
  const auto numbers = robot_numbers(*pose, *slsd::pose_notation("ros"));
  std::printf("%s\n", fmt::format("{:.8f}", fmt::join(numbers, ",")).c_str());
  return std::fflush(stdout) != 0 ? 1 : 0;
}

void add_scanner_options(CLI::App& app, slsd::dds::BridgeOptions& options) {
  app.add_option("--socket", options.socket,
                 "the service's socket (SLSD_SOCKET in the environment, or /run/slsd/slsd.sock)");
  app.add_option("--rate", options.rate_hz, "at most this many clouds per second; 0: only triggered ones")
      ->check(slsd::between(0.0, 1000.0));
  app.add_option("--density", options.density, "a point for each symbol, or for each camera pixel")
      ->check(slsd::one_of({"symbols", "pixels"}));
  app.add_option("--stride", options.thinning.stride,
                 "use every Nth camera pixel and row in dense clouds and depth images (2)")
      ->check(slsd::between(1, 16));
  app.add_option("--voxel", options.thinning.voxel_mm, "keep one point per cube of this size in mm; 0: keep all (0)")
      ->check(slsd::between(0.0, 1000.0));
  app.add_flag("--colour", options.colour,
               "give triggered scans the surface's colours, from a second frame in white light");
  app.add_option("--image-rate", options.image_rate_hz, "images per second, 1 or more; 0: none (0)")
      ->check(slsd::between(0.0, 100.0));
  app.add_option("--extrinsics", options.extrinsics, "the TOML file with the poses of the scanners");
  app.add_flag_callback(
      "--no-transforms", [&options] { options.transforms = false; },
      "do not publish /tf_static, because a robot description has the frames");
}

void add_robot_options(CLI::App& app, slsd::dds::RobotFrames& robot, bool& prints_pose) {
  app.add_option("--robot-base", robot.base, "the tf frame of the robot's base, for clouds in it (base_link)")
      ->type_name("FRAME");
  auto* flange =
      app.add_option(
             "--flange", robot.flange,
             "the tf frame of the flange that carries the scanner, such as tool0; clouds are then in --robot-base")
          ->type_name("FRAME");
  app.add_flag("--print-pose", prints_pose,
               "wait until --flange stands still in --robot-base, print its pose in ROS's notation, and exit")
      ->needs(flange);
}

void add_merge_options(CLI::App& app, bool& merges, slsd::dds::MergeOptions& merge) {
  auto* merging = app.add_flag("--merge", merges, "publish one cloud of several scanners, placed by --extrinsics");
  for (const char* alone : {"--socket", "--rate", "--density", "--colour", "--stride", "--voxel", "--image-rate",
                            "--no-transforms", "--describe", "--print-pose", "--flange"})
    merging->excludes(app.get_option(alone));
  app.add_option("--scanner", merge.scanners, "with --merge: a scanner to merge; may be repeated (all in the file)")
      ->needs(merging);
  app.add_option_function<double>(
         "--max-age", [&merge](double seconds) { merge.max_age = std::chrono::duration<double>(seconds); },
         "with --merge: how many seconds a cloud may be older than the newest (1)")
      ->check(slsd::between(0.01, 3600.0))
      ->needs(merging);
}

void add_network_options(CLI::App& app, slsd::dds::NetworkOptions& network) {
  app.add_option("--rate-max", network.rate_max_mb, "the limit for clouds and images, in megabytes per second (16)")
      ->check(slsd::between(1.0, 2000.0));
  app.add_option("--domain", network.domain, "the DDS domain (0)")
      ->envname("ROS_DOMAIN_ID")
      ->check(slsd::between(0, 232));
  app.add_option("--interface", network.interface, "the network interface, such as eth0 or lo");
  app.add_option("--peer", network.peers, "the address of a peer, if the network has no multicast; may be repeated");
  app.add_flag("--best-effort", network.best_effort, "do not resend lost data");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Publishes a scanner in ROS 2: clouds, images, diagnostics, transforms, and a service that scans.\nExit status: "
      "0 done, 1 cannot publish, 2 wrong usage.",
      "slsd-dds");
  slsd::dds::BridgeOptions options;
  slsd::dds::NetworkOptions network;
  app.set_version_flag("--version", "slsd-dds " SLSD_VERSION);
  auto* name = app.add_option("--name", options.name,
                              "the scanner's name, the first part of its topics (scanner; with --merge: merged)");
  add_scanner_options(app, options);
  bool prints_pose = false;
  slsd::dds::RobotFrames robot;
  add_robot_options(app, robot, prints_pose);
  std::optional<std::string> calibration;
  app.add_option("--describe", calibration,
                 "print the scanner as a robot description (URDF), from this calibration file or the one in force")
      ->expected(0, 1)
      ->default_str("");
  bool merges = false;
  slsd::dds::MergeOptions merge;
  add_merge_options(app, merges, merge);
  add_network_options(app, network);
  if (const auto ended = slsd::parse_usage(app, argc, argv)) return *ended;
  if (calibration) return describe(options, *calibration);
  if (prints_pose) return print_pose(network, robot);
  // Blocked before the first thread starts: all threads leave these signals to the one that waits for them.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  auto joined = join(network, slsd::dds::receive_buffer_warning());
  if (!joined) return failed(joined.error());
  options.robot_base = robot.base;
  options.flange = robot.flange;
  slsd::Result<std::unique_ptr<slsd::dds::Bridge>> bridge;
  slsd::Result<std::unique_ptr<slsd::dds::Merge>> merged;
  if (merges) {
    if (name->count() > 0) merge.name = options.name;
    merge.extrinsics = options.extrinsics;
    merged = slsd::dds::Merge::start(merge, std::move(*joined));
  } else {
    bridge = slsd::dds::Bridge::start(options, std::move(*joined));
  }
  if (!bridge) return failed(bridge.error());
  if (!merged) return failed(merged.error());
  if (!wait_for_signal(ends)) {
    std::fprintf(stderr, "slsd-dds: the network takes nothing more: Fast DDS hangs in a write; start slsd-dds again\n");
    std::_Exit(1);  // the unit starts it again
  }
  leave_in_time();
  std::_Exit(0);  // its threads may be waiting for the service
}
