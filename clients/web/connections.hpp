// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>

#include <httplib.h>

namespace slsd::web {

/// The HTTP library's server, with an end to what a connection may take: the library waits some seconds for each byte
/// alone, so that a few peers that send one at a time would hold all threads for good.
///
///     idle --first byte--> a request, whole within 5 s --> answered --> idle, 5 s
///
/// Where many hold threads so, each has less. An answer is taken at a megabyte in ten seconds at least.
class Connections final : public httplib::Server {
 private:
  bool process_and_close_socket(socket_t socket) override;

  std::atomic<int> waiting_ = 0;  ///< connections that have no whole request yet
};

}  // namespace slsd::web
