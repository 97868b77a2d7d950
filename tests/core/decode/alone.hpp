// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/executor.hpp"

namespace slsd {

/// Runs each share of the work on the test's own thread.
inline SerialExecutor alone;

}  // namespace slsd
