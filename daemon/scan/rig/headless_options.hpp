// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/configuration/projector_options.hpp"
#include "drivers/projector/headless_projector.hpp"

namespace slsd {

/// The [projector] options that a headless projector uses.
/// @thread reentrant
[[nodiscard]] inline HeadlessProjectorOptions headless_options(const ProjectorOptions& options) {
  HeadlessProjectorOptions headless;
  headless.width_px = options.width_px;
  headless.height_px = options.height_px;
  headless.light = options.light;
  if (options.refresh_hz > 0) headless.refresh_hz = options.refresh_hz;
  return headless;
}

}  // namespace slsd
