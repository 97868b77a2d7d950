// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/progress/progress.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "drivers/files/file.hpp"
#include "rpc/message.hpp"

namespace slsd::model {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr std::size_t kMostAtTheEnd = 120'000;
constexpr int kShareOfTime = 10;  // previews take at most one part in so many

double tenths(double degrees) {
  return std::round(10 * degrees) / 10;
}

}  // namespace

void Progress::print(const json& line) {
  if (!lines_) return;
  std::fputs(to_line(line).c_str(), stdout);
  std::fflush(stdout);
}

void Progress::say(const std::string& sentence) {
  std::fprintf(stderr, "slsd-model: %s\n", sentence.c_str());
  print({{"message", sentence}});
}

void Progress::write_preview(const PreviewPoints& points) {
  const auto begin = Clock::now();
  if (auto written = write_file_atomically(file_, points.to_ply()); !written) {
    say("no more previews: " + to_string(written.error()));
    file_.clear();
    return;
  }
  const auto end = Clock::now();
  next_preview_ = end + kShareOfTime * (end - begin);
}

void Progress::add_cloud(const ModelBuilder& builder, const SeenSides& sides, const std::string& left_out) {
  ++clouds_;
  if (!file_.empty()) {
    for (; added_ < builder.placed(); ++added_) {
      const ModelFrame& frame = builder.frames()[added_];
      points_.add(frame.shot, frame.object_from_rig);
    }
    if (previewed_ < added_ && Clock::now() >= next_preview_) {
      write_preview(points_);
      previewed_ = added_;
    }
  }
  if (!lines_) return;
  json told{{"clouds", clouds_},
            {"placed", builder.placed()},
            {"seen_degrees", tenths(sides.seen_degrees)},
            {"missing_from_degrees", tenths(sides.gap_begins_degrees)},
            {"missing_degrees", tenths(sides.gap_degrees)},
            {"seen_from_all_sides", sides.all()},
            {"views_degrees", json::array()},
            {"previewed", previewed_}};
  for (const double view : sides.views_degrees) told["views_degrees"].push_back(tenths(view));
  if (!left_out.empty()) told["left_out"] = left_out;
  print({{"progress", std::move(told)}});
}

void Progress::build(std::size_t done, std::size_t clouds) {
  if (done == 0 && !file_.empty() && previewed_ < added_) {
    write_preview(points_);
    previewed_ = added_;
  }
  print({{"building", {{"fused", done}, {"of", clouds}, {"previewed", previewed_}}}});
}

void Progress::finish(const Mesh& mesh) {
  if (file_.empty()) return;
  PreviewPoints points(kMostAtTheEnd);
  points.add(mesh);
  write_preview(points);
}

bool Progress::report(json report) {
  print({{"report", std::move(report)}});
  return std::ferror(stdout) == 0;
}

int Progress::fail(const Error& error) {
  const std::string text = to_string(error);
  std::fprintf(stderr, "slsd-model: %s\n", text.c_str());
  print({{"error", {{"name", to_string(error.code)}, {"message", text}}}});
  return 1;
}

}  // namespace slsd::model
