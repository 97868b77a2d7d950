// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdio>  // before jpeglib.h, which needs it
#include <string_view>

#include <jpeglib.h>

namespace slsd {

/// The agreement of a JPEG scan's blocks with its size.
enum class ScanBlocks {
  kAgree,
  kMissing,  ///< data ends before the last block, a code is invalid, or a level is none that a picture has
  kLeftOver  ///< data goes on with a whole further unit of blocks
};

/// Walks through the Huffman codes of a sequential scan and counts its blocks, restart interval by restart interval.
/// libjpeg says whether data is missing, but not what is left over. Bytes that some cameras put before a marker decode
/// to no unit of blocks; what is left over where data before it was lost does, and then every block after the loss is
/// out of its place.
/// @param info  after jpeg_start_decompress(), of one scan
/// @param data  from the first byte after the scan's header
/// @thread reentrant
[[nodiscard]] ScanBlocks count_blocks(const jpeg_decompress_struct& info, std::string_view data);

}  // namespace slsd
