// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/utc_now.hpp"

#include <ctime>

namespace slsd {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace slsd
