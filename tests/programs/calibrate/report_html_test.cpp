// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/report/report_html.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <gmock/gmock.h>

#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Of two cameras; made once.
const CalibrationOutcome& an_outcome() {
  static const CalibrationOutcome made = [] {
    auto outcome = calibrate(see(true_rig(2), true_poses(8)), {});
    if (!outcome) throw std::runtime_error(to_string(outcome.error()));
    outcome->calibration.report.board = "charuco:11x7:60:45:DICT_5X5_1000";
    return std::move(*outcome);
  }();
  return made;
}

std::size_t count_of(const std::string& text, std::string_view what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// Tags that are opened and those that are closed.
void expect_balanced(const std::string& html) {
  for (const std::string tag :
       {"table", "tr", "td", "svg", "figure", "text", "ul", "li", "span", "p", "body", "html"}) {
    EXPECT_EQ(count_of(html, "<" + tag + ">") + count_of(html, "<" + tag + " "), count_of(html, "</" + tag + ">"))
        << tag;
  }
}

TEST(ReportHtml, HasEveryDevicePoseAndParameter) {
  const CalibrationOutcome& outcome = an_outcome();
  const std::string html = report_html(outcome);
  expect_balanced(html);
  EXPECT_EQ(count_of(html, "<svg"), 10U);  // coverage and residuals of three devices, poses twice, board, depth
  EXPECT_THAT(html, HasSubstr("charuco:11x7:60:45"));
  EXPECT_THAT(html, HasSubstr("class='grade " + std::string(to_string(outcome.verdict.grade))));
  for (const PoseReport& pose : outcome.poses) EXPECT_THAT(html, HasSubstr("</span> " + pose.name + "</td>"));
  for (const NamedCamera& camera : outcome.observations.cameras) EXPECT_THAT(html, HasSubstr(">" + camera.name + "<"));
  EXPECT_EQ(count_of(html, "<td>projector</td>"),
            std::ranges::count(outcome.parameters, "projector", &ParameterReport::device));
  EXPECT_LT(html.size(), 3'000'000U);
}

TEST(ReportHtml, SaysWhyASessionWasRefused) {
  PoseReport pose;
  pose.name = "pose_<3>", pose.fault = PoseFault::kBlurred, pose.reason = "blurred & dark";
  const std::string html = refusal_html("all poses are parallel", {pose});
  expect_balanced(html);
  EXPECT_THAT(html, HasSubstr("not put in force"));
  EXPECT_THAT(html, HasSubstr("all poses are parallel"));
  EXPECT_THAT(html, HasSubstr("pose_&lt;3&gt;"));
  EXPECT_THAT(html, HasSubstr("blurred &amp; dark"));
  EXPECT_THAT(report_html(an_outcome(), "it is bad"), HasSubstr("it is bad"));
}

TEST(ReportHtml, ShowsTheBoardsShape) {
  CalibrationOutcome outcome = an_outcome();
  outcome.board.bend_mm = 0.52, outcome.board.bend_sigma_mm = 0.02;
  EXPECT_THAT(report_html(outcome), HasSubstr("bent by 0.52 +- 0.02 mm over its"));
  EXPECT_THAT(report_html(outcome), HasSubstr("The board's shape from the front"));
}

TEST(ReportHtml, ShowsWhatTheReferencePlaneSays) {
  EXPECT_THAT(report_html(an_outcome()), Not(HasSubstr("Reference plane")));
  CalibrationOutcome outcome = an_outcome();
  ViewCheck check;
  check.plane_rms_mm = 0.321, check.plane_sigma_mm = 0.3;
  check.trueness = Trueness{50, -0.045, 0.06, 0.1};
  outcome.planes = {{"plane_00", "camera0", check, check}, {"plane_01", "camera0", check, std::nullopt}};
  const std::string html = report_html(outcome);
  expect_balanced(html);
  EXPECT_THAT(html, HasSubstr("<tr><td>plane_01 camera0</td><td>0.321</td><td>0.300</td><td>-0.045</td><td>0.060</td>"
                              "<td colspan='4'>not measured</td></tr>"));
}

TEST(ReportHtml, NamesSizesUnitsGoalsAndTheProgram) {
  const std::string html = report_html(an_outcome());
  EXPECT_THAT(html, HasSubstr("projector, 1280 x 800 px"));
  EXPECT_THAT(html, HasSubstr("slsd " SLSD_VERSION));
  EXPECT_THAT(html, HasSubstr("up to 0.3 px"));
  EXPECT_THAT(html, HasSubstr("50 % are good"));
  EXPECT_THAT(html, HasSubstr("Good up to 0.1 % of the distance"));
  EXPECT_EQ(count_of(html, "<td class='words'>px</td>"), 12U);  // fx, fy, cx, cy of three devices
  EXPECT_EQ(count_of(html, "<td class='words'>mm</td>"), 6U);   // where the projector and the second camera are
  EXPECT_EQ(count_of(html, "<td class='words'>rad</td>"), 6U);
}

TEST(ReportHtml, FitsANarrowScreen) {
  const std::string html = report_html(an_outcome());
  EXPECT_THAT(html, HasSubstr("name='viewport'"));
  EXPECT_EQ(count_of(html, "<table>"), count_of(html, "<div class='wide'><table>"));
}

TEST(ReportHtml, StandsByItself) {
  const std::string html = report_html(an_outcome());
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(ReportHtml, SaysWhyAPoseWasLeftOut) {
  CalibrationOutcome outcome = an_outcome();
  PoseReport& refused = outcome.poses.emplace_back();
  refused.name = "pose_<b>";
  refused.fault = PoseFault::kBlurred;
  refused.reason = "blurred & dim";
  const std::string html = report_html(outcome);
  EXPECT_THAT(html, HasSubstr("<tr class='out'><td>pose_&lt;b&gt;</td>"));
  EXPECT_THAT(html, HasSubstr("left out: blurred &amp; dim"));
  expect_balanced(html);
}

// As the terminal does.
TEST(ReportHtml, SaysWhatIsToBeRemarkedOfAPoseThatWasUsed) {
  CalibrationOutcome outcome = an_outcome();
  outcome.poses[2].remarks = {"covered: 147 symbols are missing in one place"};
  outcome.poses[3].without = {"camera left: cut off"};
  outcome.poses[3].outlying_corners = 2, outcome.poses[3].outlying_symbols = 5;
  const std::string html = report_html(outcome);
  expect_balanced(html);
  EXPECT_THAT(html, HasSubstr("covered: 147 symbols are missing in one place"));
  EXPECT_THAT(html, HasSubstr("without camera left: cut off"));
  EXPECT_THAT(html, HasSubstr("<td>7</td></tr>"));
}

TEST(ReportHtml, NamesTheOneCameraOnce) {
  CalibrationOutcome outcome = an_outcome();
  EXPECT_THAT(report_html(outcome), HasSubstr("<figcaption>camera camera0: points"));
  for (PoseObservation& pose : outcome.observations.poses) {
    std::erase_if(pose.views, [](const PoseView& view) { return view.camera > 0; });
  }
  outcome.observations.cameras.resize(1), outcome.calibration.cameras.resize(1), outcome.rig.cameras.resize(1);
  outcome.observations.cameras[0].name = outcome.calibration.cameras[0].name = "camera";
  const std::string html = report_html(outcome);
  EXPECT_THAT(html, Not(HasSubstr("camera camera")));
  EXPECT_THAT(html, HasSubstr("<figcaption>camera: points"));
}

TEST(ReportHtml, ShowsWhatToShootNext) {
  CalibrationOutcome outcome = an_outcome();
  outcome.verdict = {Grade::kBad, {"too few poses"}, {"show the board in the upper left"}};
  outcome.depth.clear();
  const std::string html = report_html(outcome);
  EXPECT_THAT(html, HasSubstr("<span class='grade bad'>bad</span>"));
  EXPECT_THAT(html, HasSubstr("<li>show the board in the upper left</li>"));
  EXPECT_THAT(html, Not(HasSubstr("Uncertainty of depth")));
}

}  // namespace
}  // namespace slsd
