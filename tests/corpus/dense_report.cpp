// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core/utility.hpp>

#include "core/calibration_file/calibration_file.hpp"
#include "core/dense/cloud/dense_cloud.hpp"
#include "core/dense/dense_mapper.hpp"
#include "core/exposure/light_levels.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/corpus/dense_others.hpp"
#include "tests/corpus/dense_score.hpp"
#include "tests/corpus/dense_steps.hpp"
#include "tests/corpus/read_with.hpp"

namespace slsd {
namespace {

/// Of this thread's CPU: others on the machine do not count.
struct Clock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<Clock>;
  static constexpr bool is_steady = true;
  static time_point now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time_point(std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec));
  }
};

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

class StageTimes final : public DenseObserver {
 public:
  void stage_done(DenseStage stage) override {
    ms[static_cast<std::size_t>(stage)] = ms_since(last_);
    last_ = Clock::now();
  }
  void start() { last_ = Clock::now(); }
  std::array<double, kDenseStageCount> ms{};

 private:
  Clock::time_point last_;
};

/// Turns the calibration wrong: the projector's image by so many px across the epipolar line in the frame's middle.
void move_across(Calibration& calibration, double px) {
  const CalibratedCamera& camera = calibration.cameras[0];
  const Eigen::Vector3d ray =
      camera.lens.undistort({0.5 * camera.lens.width_px, 0.5 * camera.lens.height_px}).homogeneous();
  const auto pixel = [&](double depth_mm) {
    const Eigen::Vector3d point =
        camera.projector_from_camera.rotation * (depth_mm * ray) + camera.projector_from_camera.translation;
    return calibration.projector.distort(point.head<2>() / point.z());
  };
  const Eigen::Vector2d along = (pixel(1990) - pixel(2010)).normalized();
  calibration.projector.cx -= px * along.y(), calibration.projector.cy += px * along.x();
}

/// The same figures of what others make of the frame.
void report_other(const char* name, const DepthMap& depths, double ms, const DenseTruth& truth,
                  const Calibration& calibration) {
  const std::vector<float> sigma_mm(depths.size(), 1);
  const DenseScore s = score_dense(truth, calibration, depths, sigma_mm);
  std::printf("  %-22s       %5.1f  %.3f %.3f  %.2f %.2f  %5.2f %5.2f %5.2f              ", name, 100 * s.complete,
              s.median_px, s.rms_px, s.median_mm, s.rms_mm, 100 * s.gross, 100 * s.unlit, 100 * s.unlit_far);
  for (const auto& edge : s.edges) std::printf(" %2.0f/%.1f", 100 * edge.complete, 100 * edge.gross);
  std::printf("  %4.0f\n", ms);
}

/// A picture of the steps, of a part of the frame.
struct Steps {
  std::string file;  ///< empty: none
  FramePart part{};
};

Result<> report(const Pattern& pattern, const std::string& folder, const DenseOptions& options, double offset_px,
                bool compare, const Steps& steps, const std::string& clouds) {
  auto calibration = read_with(read_calibration, folder + "/calibration.yml");
  if (!calibration) return tl::unexpected(calibration.error());
  const Calibration true_calibration = *calibration;
  move_across(*calibration, offset_px);
  const auto frame = read_image(folder + "/frame.png");
  if (!frame) return tl::unexpected(frame.error());
  const auto truth = read_dense_truth(folder);
  if (!truth) return tl::unexpected(truth.error());
  DecodeOptions decode;
  decode.dense = options;
  auto decoder = Decoder::create(pattern, *calibration, 0, decode);
  if (!decoder) return tl::unexpected(decoder.error());
  const double full = guess_full_level(view(*frame));
  const auto decoding = decoder->decode(view(*frame), full);
  if (!decoding) return tl::unexpected(decoding.error());
  DenseMapper mapper(pattern, *calibration, 0, decode);
  SerialExecutor executor;
  StageTimes times;
  (void)mapper.measure(view(*frame), full, decoder->symbols(), executor);
  times.start();
  const auto begin = Clock::now();
  DenseMap& map = mapper.measure(view(*frame), full, decoder->symbols(), executor, &times);
  const double total_ms = ms_since(begin);
  const DenseScore s = score_dense(*truth, true_calibration, map.depth_mm, map.sigma_mm);
  const auto slash = folder.find_last_of('/');
  std::printf("%-24s %5zu %5.1f  %.3f %.3f  %.2f %.2f  %5.2f %5.2f %5.2f  %4.2f %5.2f ",
              folder.substr(slash + 1).c_str(), (*decoding)->points.size(), 100 * s.complete, s.median_px, s.rms_px,
              s.median_mm, s.rms_mm, 100 * s.gross, 100 * s.unlit, 100 * s.unlit_far, s.error_over_sigma,
              100 * s.beyond_three);
  for (const auto& edge : s.edges) std::printf(" %2.0f/%.1f", 100 * edge.complete, 100 * edge.gross);
  std::printf("  %4.0f:", total_ms);
  for (const double ms : times.ms) std::printf(" %.0f", ms);
  std::printf("  %.2f %+.2f", static_cast<double>(mapper.blur_sigma_px()),
              static_cast<double>(mapper.epipolar_offset_px()));
  for (int i = 1; i < kDensePixelCount; ++i) std::printf(" %.1f", 100.0 * map.counts[i] / static_cast<double>(s.lit));
  std::printf("\n");
  if (!steps.file.empty()) {
    const auto png = encode_png(draw_dense_steps(view(*frame), mapper, map, steps.part));
    if (!png) return tl::unexpected(png.error());
    if (auto written = write_file_atomically(steps.file, *png); !written) return written;
  }
  if (!clouds.empty()) {
    DenseCloud cloud;
    DenseView& seen = cloud.views.emplace_back();
    std::swap(seen.map, map);
    seen.rays = mapper.rays();
    const std::string file = clouds + "/" + folder.substr(slash + 1) + ".tiff";
    if (auto written = write_file_atomically(file, write_dense_tiff(cloud)); !written) return written;
  }
  if (!compare) return {};
  const std::vector<CloudPoint> points = (*decoding)->points;
  auto other_begin = Clock::now();
  const DepthMap matched = match_semi_global(view(*frame), full, pattern, *calibration, points);
  report_other("StereoSGBM", matched, ms_since(other_begin), *truth, true_calibration);
  other_begin = Clock::now();
  const DepthMap joined = join_by_triangles(pattern, *calibration, points);
  report_other("triangles of centres", joined, ms_since(other_begin), *truth, true_calibration);
  return {};
}

}  // namespace
}  // namespace slsd

int main(int argc, char** argv) {
  using namespace slsd;
  cv::setNumThreads(1);  // the times are those of one core
  DenseOptions options;
  double offset_px = 0;
  bool compare = false;
  Steps steps;
  std::string pattern_file, clouds;
  std::vector<std::string> folders;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--stride") == 0 && i + 1 < argc)
      options.stride_px = std::atoi(argv[++i]);
    else if (std::strcmp(argv[i], "--prune") == 0 && i + 1 < argc)
      options.prune_px = std::atof(argv[++i]);
    else if (std::strcmp(argv[i], "--offset") == 0 && i + 1 < argc)
      offset_px = std::atof(argv[++i]);
    else if (std::strcmp(argv[i], "--compare") == 0)
      compare = true;
    else if (std::strcmp(argv[i], "--clouds") == 0 && i + 1 < argc)
      clouds = argv[++i];
    else if (std::strcmp(argv[i], "--steps") == 0 && i + 2 < argc) {
      steps.file = argv[++i];
      FramePart& part = steps.part;
      if (std::sscanf(argv[++i], "%d,%d,%d,%d", &part.left, &part.top, &part.width, &part.height) != 4) folders.clear();
    } else if (pattern_file.empty())
      pattern_file = argv[i];
    else
      folders.emplace_back(argv[i]);
  }
  if (folders.empty()) {
    std::fputs(
        "usage: dense-report PATTERN.toml FOLDER... [--stride PX] [--prune PX] [--offset PX] [--compare] [--clouds "
        "FOLDER] [--steps FILE.png LEFT,TOP,WIDTH,HEIGHT]\n",
        stderr);
    return 2;
  }
  const auto pattern = read_with(read_pattern, pattern_file);
  if (!pattern) return std::fprintf(stderr, "dense-report: %s\n", to_string(pattern.error()).c_str()), 1;
  std::printf(
      "scene                    seeds compl med px rms px  mm med rms  gross unlit   far  err/s  >3   edges 0-2 2-4 "
      "4-6 6- (complete/gross %%)  ms: blur grow search fuse judge clean  blur off  reasons %%\n");
  for (const std::string& folder : folders) {
    const auto done = report(*pattern, folder, options, offset_px, compare, steps, clouds);
    if (!done) std::fprintf(stderr, "dense-report: %s: %s\n", folder.c_str(), to_string(done.error()).c_str());
  }
  return 0;
}
