// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/client/client_options.hpp"

namespace slsd {

/// slsctl project: has the projector show a picture, by its name or from a file. @return the exit status
[[nodiscard]] int project_command(const ClientOptions& options);

}  // namespace slsd
