// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/client_options.hpp"

namespace slsd {

/// Shows on a terminal's standard error how long an answer has been awaited, after the first second. Shows nothing
/// elsewhere or with --json. The destructor erases the line.
/// @thread thread-bound
class Progress {
 public:
  /// @param connection  must outlive this object
  /// @param doing       the slow activity: "scanning"
  Progress(const ClientOptions& options, Connection& connection, std::string doing);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  Connection& connection_;
  std::string doing_;
  std::size_t shown_ = 0;  ///< columns to erase
};

}  // namespace slsd
