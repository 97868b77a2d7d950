// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <spdlog/common.h>

namespace slsd {

/// Sends the log to standard error: with time and level in a terminal, with the journal's own level prefix ("<6>")
/// where systemd reads it.
void start_logging(spdlog::level::level_enum level);

}  // namespace slsd
