// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// The pattern that the configuration asks for: made anew, or read from its file.
/// @errors of make_pattern(), read_file() and read_pattern(); kMismatch: not of the projector's size
[[nodiscard]] Result<Pattern> configured_pattern(const Configuration& configuration);

/// What is risky about the pattern's choice of symbols, a sentence each; nothing where nothing is. Takes a part of a
/// second of computing.
[[nodiscard]] std::vector<std::string> symbol_warnings(const PatternOptions& pattern);

/// The calibration that the configuration names; empty where it names none.
/// @errors of read_file() and read_calibration(); kMismatch: not of this projector's size, or without one of the
/// cameras
[[nodiscard]] Result<std::optional<Calibration>> configured_calibration(const Configuration& configuration);

/// Everything about a scan that a reload replaces at once.
/// @thread thread-bound
struct ScanSetup {
  Pattern pattern;
  Grey8 image;  ///< what the projector shows
  std::optional<Calibration> calibration;
  std::vector<Decoder> decoders;  ///< one to a configured camera; none without a calibration

  /// @errors of the two above; of Decoder::create()
  [[nodiscard]] static Result<ScanSetup> create(const Configuration& configuration);
};

}  // namespace slsd
