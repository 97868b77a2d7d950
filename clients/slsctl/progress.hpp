// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/client_options.hpp"

namespace slsd {

/// Shows on a terminal's standard error for how long an answer has been awaited, from the first second on. Elsewhere,
/// and with --json, it shows nothing. The line is wiped when it ends.
/// @thread thread-bound
class Progress {
 public:
  /// @param connection  outlives it
  /// @param doing       what takes its time: "scanning"
  Progress(const ClientOptions& options, Connection& connection, std::string doing);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  Connection& connection_;
  std::string doing_;
  std::size_t shown_ = 0;  ///< columns to be wiped
};

}  // namespace slsd
