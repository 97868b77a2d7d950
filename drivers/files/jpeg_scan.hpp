// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdio>  // before jpeglib.h, which needs it
#include <string_view>

#include <jpeglib.h>

namespace slsd {

/// Comparison of a JPEG scan's blocks with its size.
enum class ScanBlocks {
  kAgree,
  kMissing,  ///< data ends before the last block, a code is invalid, or a level is outside any picture's range
  kLeftOver  ///< data continues with at least one more unit of blocks
};

/// Decodes the Huffman codes of a sequential scan and counts its blocks in each restart interval. libjpeg reports
/// missing data, but not surplus data. Bytes that some cameras insert before a marker form no unit of blocks. Surplus
/// data after a loss does form units, and then every block after the loss is displaced.
/// @param info  after jpeg_start_decompress(), with one scan
/// @param data  from the first byte after the scan's header
/// @thread reentrant
[[nodiscard]] ScanBlocks count_blocks(const jpeg_decompress_struct& info, std::string_view data);

}  // namespace slsd
