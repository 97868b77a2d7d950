// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/black_box.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>

#include "drivers/camera/frame_image.hpp"

namespace slsd {
namespace {

constexpr std::size_t kScansMax = 256;
constexpr std::size_t kScanBytes = 2048;  // an upper bound of a kept scan's size without frames and points

std::size_t bytes_of(const Frame& frame) {
  return std::visit(
      []<class T>(const ImageView<T>& image) {
        return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * sizeof(T);
      },
      frame.image());
}

// Leaves out of a kept result another client's pictures, and all data as large as frames. The result itself is only
// borrowed: a full copy would cost more than decoding a small frame.
ScanResult without_pictures(ScanResult& result) {
  auto dense = std::exchange(result.dense, nullptr);
  auto files = std::exchange(result.files, {});
  auto frames = std::exchange(result.frames, {});
  auto picture = std::exchange(result.picture_png, {});
  ScanResult kept = result;
  kept.cloud.coloured = false;  // the kept frames are grey, and a replay gives the same file
  result.dense = std::move(dense), result.files = std::move(files);
  result.frames = std::move(frames), result.picture_png = std::move(picture);
  return kept;
}

// What belongs to the cameras that measure.
std::vector<std::string> measuring(std::vector<std::string> of_cameras, const ScanSetup& setup) {
  of_cameras.resize(std::min(of_cameras.size(), setup.measuring_cameras()));
  return of_cameras;
}

bool same_failure(const KeptScan& scan, const Error& error) {
  if (scan.frames || scan.too_large || !scan.outcome || *scan.outcome) return false;
  const Error& before = scan.outcome->error();
  return before.code == error.code && before.where == error.where;
}

}  // namespace

std::size_t BlackBox::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::vector<KeptScan> BlackBox::scans() const {
  const std::lock_guard lock(mutex_);
  std::vector<KeptScan> scans;
  std::ranges::transform(entries_, std::back_inserter(scans), &Entry::scan);
  return scans;
}

// Searches from the newest: the scan is one of the last.
BlackBox::Entry* BlackBox::find(const std::string& id) {
  const auto found = std::find_if(entries_.rbegin(), entries_.rend(), [&](const Entry& e) { return e.scan.id == id; });
  return found == entries_.rend() ? nullptr : &*found;
}

BlackBox::Entry& BlackBox::find_or_begin(const std::string& id, const SharedSetup& setup) {
  Entry* entry = find(id);
  if (entry == nullptr) {
    entry = &entries_.emplace_back();
    entry->scan.id = id;
    entry->scan.time = std::chrono::system_clock::now();
    grow(*entry, kScanBytes);
  }
  if (!entry->scan.settings && setup) entry->scan.settings = settings_of(setup);
  return *entry;
}

std::shared_ptr<const KeptSettings> BlackBox::settings_of(const SharedSetup& setup) {
  if (settings_ && setup_.lock() == setup) return settings_;
  setup_ = setup;
  settings_ = std::make_shared<const KeptSettings>(
      KeptSettings{setup->pattern, setup->calibration, setup->decode, measuring(setup->camera_names, *setup),
                   measuring(setup->camera_formats, *setup), setup->cloud, setup->hand_eye});
  return settings_;
}

void BlackBox::grow(Entry& entry, std::size_t bytes) {
  entry.bytes += bytes;
  bytes_ += bytes;
}

// Drops the oldest scans, but never the one with this id.
void BlackBox::make_room(const std::string& id) {
  while (entries_.size() > 1 && (bytes_ > bytes_max_ || entries_.size() > kScansMax)) {
    const std::size_t oldest = entries_.front().scan.id == id ? 1 : 0;
    Entry& entry = entries_[oldest];
    bytes_ -= entry.bytes;
    entry.scan.frames.reset();
    if (entry.frames && entry.frames.use_count() == 1) {
      for (FrameImage& image : *entry.frames) spare_.push_back(std::move(image.bytes));
    }
    entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(oldest));
  }
}

void BlackBox::keep_frames(const std::string& id, const FrameSet& set, const SharedSetup& setup,
                           const ScanRequest& request) {
  std::size_t needed = 0;
  for (const auto* frames : {&set.frames, &set.white, &set.dark}) {
    for (std::size_t i = 0; i < std::min(frames->size(), set.frames.size()); ++i) needed += bytes_of((*frames)[i]);
  }
  std::vector<std::string> memory;
  {
    const std::lock_guard lock(mutex_);
    Entry& entry = find_or_begin(id, setup);
    entry.scan.density = request.formats.dense() ? Density::kPixels : Density::kSymbols;
    entry.scan.part = request.part.value_or(setup->cloud);
    if (entry.scan.part.in_base()) entry.scan.base_from_rig = setup->base_from_rig(request.base_from_flange);
    entry.scan.too_large = needed + kScanBytes > bytes_max_;
    if (entry.scan.too_large) return make_room(id);
    grow(entry, needed);
    make_room(id);
    memory = std::exchange(spare_, {});
  }
  // Copied without the lock, so that nobody waits for it.
  auto kept = std::make_shared<KeptFrames>();
  const auto keep = [&](const std::vector<Frame>& frames, Picture light) {
    for (std::size_t i = 0; i < std::min(frames.size(), set.frames.size()); ++i) {
      const auto fits = std::ranges::find(memory, bytes_of(frames[i]), &std::string::size);
      FrameImage& image = kept->emplace_back();
      if (fits != memory.end()) image.bytes = std::exchange(*fits, {});
      copy_raw(frames[i], image);
      image.camera = i < setup->camera_names.size() ? setup->camera_names[i] : std::string();
      image.light = light;
    }
  };
  keep(set.frames, Picture::kPattern), keep(set.white, Picture::kWhite), keep(set.dark, Picture::kBlack);
  const std::lock_guard lock(mutex_);
  if (Entry* entry = find(id)) entry->frames = kept, entry->scan.frames = kept;
}

void BlackBox::keep_outcome(const std::string& id, const SharedSetup& setup, Result<ScanResult>& result) {
  auto outcome = std::make_shared<const Result<ScanResult>>(result ? Result<ScanResult>(without_pictures(*result))
                                                                   : tl::unexpected(result.error()));
  const std::lock_guard lock(mutex_);
  if (!result && find(id) == nullptr && !entries_.empty() && same_failure(entries_.back().scan, result.error())) {
    ++entries_.back().scan.times;
    return;
  }
  Entry& entry = find_or_begin(id, setup);
  entry.scan.outcome = std::move(outcome);
  if (result) {
    const ScanResult& kept = entry.scan.outcome->value();
    grow(entry, (kept.cloud.points.size() + result->strays.size()) * sizeof(CloudPoint) +
                    kept.reasons.size() * sizeof(RegionReason));
    entry.scan.density = result->dense ? Density::kPixels : Density::kSymbols;
  }
  make_room(id);
}

}  // namespace slsd
