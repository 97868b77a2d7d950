// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibration_file/calibration_file.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/core/persistence.hpp>

#include "core/geometry/calibration.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

Calibration two_cameras() {
  Calibration rig = paper_rig();
  CalibratedCamera right = rig.cameras[0];
  right.name = "right";
  right.projector_from_camera.translation.x() = 190;
  right.rig_from_camera.translation.x() = 368;
  rig.cameras.push_back(right);
  CalibrationReport& report = rig.report;
  report.reprojection_error_camera_px = 0.11, report.reprojection_error_projector_px = 0.09;
  report.epipolar_error_px = 0.12, report.held_out_error_px = 0.13;
  report.depth_sigma = {{500, 0.1}, {1000, 0.25}, {2000, 1.1}};
  report.verdict = "good";
  report.projector_sigma.assign(9, 0.25), report.camera_sigma = {std::vector<double>(9, 0.5), {}};
  report.board = "charuco 12x9", report.date = "2026-03-01";
  report.corrected = "2026-09-01 the projector turned by 0.100 +- 0.004 degrees";
  report.projector_serial = "P-77", report.camera_serials = {"C-1", "C-2"};
  return rig;
}

std::string replaced(std::string text, const std::string& from, const std::string& to, std::size_t after = 0) {
  const std::size_t place = text.find(from, after);
  EXPECT_NE(place, text.npos) << from;
  return text.replace(place, from.size(), to);
}

// The text with one key taken out: its line, and the lines of its matrix.
std::string without(std::string text, const std::string& key) {
  const std::size_t begin = text.rfind('\n', text.find(key + ":")) + 1;
  std::size_t end = text.find('\n', begin) + 1;
  while (text.compare(end, 3, "   ") == 0 && text.find("rows:", end) < text.find('\n', end)) {
    end = text.find(']', end) + 2;
  }
  return text.erase(begin, end - begin);
}

std::string message_of(const std::string& text) {
  const auto read = read_calibration(text, "calibration.yml");
  return read ? "accepted" : to_string(read.error());
}

void expect_same(const RigidTransform& a, const RigidTransform& b) {
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.translation, b.translation);
}

TEST(ReadCalibration, ReturnsWhatWasWritten) {
  const Calibration written = two_cameras();
  const auto read = read_calibration(write_calibration(written), "calibration.yml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->projector, written.projector);
  ASSERT_EQ(read->cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read->cameras[i].name, written.cameras[i].name);
    EXPECT_EQ(read->cameras[i].lens, written.cameras[i].lens);
    expect_same(read->cameras[i].projector_from_camera, written.cameras[i].projector_from_camera);
    expect_same(read->cameras[i].rig_from_camera, written.cameras[i].rig_from_camera);
  }
  EXPECT_EQ(read->report.reprojection_error_camera_px, 0.11);
  EXPECT_EQ(read->report.reprojection_error_projector_px, 0.09);
  EXPECT_EQ(read->report.epipolar_error_px, 0.12);
  EXPECT_EQ(read->report.held_out_error_px, 0.13);
  EXPECT_EQ(read->report.depth_sigma, written.report.depth_sigma);
  EXPECT_EQ(read->report.verdict, "good");
  EXPECT_EQ(read->report.projector_sigma, written.report.projector_sigma);
  EXPECT_EQ(read->report.camera_sigma, written.report.camera_sigma);
  EXPECT_EQ(read->report.board, "charuco 12x9");
  EXPECT_EQ(read->report.date, "2026-03-01");
  EXPECT_EQ(read->report.corrected, written.report.corrected);
  EXPECT_EQ(read->report.projector_serial, "P-77");
  EXPECT_EQ(read->report.camera_serials, written.report.camera_serials);
}

TEST(ReadCalibration, LoadsWithoutTheReport) {
  const auto read = read_calibration(write_calibration(paper_rig()), "calibration.yml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_FALSE(read->report.date);
  EXPECT_TRUE(read->report.camera_serials.empty());
}

TEST(ReadCalibration, LoadsAFileWrittenByOthers) {
  std::ifstream file(SLSD_SOURCE_DIR "/tests/fuzz/seeds/calibration/plain.yml");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto read = read_calibration(text, "plain.yml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->projector.width_px, 1280);
  EXPECT_EQ(read->cameras[0].lens.distortion[1], 0.25);
  EXPECT_EQ(read->cameras[0].projector_from_camera.translation, Eigen::Vector3d(-180, 0, 5));
}

class RequiredKey : public ::testing::TestWithParam<const char*> {};

TEST_P(RequiredKey, IsNamedWhereItIsMissing) {
  EXPECT_THAT(message_of(without(write_calibration(two_cameras()), GetParam())), HasSubstr(GetParam()));
}

TEST_P(RequiredKey, IsNamedWhereItIsOfAnotherType) {
  const std::string text = write_calibration(two_cameras());
  const std::string key = GetParam();
  const std::size_t begin = text.rfind('\n', text.find(key + ":")) + 1;
  const std::string indent = text.substr(begin, text.find(key, begin) - begin);
  const std::string bare = without(text, key);
  EXPECT_THAT(message_of(bare.substr(0, begin) + indent + key + ": [ 1, 2 ]\n" + bare.substr(begin)), HasSubstr(key));
}

INSTANTIATE_TEST_SUITE_P(ReadCalibration, RequiredKey,
                         ::testing::Values("projector_width", "projector_height", "projector_matrix",
                                           "projector_distortion", "name", "width", "height", "camera_matrix",
                                           "camera_distortion", "R", "T", "rig_from_camera_R", "rig_from_camera_T"),
                         [](const auto& one) { return std::string(one.param); });

TEST(ReadCalibration, NamesTheCamera) {
  Calibration rig = two_cameras();
  rig.cameras[1].lens.fx = -1;
  EXPECT_EQ(
      message_of(write_calibration(rig)),
      "calibration.yml: cameras[1] (right): camera_matrix must have positive focal lengths, in pixels: x points to the "
      "right, y down and z forward");
}

// What a calibration is changed to, and the key that the refusal names.
struct Breakage {
  const char* name;
  const char* key;
  void (*breaks)(Calibration&);
};

class Broken : public ::testing::TestWithParam<Breakage> {};

TEST_P(Broken, IsRefusedByName) {
  Calibration rig = two_cameras();
  GetParam().breaks(rig);
  EXPECT_THAT(message_of(write_calibration(rig)), HasSubstr(GetParam().key));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Breakage kBreakages[] = {
    {"ZeroWidth", "projector_width", [](Calibration& rig) { rig.projector.width_px = 0; }},
    {"NegativeHeight", "cameras[1] (right): height", [](Calibration& rig) { rig.cameras[1].lens.height_px = -5; }},
    {"HugeWidth", "width", [](Calibration& rig) { rig.cameras[0].lens.width_px = 2000000000; }},
    {"WiderThanRunsCanBe", "(left): width must be a whole number from 1 to 32767",
     [](Calibration& rig) { rig.cameras[0].lens.width_px = 32768; }},
    {"HigherThanRunsCanBe", "projector_height must be a whole number from 1 to 32767",
     [](Calibration& rig) { rig.projector.height_px = 32768; }},
    {"TooManyPixels", "(right): height times width must be at most 268435456 pixels; have the camera bin or crop",
     [](Calibration& rig) { rig.cameras[1].lens.width_px = rig.cameras[1].lens.height_px = 20000; }},
    {"ZeroFocalLength", "projector_matrix", [](Calibration& rig) { rig.projector.fy = 0; }},
    {"NanFocalLength", "projector_matrix", [](Calibration& rig) { rig.projector.fx = kNan; }},
    {"InfinitePrincipalPoint", "camera_matrix", [](Calibration& rig) { rig.cameras[0].lens.cx = 1.0 / 0.0; }},
    {"NanDistortion", "camera_distortion", [](Calibration& rig) { rig.cameras[0].lens.distortion[4] = kNan; }},
    {"Folded", "projector_distortion cannot be inverted", [](Calibration& rig) { rig.projector.distortion[0] = -9; }},
    {"Scaled", "(left): R is not a rotation",
     [](Calibration& rig) { rig.cameras[0].projector_from_camera.rotation *= 1.001; }},
    {"Mirrored", "(left): R is not a rotation",
     [](Calibration& rig) { rig.cameras[0].projector_from_camera.rotation.row(0) *= -1; }},
    {"ZeroBaseline", "(left): T is zero",
     [](Calibration& rig) { rig.cameras[0].projector_from_camera.translation.setZero(); }},
    {"NanTranslation", "rig_from_camera_T",
     [](Calibration& rig) { rig.cameras[1].rig_from_camera.translation.x() = kNan; }},
    {"SameName", "cameras[1] (left): name", [](Calibration& rig) { rig.cameras[1].name = "left"; }},
    {"EmptyName", "cameras[1].name", [](Calibration& rig) { rig.cameras[1].name = ""; }},
    {"NoCamera", "cameras", [](Calibration& rig) { rig.cameras.clear(); }},
    {"NanReport", "reprojection_error_camera_px",
     [](Calibration& rig) { rig.report.reprojection_error_camera_px = kNan; }},
    {"LongDate", "date", [](Calibration& rig) { rig.report.date = std::string(300, 'x'); }},
};

INSTANTIATE_TEST_SUITE_P(ReadCalibration, Broken, ::testing::ValuesIn(kBreakages),
                         [](const auto& one) { return one.param.name; });

TEST(ReadCalibration, RefusesSkewAndAWrongLastRow) {
  const std::string text = write_calibration(paper_rig());
  EXPECT_THAT(message_of(replaced(text, "1920., 0., ", "1920., 2., ")),
              HasSubstr("projector_matrix must have no skew"));
  EXPECT_THAT(message_of(replaced(text, "0., 0., 1. ]", "0., 0., 2. ]")),
              HasSubstr("projector_matrix must have 0 0 1"));
}

TEST(ReadCalibration, RefusesAMatrixOfAnotherShape) {
  const std::string text = write_calibration(paper_rig());
  EXPECT_THAT(message_of(replaced(text, "cols: 5", "cols: 4")), HasSubstr("projector_distortion must"));
  EXPECT_THAT(message_of(replaced(text, "rows: 3", "rows: 1000000000")), HasSubstr("projector_matrix must"));
}

TEST(ReadCalibration, RefusesAFirstCameraThatIsNotTheRig) {
  const std::string text = write_calibration(two_cameras());
  const std::size_t begin = text.find("rig_from_camera_R"), end = text.rfind(']') + 2;
  const std::string motion_of_second = text.substr(begin, end - begin) + "      ";
  EXPECT_THAT(message_of(replaced(text, "name:", motion_of_second + "name:")), HasSubstr("first camera"));
}

TEST(ReadCalibration, RefusesRubbishWithItsPlace) {
  EXPECT_THAT(message_of(""), HasSubstr("calibration.yml: holds nothing"));
  EXPECT_THAT(message_of("%YAML:1.0\n---\na: [ 1,\n"), HasSubstr("calibration.yml:4: is not YAML"));
  EXPECT_THAT(message_of("%YAML:1.0\n---\na: [ 1,\n"), HasSubstr("is the file cut short?"));
  EXPECT_THAT(message_of("%YAML:1.0\n---\nprojector_height: 2\ncameras: 3\n"), HasSubstr("projector_width"));
  EXPECT_THAT(message_of("%YAML:1.0\n" + std::string(2 << 20, '\n')), HasSubstr("exceeds 1 MiB"));
}

TEST(ReadCalibration, RefusesWithTheLineWhatIsNoYaml) {
  const std::string begin = "%YAML:1.0\n---\nprojector_width: 1280\n";
  const std::string nul("a: \0", 4);
  for (const std::string& line : {nul, std::string("a: \"\\x\""), std::string("a: - - b"), std::string("a: \"$\" b"),
                                  std::string("a: 'it's'"), std::string("\ta: 1"), std::string("projector_width: 2"),
                                  std::string("a: *nobody"), std::string("[1, 2]: 3"), std::string("---")}) {
    EXPECT_THAT(message_of(begin + line + "\n"), HasSubstr("calibration.yml:4: ")) << line;
  }
}

TEST(ReadCalibration, BoundsWhatAHostileFileCosts) {
  const std::string begin = "%YAML:1.0\n---\n";
  EXPECT_THAT(message_of(begin + "a: " + std::string(900, '[')), HasSubstr("nested too deeply"));
  EXPECT_THAT(message_of(begin + std::string(500'000, '[')), HasSubstr("calibration.yml:3"));
  std::string many = begin + "a: [ 0";
  for (int i = 0; i < 60'000; ++i) many += ", 0";
  EXPECT_THAT(message_of(many + " ]\n"), HasSubstr("calibration.yml:3: holds too many values"));
  std::string laughs = begin + "a0: &a0 [ 0, 0, 0, 0, 0, 0, 0, 0, 0 ]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string name = "a" + std::to_string(i), one = "*a" + std::to_string(i - 1);
    laughs +=
        name + ": &" + name + " [ " + one + ", " + one + ", " + one + ", " + one + ", " + one + ", " + one + " ]\n";
  }
  EXPECT_THAT(message_of(laughs), HasSubstr("holds too many values"));
  std::string keys = begin;
  for (int i = 0; i < 300; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_THAT(message_of(keys), HasSubstr("calibration.yml:259: has too many keys"));
}

// ---- other writers ----

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) text.replace(at, from.size(), to);
}

/// The number lists of a text as other writers have them.
std::string with_lists(const std::string& text, const std::string& open, const std::string& before,
                       const std::string& after, const std::string& close) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find("[ ", at), end = text.find(" ]", at);
    if (begin == text.npos) return result + text.substr(at);
    result += text.substr(at, begin - at) + open;
    std::string numbers = text.substr(begin + 2, end - begin - 2);
    numbers.erase(std::remove_if(numbers.begin(), numbers.end(), [](char c) { return c == ' ' || c == '\n'; }),
                  numbers.end());
    for (std::size_t first = 0; first < numbers.size();) {
      const std::size_t comma = std::min(numbers.find(',', first), numbers.size());
      result += before + numbers.substr(first, comma - first) + (comma < numbers.size() ? after : "");
      first = comma + 1;
    }
    result += close;
    at = end + 2;
  }
  return result;
}

struct Dialect {
  const char* name;
  std::string (*write)(std::string text);
};

class OtherWriter : public ::testing::TestWithParam<Dialect> {};

TEST_P(OtherWriter, IsReadLikeOurs) {
  const Calibration written = two_cameras();
  const std::string text = GetParam().write(write_calibration(written));
  const auto read = read_calibration(text, "calibration.yml");
  ASSERT_TRUE(read) << to_string(read.error()) << "\n" << text;
  EXPECT_EQ(write_calibration(*read), write_calibration(written));
}

std::string without_header(const std::string& text) {
  return text.substr(text.find("---\n") + 4);
}

const Dialect kDialects[] = {
    {"NoHeader", [](std::string text) { return without_header(text); }},
    {"MarkAlone", [](std::string text) { return text.substr(text.find("---")); }},
    {"HeaderOfYaml1", [](std::string text) { return replaced(text, "%YAML:1.0", "%YAML 1.0"); }},
    {"HeaderOfYaml11", [](std::string text) { return replaced(text, "%YAML:1.0", "%YAML 1.1"); }},
    {"HeaderOfYaml12", [](std::string text) { return replaced(text, "%YAML:1.0", "%YAML 1.2"); }},
    {"CommentFirst", [](std::string text) { return "# by hand\n\n" + text; }},
    {"EndMark", [](std::string text) { return text + "...\n"; }},
    {"ByteOrderMark", [](std::string text) { return "\xef\xbb\xbf" + text; }},
    {"ByteOrderMarkWithoutHeader", [](std::string text) { return "\xef\xbb\xbf" + without_header(text); }},
    {"CarriageReturns", [](std::string text) { return replace_all(text, "\n", "\r\n"), text; }},
    {"CarriageReturnsAlone", [](std::string text) { return replace_all(text, "\n", "\r"), text; }},
    {"SingleQuotes", [](std::string text) { return replace_all(text, "\"", "'"), text; }},
    {"NoQuotes", [](std::string text) { return replace_all(text, "\"", ""), text; }},
    {"QuotedKeys", [](std::string text) { return replaced(text, "projector_width:", "\"projector_width\" :"); }},
    {"LongTags",
     [](std::string text) { return replace_all(text, "!!opencv-matrix", "!<tag:yaml.org,2002:opencv-matrix>"), text; }},
    {"LocalTags", [](std::string text) { return replace_all(text, "!!opencv-matrix", "!opencv-matrix"), text; }},
    {"NoTags", [](std::string text) { return replace_all(text, " !!opencv-matrix", ""), text; }},
    {"BlockLists", [](std::string text) { return with_lists(text, "", "\n            - ", "", ""); }},
    {"OneNumberToALine", [](std::string text) { return with_lists(text, "[", "\n               ", ",", " ]"); }},
    {"TabsInLists", [](std::string text) { return replace_all(text, ", ", ",\t"), text; }},
    {"Comments", [](std::string text) { return replace_all(text, "dt: d\n", "dt: d   # of doubles\n# next\n"), text; }},
    {"FlowMaps",
     [](std::string text) {
       const std::size_t begin = text.find("projector_matrix"), end = text.find(']', begin) + 1;
       const std::string numbers = text.substr(text.find('[', begin), end - text.find('[', begin));
       return text.replace(begin, end - begin,
                           "projector_matrix: { rows: 3, cols: 3,\n   dt: d, data: " + numbers + " }");
     }},
    {"Anchors",
     [](std::string text) {
       const std::size_t last = text.rfind("camera_matrix:");
       const std::size_t first = text.find("camera_matrix: !!opencv-matrix");
       const std::size_t end = text.find(']', last) + 1;
       text.replace(last, end - last, "camera_matrix: *lens");
       return text.replace(first, 15, "camera_matrix: &lens ");
     }},
    {"OtherKeys", [](std::string text) { return text + "nested: { a: [ { b: null } ], c: ~ }\nopencv_version: 5\n"; }},
};

INSTANTIATE_TEST_SUITE_P(ReadCalibration, OtherWriter, ::testing::ValuesIn(kDialects),
                         [](const auto& one) { return one.param.name; });

TEST(ReadCalibration, RefusesADecimalComma) {
  EXPECT_THAT(message_of(replaced(write_calibration(paper_rig()), "data: [ 1920.,", "data: [ 1920,0,")),
              HasSubstr("projector_matrix must have rows x cols numbers"));
}

TEST(ReadCalibration, RefusesOtherDistortionsWithWhatToDo) {
  for (const int count : {4, 8, 12, 14}) {
    std::string text = write_calibration(paper_rig());
    const std::size_t key = text.find("camera_distortion"), data = text.find('[', key), end = text.find(']', key);
    std::string numbers = "[ 0";
    for (int i = 1; i < count; ++i) numbers += ", 0";
    text = replaced(text.replace(data, end - data, numbers), "cols: 5", "cols: " + std::to_string(count), key);
    EXPECT_THAT(message_of(text),
                HasSubstr("camera_distortion must be 1x5 or 5x1: slsd reads OpenCV's k1 k2 p1 p2 k3"));
    EXPECT_THAT(message_of(text), HasSubstr("slsd --calibrate writes such"));
  }
}

TEST(ReadCalibration, NamesOtherKindsOfCalibration) {
  const std::pair<const char*, const char*> kinds[]{
      {"<?xml version=\"1.0\"?>\n<opencv_storage></opencv_storage>\n", "holds XML"},
      {"{ \"projector_width\": 1280 }\n", "holds JSON"},
      {"image_width: 1600\nimage_height: 1200\ncamera_name: left\ndistortion_model: plumb_bob\n",
       "is a camera_info file of ROS"},
      {"cam0:\n  camera_model: pinhole\n  intrinsics: [1, 2, 3, 4]\n", "is a calibration of Kalibr"},
      {"%YAML:1.0\n---\nM1: 1\nD1: 2\nR: 3\nT: 4\n", "is a calibration of cameras without a projector"},
      {"some words\n", "is not a calibration file"}};
  for (const auto& [text, what] : kinds) {
    EXPECT_THAT(message_of(text), HasSubstr(what));
    EXPECT_THAT(message_of(text), HasSubstr("as slsd --calibrate writes it"));
  }
}

TEST(ReadCalibration, TellsMirrorsAndTurnedAxes) {
  Calibration rig = paper_rig();
  rig.cameras[0].projector_from_camera.rotation.row(1) *= -1;
  EXPECT_THAT(message_of(write_calibration(rig)), HasSubstr("R is not a rotation but mirrors"));
}

TEST(ReadCalibration, TakesCommentsAndOtherLineEnds) {
  std::string text = write_calibration(paper_rig());
  text = replaced(text, "projector_width: 1280", "# the beamer\nprojector_width: 1280   # px");
  for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2) text.replace(at, 1, "\r\n");
  EXPECT_EQ(message_of(text), "accepted");
}

TEST(ReadCalibration, TakesNamesWithQuotesAndUmlauts) {
  Calibration rig = paper_rig();
  rig.cameras[0].name = "the \"left\" \\ \xc3\xa4ussere # one";
  const auto read = read_calibration(write_calibration(rig), "calibration.yml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->cameras[0].name, rig.cameras[0].name);
}

TEST(ReadCalibration, RefusesWhatIsNoTree) {
  const std::string begin = "%YAML:1.0\n---\n";
  EXPECT_THAT(message_of(begin + "a: 1\n   b: 2\n"), HasSubstr("calibration.yml:4: is not YAML"));
  EXPECT_THAT(message_of(begin + "   a: 1\nb: 2\n"), HasSubstr("calibration.yml:4: is not YAML"));
  EXPECT_THAT(message_of(begin + "a: 1\na: 2\n"), HasSubstr("calibration.yml:4: a appears twice"));
  std::string keys, list = "a: [ 1";
  for (int i = 0; i < 50'000; ++i) keys += "a" + std::to_string(i) + ":\n", list += ",\n1";
  EXPECT_THAT(message_of(begin + keys), HasSubstr("too many keys"));
  EXPECT_THAT(message_of(begin + list + "]\n"), HasSubstr("holds too many values"));
}

TEST(ReadCalibration, TakesASequenceAsOthersIndentIt) {
  std::string text = write_calibration(paper_rig());
  const std::size_t item = text.find("   -\n");
  std::string rest = text.substr(item + 5);
  for (std::size_t at = 0; (at = rest.find("\n      ", at)) != rest.npos; at += 1) rest.replace(at + 1, 6, "  ");
  EXPECT_EQ(message_of(text.substr(0, item) + "- " + rest.substr(6)), "accepted");
}

TEST(WriteCalibration, IsReadByOpenCvToTheLastBit) {
  Calibration rig = two_cameras();
  rig.projector.fx = 1e10 / 3, rig.cameras[0].lens.distortion[0] = -1e-7 / 3,
  rig.cameras[1].name = "the \"left\" \\ # one: 2";
  const cv::FileStorage file(write_calibration(rig), cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::Mat matrix, distortion;
  file["projector_matrix"] >> matrix;
  file["cameras"][0]["camera_distortion"] >> distortion;
  EXPECT_EQ(matrix.at<double>(0, 0), rig.projector.fx);
  EXPECT_EQ(matrix.at<double>(2, 2), 1.0);
  EXPECT_EQ(distortion.at<double>(0, 0), rig.cameras[0].lens.distortion[0]);
  EXPECT_EQ(file["cameras"][1]["name"].string(), rig.cameras[1].name);
  EXPECT_EQ(static_cast<int>(file["cameras"][1]["width"]), rig.cameras[1].lens.width_px);
  EXPECT_EQ(file["reprojection_error_camera_px"].real(), 0.11);
}

TEST(ReadCalibration, ReadsWhatOpenCvWrites) {
  const Calibration rig = paper_rig();
  const cv::FileStorage read(write_calibration(rig), cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const auto copy_matrix = [&](const cv::FileNode& node, const char* key) {
    cv::Mat matrix;
    node[key] >> matrix;
    file << key << matrix;
  };
  for (const char* key : {"projector_width", "projector_height"}) file << key << static_cast<int>(read[key]);
  for (const char* key : {"projector_matrix", "projector_distortion"}) copy_matrix(read.root(), key);
  file << "held_out_error_px" << 0.1 / 3 << "verdict"
       << "good"
       << "date"
       << "2026-03-01"
       << "cameras"
       << "["
       << "{"
       << "name"
       << "a: \"b\"";
  const cv::FileNode camera = read["cameras"][0];
  for (const char* key : {"width", "height"}) file << key << static_cast<int>(camera[key]);
  for (const char* key : {"camera_matrix", "camera_distortion", "R", "T"}) copy_matrix(camera, key);
  file << "}"
       << "]";
  const auto again = read_calibration(file.releaseAndGetString(), "calibration.yml");
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->projector, rig.projector);
  EXPECT_EQ(again->cameras[0].lens, rig.cameras[0].lens);
  EXPECT_EQ(again->cameras[0].name, "a: \"b\"");
  EXPECT_EQ(again->report.held_out_error_px, 0.1 / 3);
  EXPECT_EQ(again->report.verdict, "good");
  EXPECT_EQ(again->report.date, "2026-03-01");
  expect_same(again->cameras[0].projector_from_camera, rig.cameras[0].projector_from_camera);
}

RC_GTEST_PROP(ReadCalibration, RefusesEveryTruncation, ()) {
  const std::string text = write_calibration(paper_rig());
  const std::size_t end = text.rfind(']');
  const std::size_t size = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange<std::size_t>(0, end));
  RC_ASSERT(message_of(text.substr(0, size)) != "accepted");
}

TEST(DepthSigma, GrowsWithTheSquareOfTheDepthWhereNothingElseIsKnown) {
  CalibrationReport report;
  EXPECT_EQ(report.depth_sigma_mm(1000), std::nullopt);
  report.depth_sigma = {{500, 0.1}, {1000, 0.8}, {2000, 3.2}};
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(250), 0.025);
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(500), 0.1);
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(1000), 0.8);
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(1500), 1.8);
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(4000), 12.8);
  EXPECT_DOUBLE_EQ(*report.depth_sigma_mm(750), 750 * 750 * 0.6e-6);
}

TEST(ReadCalibration, RefusesDepthsThatDoNotGrowAndDeviationsBelowNone) {
  Calibration rig = paper_rig();
  rig.report.depth_sigma = {{500, 0.1}, {500, 0.8}, {2000, 3.2}};
  EXPECT_THAT(message_of(write_calibration(rig)), HasSubstr("depth_mm must increase"));
  rig.report.depth_sigma = {{500, 0.1}, {1000, -0.8}, {2000, 3.2}};
  EXPECT_THAT(message_of(write_calibration(rig)), HasSubstr("depth_sigma_mm must not be negative"));
}

TEST(Camera, IsFoundByName) {
  Calibration rig = two_cameras();
  EXPECT_EQ(rig.camera("right"), &rig.cameras[1]);
  EXPECT_EQ(rig.camera("middle"), nullptr);
  rig.cameras.pop_back();
  EXPECT_EQ(rig.camera("middle"), &rig.cameras[0]);
}

}  // namespace
}  // namespace slsd
