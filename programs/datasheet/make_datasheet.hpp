// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "clients/usage/datasheet_usage.hpp"
#include "core/result.hpp"

namespace slsd {

/// Measures what is missing in the folder, place by place, as the user confirms each at the terminal. Evaluates all its
/// clouds, prints the figures, and writes the sheet.
/// @errors kNotFound: no service, no artefact in a cloud, or no cloud at all; kMalformed: a file of the folder is no
/// dense cloud;
///         kCancelled: the input ended before all places were measured; kIo
[[nodiscard]] Result<> make_datasheet(const DatasheetRequest& request);

}  // namespace slsd
