// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <malloc.h>

#include <csignal>
#include <iostream>

#include <systemd/sd-daemon.h>
#include <CLI/CLI.hpp>

#include "clients/access/service_socket.hpp"
#include "clients/access/token.hpp"
#include "clients/usage/usage.hpp"
#include "clients/web/announcement.hpp"
#include "clients/web/page_server.hpp"

namespace {

using slsd::Token;
using slsd::web::PageOptions;

constexpr int kOwnPagesBytes = 256 << 10;

/// @errors kInvalidArgument: a required token is missing or too short; those of read_file()
slsd::Result<Token> token_of(const PageOptions& options) {
  if (!options.token_file.empty()) return slsd::read_token(options.token_file);
  if (slsd::web::is_loopback(options.listen)) return slsd::random_token();
  return slsd::fail(slsd::ErrorCode::kInvalidArgument,
                    "beyond loopback, anyone who knows the address could scan: give --token-file a file with a token "
                    "of 16 characters or more",
                    options.listen);
}

std::string address_of(const PageOptions& options, int port) {
  const bool any = options.listen == "0.0.0.0" || options.listen == "::";
  const std::string host = !any ? options.listen : options.names.empty() ? "127.0.0.1" : options.names.front();
  const bool brackets = host.find(':') != std::string::npos;
  return "http://" + (brackets ? "[" + host + "]" : host) + ":" + std::to_string(port) + "/";
}

/// Tells the user what to open. Does not print a chosen token: its author knows it.
/// @return the address with this run's token
std::string announce(const PageOptions& options, const Token& token, int port) {
  const std::string query = token.chosen ? "" : "?token=" + token.text;
  std::string address = address_of(options, port) + query;
  std::cout << "slsd-web: open " << address
            << (token.chosen ? " and enter the token of " + options.token_file.string() : "") << "\n";
  if (!token.chosen && !options.names.empty())
    std::cout << "slsd-web: behind a proxy, put " << query << " after the page's address there\n";
  std::cout << std::flush;
  return address;
}

slsd::Result<> serve(const PageOptions& options) {
  if (auto valid = slsd::check_service_socket(options.socket); !valid) return valid;
  const auto token = token_of(options);
  if (!token) return tl::unexpected(token.error());
  slsd::web::PageServer server(options, *token);
  if (auto opened = server.open(); !opened) return opened;
  auto announcement = slsd::web::Announcement::write(server.port(), announce(options, *token, server.port()));
  if (!announcement) std::cerr << "slsd-web: " << to_string(announcement.error()) << std::endl;
  sd_notify(0, "READY=1");
  server.run([&] {
    if (announcement) announcement->remove();
  });
  return {};
}

slsd::Result<> print_addresses() {
  const auto addresses = slsd::web::announced_addresses();
  if (!addresses) return tl::unexpected(addresses.error());
  for (const std::string& address : *addresses) std::cout << address << "\n";
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Serves the web page of a structured-light scanner, as a client of slsd's socket.", "slsd-web");
  PageOptions options;
  bool only_address = false;
  app.set_version_flag("--version", "slsd-web " SLSD_VERSION);
  app.add_option("--socket", options.socket,
                 "the service's socket; default: SLSD_SOCKET if set (" + options.socket.string() + ")");
  app.add_option("--listen", options.listen,
                 "the address to listen on; beyond loopback it needs --token-file (" + options.listen + ")");
  app.add_option("--port", options.port,
                 "the port to listen on; 0: any free port (" + std::to_string(options.port) + ")")
      ->check(slsd::between(0, 65535));
  app.add_option("--name", options.names, "another host name by which browsers may open the page; may be repeated");
  app.add_option("--token-file", options.token_file,
                 "a file with the token to enter; default: a new token for each run");
  app.add_option("--three", options.three, "the folder of three.js; default: that of Debian's libjs-three");
  app.add_option("--boards", options.boards, "the folder of boards to print (" + options.boards.string() + ")");
  app.add_option("--hand-eye", options.views, "the folder for the views of a hand-eye calibration");
  app.add_option("--model", options.model, "the folder for a model's clouds and files");
  app.add_flag("--address", only_address, "print the address and token of the running page, and exit");
  if (const auto ended = slsd::parse_usage(app, argc, argv)) return *ended;
  std::signal(SIGPIPE, SIG_IGN);
  // Clouds are large: freed memory returns to the system at once, whichever thread had it.
  ::mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  ::mallopt(M_ARENA_MAX, 2);
  const slsd::Result<> done = only_address ? print_addresses() : serve(options);
  if (done) return 0;
  std::cerr << "slsd-web: " << to_string(done.error()) << "\n";
  return 1;
}
