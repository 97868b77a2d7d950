// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decoder.hpp"

#include "core/decode/pipeline.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/image_size.hpp"

namespace slsd {
Decoder::Decoder(std::unique_ptr<Pipeline> pipeline) : pipeline_(std::move(pipeline)) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<Decoder> Decoder::create(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                                const DecodeOptions& options) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (camera_index >= calibration.cameras.size()) {
    return fail(ErrorCode::kInvalidArgument, "the calibration has no camera " + std::to_string(camera_index));
  }
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  if (auto fits = check_image_size(camera.lens.width_px, camera.lens.height_px); !fits) {
    return fail(fits.error().code, fits.error().message, "camera " + camera.name);
  }
  const Lens& projector = calibration.projector;
  if (projector.width_px != pattern.options.projector_width_px ||
      projector.height_px != pattern.options.projector_height_px) {
    return fail(ErrorCode::kMismatch,
                "the calibration is of a projector of " + size_text(projector.width_px, projector.height_px) +
                    " pixels, the pattern is for " +
                    size_text(pattern.options.projector_width_px, pattern.options.projector_height_px) +
                    "; calibrate with this projector, or set the projector's size to the calibrated one");
  }
  std::optional<PaperWay> paper;
  if (options.any_paper()) {
    auto created = PaperWay::create(pattern);
    if (!created) return tl::unexpected(created.error());
    paper = std::move(*created);
  }
  return Decoder(std::make_unique<Pipeline>(pattern, calibration, camera_index, options, std::move(paper)));
}

Decoder Decoder::another() const {
  return Decoder(std::make_unique<Pipeline>(*pipeline_));
}

std::uint8_t Decoder::camera_index() const {
  return pipeline_->camera_index();
}

Result<> Decoder::check_size(const GreyView& frame) const {
  const auto [width, height] = std::visit([](const auto& view) { return std::pair(view.width, view.height); }, frame);
  const Lens& lens = pipeline_->camera_lens();
  if (width == lens.width_px && height == lens.height_px) return {};
  return fail(ErrorCode::kMismatch, "the frame has " + size_text(width, height) +
                                        " pixels, the camera was calibrated with " +
                                        size_text(lens.width_px, lens.height_px) +
                                        "; set the camera to the calibrated size, or calibrate again");
}

Result<const Decoding*> Decoder::decode(const GreyView& frame, std::optional<double> full, StageObserver* observer) {
  if (auto same = check_size(frame); !same) return tl::unexpected(same.error());
  return &pipeline_->decode(frame, full ? *full : guess_full_level(frame), observer);
}

Result<std::vector<SymbolMatch>> Decoder::read_anywhere(const GreyView& frame, std::optional<double> full) {
  if (auto same = check_size(frame); !same) return tl::unexpected(same.error());
  return pipeline_->read_anywhere(frame, full ? *full : guess_full_level(frame));
}

}  // namespace slsd
