// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "core/code/pattern.hpp"

namespace slsd {

/// A pattern of config/patterns/.
inline Pattern shipped_pattern(const std::string& name) {
  std::ifstream file(SLSD_SOURCE_DIR "/config/patterns/" + name);
  std::stringstream text;
  text << file.rdbuf();
  auto pattern = read_pattern(text.str(), name);
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.error()));
  return pattern.value();
}

}  // namespace slsd
