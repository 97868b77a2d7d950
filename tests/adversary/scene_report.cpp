// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/scene_report.hpp"

#include "tests/adversary/scenes/scene_frames.hpp"

namespace slsd::adversary {

Result<Row> report_scenes(std::vector<Misled>& readers, const ReportOptions& options, MarginTable& margins) {
  std::vector<SceneFrameMaker> makers;
  for (const Misled& reader : readers) makers.emplace_back(reader.maker.pattern(), reader.maker.calibration());
  Row all{.in_the_air = 0};
  for (const int index : drawn_scene_kinds(options)) {
    Row row{.in_the_air = 0};
    for (int number = options.first; number < options.first + options.frames_of_a_kind; ++number) {
      const auto size = static_cast<std::size_t>(number) % readers.size();
      const SceneFrame frame = makers[size].make(index, static_cast<std::uint32_t>(number), options.clean);
      Decoder& decoder = readers[size].decoders[static_cast<std::size_t>(number) / readers.size() % 3];
      const auto decoding = decoder.decode(frame.image.view(), 255);
      if (!decoding) return tl::unexpected(decoding.error());
      const SceneVerdict verdict = makers[size].judge(frame.truth, (*decoding)->points);
      row.add({1, verdict.wrong > 0, verdict.wrong, 0, verdict.right, verdict.decoded, verdict.visible,
               verdict.in_the_air});
      margins.add(**decoding, verdict.wrong_points);
      tell(options, number_of_scene_kind(index), number, frame.image, **decoding, verdict.wrong_points);
    }
    print(scene_kinds()[static_cast<std::size_t>(index)].name, row);
    all.add(row);
  }
  return all;
}

}  // namespace slsd::adversary
