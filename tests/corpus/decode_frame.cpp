// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdio>
#include <fstream>
#include <string>

#include "core/calibration_file/calibration_file.hpp"
#include "core/cloud/ply.hpp"
#include "core/decode/decoder.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/corpus/read_with.hpp"

namespace slsd {
namespace {

struct Arguments {
  std::string pattern, calibration, frame, cloud;
};

Result<> decode_frame(const Arguments& files, const DecodeOptions& options) {
  const auto pattern = read_with(read_pattern, files.pattern);
  if (!pattern) return tl::unexpected(pattern.error());
  const auto calibration = read_with(read_calibration, files.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto frame = read_image(files.frame);
  if (!frame) return tl::unexpected(frame.error());
  auto decoder = Decoder::create(*pattern, *calibration, 0, options);
  if (!decoder) return tl::unexpected(decoder.error());
  const auto decoding = decoder->decode(view(*frame));
  if (!decoding) return tl::unexpected(decoding.error());
  Cloud cloud;
  cloud.points = (*decoding)->points;
  std::ofstream out(files.cloud, std::ios::binary);
  out << write_ply(cloud);
  return {};
}

}  // namespace
}  // namespace slsd

int main(int argc, char** argv) {
  const bool fine = argc == 6 && std::string_view(argv[5]) == "--fine";
  if (argc != 5 && !fine) {
    std::fputs("usage: decode-frame PATTERN.toml CALIBRATION.yml FRAME.png CLOUD.ply [--fine]\n", stderr);
    return 2;
  }
  slsd::DecodeOptions options;
  if (fine) options.precision = slsd::Precision::kFine;
  const auto done = slsd::decode_frame({argv[1], argv[2], argv[3], argv[4]}, options);
  if (!done) std::fprintf(stderr, "decode-frame: %s\n", slsd::to_string(done.error()).c_str());
  return done ? 0 : 1;
}
