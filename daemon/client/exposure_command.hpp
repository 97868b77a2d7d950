// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/client/client_options.hpp"

namespace slsd {

/// slsctl exposure: looks at two frames of a camera while the pattern is shown, and proposes exposure and gain.
/// @return the exit status
[[nodiscard]] int exposure_command(const ClientOptions& options);

}  // namespace slsd
