// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "clients/slsctl/client_options.hpp"

namespace slsd {

/// The part of the scene that a command line asks for, as parameters of a scan. They are keys of [cloud], too. What it
/// leaves to the service is not in it.
/// @thread reentrant
[[nodiscard]] inline nlohmann::json asked_part(const ClientOptions& options) {
  nlohmann::json part = nlohmann::json::object();
  if (!options.box.empty()) part["box"] = options.box;
  if (!options.box_frame.empty()) part["box_frame"] = options.box_frame;
  if (options.voxel_mm) part["voxel_mm"] = *options.voxel_mm;
  if (options.stride) part["stride"] = *options.stride;
  return part;
}

}  // namespace slsd
