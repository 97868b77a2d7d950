// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <slsd/connection.hpp>

#include "clients/web/cloud_feed.hpp"
#include "clients/web/gate.hpp"
#include "clients/web/hand_eye.hpp"
#include "clients/web/http_server.hpp"
#include "clients/web/model/model_session.hpp"
#include "clients/web/pages.hpp"

namespace slsd::web {

/// A folder for what outlives the page, unless the user names one: in $STATE_DIRECTORY, as systemd sets it, else in the
/// user's own folder of states.
[[nodiscard]] std::filesystem::path state_folder(const std::string& name);

struct PageOptions {
  std::filesystem::path socket = client::default_socket();
  std::string listen = "127.0.0.1";
  int port = 8384;
  std::vector<std::string> names = {};                          ///< the page's host names, in addition to the address
  std::filesystem::path token_file = {};                        ///< empty: a random token for this run
  std::filesystem::path three = "/usr/share/javascript/three";  ///< Debian's libjs-three
  std::filesystem::path boards = SLSD_BOARDS;                   ///< boards that are ready to print
  std::filesystem::path views = state_folder("hand_eye");       ///< of a hand-eye calibration
  std::filesystem::path model = state_folder("model");          ///< clouds and files of the latest model
};

/// Tells whether only this machine can reach the address.
[[nodiscard]] bool is_loopback(const std::string& address);

/// A scan that the page requested.
struct PastScan {
  nlohmann::json about;
  client::Bytes cloud;  ///< empty: none, or dropped for newer ones
};

/// The page and its data; each request becomes one request to the service's socket.
/// @thread the server's workers call the handlers
class PageServer {
 public:
  PageServer(PageOptions options, Token token);

  /// Listens. @errors those of HttpServer::open()
  [[nodiscard]] Result<> open();
  [[nodiscard]] int port() const { return server_->port(); }
  /// Serves until a signal ends the program. @param at_end  called before
  void run(const std::function<void()>& at_end);

 private:
  /// One address: its method, its secret, its answer.
  struct Route {
    std::string method;              ///< GET (also serves HEAD) or POST
    bool open;                       ///< needs no secret: shows no data and does nothing
    std::vector<std::string> names;  ///< of its address's parameters; an open one ignores others
    std::function<Answer(const Request&)> answer;
  };
  using Handle = std::function<Answer(const Request&)>;
  using HandleBody = std::function<Answer(const Request&, const nlohmann::json& body)>;

  void add_pages();
  void add_requests();
  void get(const char* path, Handle handle) { get(path, {}, std::move(handle)); }
  void get(const char* path, std::vector<std::string> names, Handle handle) {
    routes_[path] = {"GET", false, std::move(names), std::move(handle)};
  }
  void post(const char* path, bool open, HandleBody handle);
  void pass_on(const char* path, const char* method);
  [[nodiscard]] std::optional<Answer> refuse(const Request& request);
  [[nodiscard]] tl::expected<Answered, Failure> call(const char* method, const nlohmann::json& params,
                                                     std::chrono::seconds timeout) const;
  [[nodiscard]] Answer refusal_of(const Failure& failure) const;
  [[nodiscard]] Answer result_or_refusal(const tl::expected<Answered, Failure>& answered) const;
  [[nodiscard]] Answer index(const Page& page, const Request& request);
  [[nodiscard]] Answer log_in(const Request& request, const nlohmann::json& body);
  [[nodiscard]] Answer status();
  [[nodiscard]] Answer image(const Request& request, const char* method) const;
  [[nodiscard]] Answer reasons(const Request& request) const;
  [[nodiscard]] Answer boards() const;
  [[nodiscard]] Answer board(const Request& request) const;
  [[nodiscard]] Answer hand_eye() const;
  [[nodiscard]] Answer hand_eye_picture(const Request& request) const;
  [[nodiscard]] Answer cloud(const Request& request);
  [[nodiscard]] Answer scan(const nlohmann::json& body);
  void add_model_requests();
  [[nodiscard]] Answer take_background();
  [[nodiscard]] Answer past(const Request& request);
  void keep(PastScan scan);

  PageOptions options_;
  Token token_;
  std::unique_ptr<Gate> gate_;  ///< set by open(), because the cookie's name contains the port
  std::unique_ptr<HttpServer> server_;
  std::map<std::string, Route, std::less<>> routes_;
  CloudFeed symbols_;
  CloudFeed pixels_;
  CloudFeed maps_;  ///< of pixels, too, with the place of each
  HandEye hand_eye_;
  ModelSession model_;
  std::mutex mutex_;
  std::deque<PastScan> past_;  ///< newest first
};

}  // namespace slsd::web
