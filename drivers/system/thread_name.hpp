// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <pthread.h>

#include <string>

namespace slsd {

/// Names the calling thread for `top -H` and debuggers; Linux keeps 15 bytes.
inline void name_this_thread(const std::string& name) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
}

}  // namespace slsd
