// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/result.hpp"
#include "tests/adversary/margin_table.hpp"
#include "tests/adversary/misled.hpp"
#include "tests/adversary/report_table.hpp"

namespace slsd::adversary {

/// Decodes frames of scenes, and prints a row for each kind.
/// @param readers  for 16 and for 8 px
/// @param margins  in and out: adds the points
/// @return         all of them
/// @errors as Decoder::decode()
[[nodiscard]] Result<Row> report_scenes(std::vector<Misled>& readers, const ReportOptions& options,
                                        MarginTable& margins);

}  // namespace slsd::adversary
