// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/shipped_patterns.hpp"

namespace slsd {

constexpr ArrayMethod kConstructive = ArrayMethod::kConstructive;

std::vector<ShippedPattern> shipped_patterns() {
  return {{"paper-1", {.symbols = {5, 7, 22}, .method = ArrayMethod::kPaper}},
          {"paper-2", {.symbols = {25, 7, 22}, .method = ArrayMethod::kPaper}},
          {"16px-5", {.symbol_size_px = 16, .symbols = {11, 13, 14, 18, 19}, .method = kConstructive}},
          {"14px-5", {.symbol_size_px = 14, .symbols = {11, 13, 14, 16, 24}, .method = kConstructive}},
          {"12px-6", {.symbol_size_px = 12, .method = kConstructive}},
          {"10px-6", {.symbol_size_px = 10, .method = kConstructive}},
          {"8px-6", {.symbol_size_px = 8, .method = kConstructive}},
          {"8px-6-dense", {.symbol_size_px = 8, .spacing_px = 1, .method = kConstructive}},
          {"16px-6-no-repeats", {.symbol_size_px = 16}},
          {"14px-6-no-repeats", {.symbol_size_px = 14}},
          {"12px-6-no-repeats", {.symbol_size_px = 12}},
          {"10px-6-no-repeats", {.symbol_size_px = 10}},
          {"8px-6-no-repeats", {.symbol_size_px = 8}},
          {"8px-6-dense-no-repeats", {.symbol_size_px = 8, .spacing_px = 1}}};
}

}  // namespace slsd
