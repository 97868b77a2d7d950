// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "docs/tables/alphabet_tables.hpp"

namespace slsd {
namespace {

// What the decoder finds moves with it; ./run tables writes the document anew.
TEST(AlphabetDocument, EndsWithTheDescriptorsThatTheDecoderFinds) {
  std::ifstream stream(SLSD_SOURCE_DIR "/docs/alphabet.md", std::ios::binary);
  const std::string document{std::istreambuf_iterator<char>(stream), {}};
  const std::string section = descriptor_section();
  ASSERT_GE(document.size(), section.size());
  EXPECT_TRUE(document.ends_with(section)) << "docs/alphabet.md is not what ./run tables writes";
}

}  // namespace
}  // namespace slsd
