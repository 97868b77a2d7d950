// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/client/client_options.hpp"

namespace slsd {

/// slsctl record: scans on and on, each while the frames of the one before are written, until as many as asked for are
/// there, the time is over, or an interrupt comes.
/// @return the exit status
[[nodiscard]] int record_command(const ClientOptions& options);

}  // namespace slsd
