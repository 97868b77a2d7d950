// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include <CLI/CLI.hpp>

#include "bridge.hpp"

namespace {

int failed(const slsd::Error& error) {
  std::fprintf(stderr, "slsd-dds: %s\n", to_string(error).c_str());
  return error.code == slsd::ErrorCode::kInvalidArgument ? 2 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Shows a scanner of slsd to a ROS 2 network: clouds, images, diagnostics, where it stands, and a trigger.\n"
      "Exit status: 0 done, 1 it cannot be shown, 2 wrong usage.");
  slsd::dds::BridgeOptions options;
  slsd::dds::NetworkOptions network;
  app.set_version_flag("--version", "slsd-dds " SLSD_VERSION);
  app.add_option("--name", options.name, "of the scanner: its topics begin with it (scanner)");
  app.add_option("--socket", options.socket, "of its service");
  app.add_option("--rate", options.rate_hz, "at most so many clouds a second; 0: only those that are triggered")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--density", options.density, "a point for each symbol, or for each camera pixel")
      ->check(CLI::IsMember({"symbols", "pixels"}));
  app.add_option("--image-rate", options.image_rate_hz, "images a second, 1 or more; 0: none (0)")
      ->check(CLI::Range(0.0, 100.0));
  app.add_option("--extrinsics", options.extrinsics, "where the scanners stand, as TOML");
  app.add_option("--domain", network.domain, "of DDS (0)")->envname("ROS_DOMAIN_ID")->check(CLI::Range(0, 232));
  app.add_option("--interface", network.interface, "of the network: eth0, lo");
  app.add_option("--peer", network.peers, "an address of others, where the network has no multicast; may be repeated");
  app.add_flag("--best-effort", network.best_effort, "do not send again what is lost on the way");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  // Before the first thread: they all leave these to the one who waits for them.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  auto joined = slsd::dds::Network::open(network);
  if (!joined) return failed(joined.error());
  const auto bridge = slsd::dds::Bridge::start(options, std::move(*joined));
  if (!bridge) return failed(bridge.error());
  int signal = 0;
  sigwait(&ends, &signal);
  dds_delete(DDS_CYCLONEDDS_HANDLE);  // tells the others that it goes
  std::_Exit(0);                      // its threads wait for the service
}
