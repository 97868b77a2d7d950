// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "bench/frame_ring.hpp"
#include "core/decode/decoder.hpp"

namespace slsd {

/// Reading a frame once, from memory rather than from a cache: what no decoder can be faster than.
void register_floor();

/// The least that a decoder made of OpenCV's parts does: a local threshold and labelled regions with their moments. On
/// one core, and on all with OpenCV's own threads.
void register_anchor(FrameRing& ring);

/// Image to points on one core and on all, and each stage of it on one.
/// @param decoder  for the ring's pattern and calibration
void register_decode(FrameRing& ring, Decoder& decoder);

/// A point for each pixel, and each stage of it, on one core and on all.
void register_dense(FrameRing& ring);

}  // namespace slsd
