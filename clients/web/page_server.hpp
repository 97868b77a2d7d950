// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "clients/web/cloud_feed.hpp"
#include "clients/web/gate.hpp"

namespace httplib {
class Server;
struct Request;
struct Response;
}  // namespace httplib

namespace slsd::web {

struct PageOptions {
  std::filesystem::path socket = "/run/slsd/slsd.sock";
  std::string listen = "127.0.0.1";
  int port = 8384;
  std::vector<std::string> names = {};                          ///< by which the page is asked for, besides the address
  std::filesystem::path token_file = {};                        ///< empty: no token, which is for loopback alone
  std::filesystem::path three = "/usr/share/javascript/three";  ///< Debian's libjs-three
};

/// A scan that the page asked for.
struct PastScan {
  nlohmann::json about;
  client::Bytes ply;  ///< empty: none, or given up for newer ones
};

/// The page and what it asks for, each as one request to the service's socket.
/// @thread the handlers run on the HTTP library's threads
class PageServer {
 public:
  PageServer(PageOptions options, std::string token);

  /// Serves until a signal ends the program. @errors kIo: cannot listen there
  [[nodiscard]] Result<> run();

 private:
  void add_pages(httplib::Server& server);
  void add_requests(httplib::Server& server);
  [[nodiscard]] bool admits(const httplib::Request& request, httplib::Response& response, bool open = false);
  [[nodiscard]] tl::expected<Answered, Failure> call(const char* method, nlohmann::json params) const;
  void tell_status(httplib::Response& response);
  void send_image(const httplib::Request& request, httplib::Response& response, const char* method) const;
  void send_cloud(const httplib::Request& request, httplib::Response& response);
  void scan(const nlohmann::json& body, httplib::Response& response);
  void send_past(const httplib::Request& request, httplib::Response& response);
  void keep(PastScan scan);

  PageOptions options_;
  Gate gate_;
  CloudFeed symbols_;
  CloudFeed pixels_;
  std::mutex mutex_;
  std::deque<PastScan> past_;  ///< the newest first
};

}  // namespace slsd::web
