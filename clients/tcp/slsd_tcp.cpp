// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <csignal>
#include <iostream>
#include <string>
#include <vector>

#include <systemd/sd-daemon.h>
#include <CLI/CLI.hpp>

#include <slsd/connection.hpp>

#include "clients/access/service_socket.hpp"
#include "clients/tcp/tcp_server.hpp"
#include "clients/usage/usage.hpp"

namespace {

using slsd::tcp::AddressRange;
using slsd::tcp::TcpOptions;

/// @errors kInvalidArgument: not an address; addresses are missing
slsd::Result<std::vector<AddressRange>> ranges_of(std::vector<std::string> allow, const std::string& listen) {
  const bool local = listen.starts_with("127.") || listen == "::1";
  if (allow.empty() && !local) {
    return slsd::fail(slsd::ErrorCode::kInvalidArgument,
                      "name the addresses that may connect: --allow 192.168.1.20 for one, 192.168.1.0/24 for a network",
                      listen);
  }
  if (allow.empty()) allow = {"127.0.0.0/8", "::1"};
  std::vector<AddressRange> ranges;
  for (const std::string& text : allow) {
    const auto range = AddressRange::parse(text);
    if (!range) return tl::unexpected(range.error());
    ranges.push_back(*range);
  }
  return ranges;
}

slsd::Result<> serve(TcpOptions options, const std::vector<std::string>& allow, const std::string& token_file) {
  auto ranges = ranges_of(allow, options.listen);
  if (!ranges) return tl::unexpected(ranges.error());
  options.allow = std::move(*ranges);
  if (auto valid = slsd::check_service_socket(options.socket); !valid) return valid;
  auto token = slsd::read_token(token_file);
  if (!token) return tl::unexpected(token.error());
  const std::string listen = options.listen;
  slsd::tcp::TcpServer server(std::move(options), std::move(*token));
  if (auto opened = server.open(); !opened) return opened;
  std::cout << "slsd-tcp: listening on " << listen << " port " << server.port() << std::endl;
  sd_notify(0, "READY=1");
  server.run();
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Serves the socket of a structured-light scanner over TCP, to listed addresses that send a token.",
               "slsd-tcp");
  TcpOptions options;
  options.socket = slsd::client::default_socket();
  std::vector<std::string> allow;
  std::string token_file;
  app.set_version_flag("--version", "slsd-tcp " SLSD_VERSION);
  app.add_option("--token-file", token_file, "a file with the token that clients must send, of 16 characters or more")
      ->required();
  app.add_option("--allow", allow,
                 "an address that may connect, or a network such as 192.168.1.0/24; default: this machine alone");
  app.add_option("--listen", options.listen,
                 "the address to listen on; beyond loopback it needs --allow (" + options.listen + ")");
  app.add_option("--port", options.port,
                 "the port to listen on; 0: any free port (" + std::to_string(options.port) + ")")
      ->check(slsd::between(0, 65535));
  app.add_option("--clients-max", options.clients_max,
                 "how many clients may be connected (" + std::to_string(options.clients_max) + ")")
      ->check(slsd::between(1, 64));
  app.add_option("--socket", options.socket,
                 "the service's socket; default: SLSD_SOCKET if set (" + options.socket.string() + ")");
  if (const auto ended = slsd::parse_usage(app, argc, argv)) return *ended;
  std::signal(SIGPIPE, SIG_IGN);
  const slsd::Result<> done = serve(options, allow, token_file);
  if (done) return 0;
  std::cerr << "slsd-tcp: " << to_string(done.error()) << "\n";
  return 1;
}
