// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/observe_plane.hpp"

#include "core/exposure/divide_light.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> nothing_seen() {
  return fail(ErrorCode::kNotFound,
              "the projected code cannot be read; light the plane with the projector, in focus, without clipping");
}

}  // namespace

Result<PoseView> observe_plane(const GreyView& pattern, const std::optional<GreyView>& white, PatternReader& reader) {
  Grey16 levelled;
  if (white) {
    auto divided = divide_light(pattern, *white);
    if (!divided) return tl::unexpected(divided.error());
    levelled = std::move(*divided);
  }
  const auto matches = reader.read(white ? GreyView(levelled.view()) : pattern);
  if (!matches) return tl::unexpected(matches.error());
  PoseView view;
  for (const SymbolMatch& match : *matches) {
    view.symbols.push_back({match.camera_px, match.projector_px, match.sigma_px});
  }
  if (view.symbols.empty()) return nothing_seen();
  return view;
}

Result<PoseView> observe_plane(const GrayCapture& capture, const ImageSize& projector) {
  auto points = read_gray_code(capture, projector, [](int, int) { return true; });
  if (!points) return tl::unexpected(points.error());
  PoseView view;
  view.symbols = std::move(*points);
  if (view.symbols.empty()) return nothing_seen();
  return view;
}

}  // namespace slsd
