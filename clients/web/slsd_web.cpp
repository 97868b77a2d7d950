// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <malloc.h>

#include <csignal>
#include <iostream>

#include <CLI/CLI.hpp>

#include "clients/web/page_server.hpp"
#include "drivers/files/file.hpp"

namespace {

constexpr int kOwnPagesBytes = 256 << 10;
constexpr std::size_t kTokenBytesMin = 16, kTokenBytesMax = 1024;

/// @errors kInvalidArgument: none where one is needed, or too short a one; those of read_file()
slsd::Result<std::string> read_token(const slsd::web::PageOptions& options) {
  const bool loopback = options.listen == "127.0.0.1" || options.listen == "::1";
  if (options.token_file.empty()) {
    if (loopback) return std::string();
    return slsd::fail(slsd::ErrorCode::kInvalidArgument,
                      "beyond loopback whoever knows the address could scan: name a file with a token of 16 characters "
                      "or more with --token-file",
                      options.listen);
  }
  auto token = slsd::read_file(options.token_file, kTokenBytesMax);
  if (!token) return token;
  while (!token->empty() && std::isspace(static_cast<unsigned char>(token->back())) != 0) token->pop_back();
  if (token->size() >= kTokenBytesMin) return token;
  return slsd::fail(slsd::ErrorCode::kInvalidArgument, "a token has 16 characters or more",
                    options.token_file.string());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The page of a structured-light scanner: a client of slsd's socket that browsers can talk to.");
  slsd::web::PageOptions options;
  app.set_version_flag("--version", "slsd-web " SLSD_VERSION);
  app.add_option("--socket", options.socket, "the service's socket")->capture_default_str();
  app.add_option("--listen", options.listen, "the address to listen at; beyond loopback it takes a token")
      ->capture_default_str();
  app.add_option("--port", options.port)->check(CLI::Range(1, 65535))->capture_default_str();
  app.add_option("--name", options.names, "a name by which browsers ask for the page, besides the address");
  app.add_option("--token-file", options.token_file, "a file with the token that the page asks for");
  app.add_option("--three", options.three, "the folder of three.js, as Debian's libjs-three has it")
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::signal(SIGPIPE, SIG_IGN);
  // Clouds are large: what one took goes back to the system with it, whichever of many threads had it.
  ::mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  ::mallopt(M_ARENA_MAX, 2);
  const auto token = read_token(options);
  slsd::Result<> served = token ? slsd::Result<>() : tl::unexpected(token.error());
  if (token) served = slsd::web::PageServer(options, *token).run();
  if (served) return 0;
  std::cerr << "slsd-web: " << to_string(served.error()) << "\n";
  return 1;
}
