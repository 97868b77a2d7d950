// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/draw_sheet.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <gmock/gmock.h>

#include "core/board/find_board.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "drivers/files/read_image.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

constexpr double kDpi = 150;  // pdftoppm draws edges to a quarter of a pixel

// One of each kind, of fractions of a millimetre too.
constexpr const char* kBoards[] = {"charuco:8x5:25.4:19.05:DICT_5X5_1000", "chessboard:8x5:20", "circles:4x7:12:14",
                                   "plane:5x3:45:20:DICT_4X4_50"};

Sheet sheet_of(const char* board) {
  return *lay_out(*parse_board(board), *parse_paper("A4"));
}

// The board, and every point of it, where the sheet has it.
void expect_true_scale(const GreyView& image, const Sheet& sheet) {
  const auto sighting = find_board(image, sheet.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_EQ(sighting->points.size(), static_cast<std::size_t>(sheet.board.point_count()));
  for (const SeenPoint& point : sighting->points) {
    const Eigen::Vector2d seen_mm = (point.pixel.array() + 0.5) * 25.4 / kDpi;
    const Eigen::Vector2d true_mm = sheet.origin_mm + sheet.board.point(point.id).head<2>();
    EXPECT_LT((seen_mm - true_mm).norm(), 0.05) << to_string(sheet.board) << " point " << point.id;
  }
}

class PrintedTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (std::filesystem::temp_directory_path() / "slsd-print-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder.data()), nullptr);
    folder_ = folder;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // What another program makes of a file; nothing where it is not installed.
  std::optional<GreyView> rendered(const std::string& bytes, const std::string& command) {
    std::ofstream(folder_ / "sheet", std::ios::binary) << bytes;
    const std::string line = "cd '" + folder_.string() + "' && " + command + " >/dev/null 2>&1";
    if (std::system(line.c_str()) != 0) return std::nullopt;
    auto read = read_image(folder_ / "sheet.png");
    if (!read) return std::nullopt;
    image_ = std::move(*read);
    return std::visit([](const auto& image) { return GreyView(image.view()); }, image_);
  }

 private:
  std::filesystem::path folder_;
  decltype(read_image(std::filesystem::path()))::value_type image_;
};

class Printed : public PrintedTest, public ::testing::WithParamInterface<const char*> {};

bool has(const char* program) {
  return std::system((std::string("command -v ") + program + " >/dev/null").c_str()) == 0;
}

TEST_P(Printed, AsPixelsIsTrueToScale) {
  const Sheet sheet = sheet_of(GetParam());
  const auto image = sheet_image(sheet, kDpi);
  ASSERT_TRUE(image) << to_string(image.error());
  expect_true_scale(image->view(), sheet);
}

TEST_P(Printed, AsPdfIsTrueToScaleToPoppler) {
  if (!has("pdftoppm")) GTEST_SKIP() << "pdftoppm of poppler-utils is not installed";
  const Sheet sheet = sheet_of(GetParam());
  const auto pdf = sheet_pdf(sheet);
  ASSERT_TRUE(pdf) << to_string(pdf.error());
  EXPECT_LT(pdf->size(), 40000U);
  const auto image = rendered(*pdf, "pdftoppm -r 150 -gray -singlefile -png sheet sheet");
  ASSERT_TRUE(image);
  expect_true_scale(*image, sheet);
}

TEST_P(Printed, AsSvgIsTrueToScaleToLibrsvg) {
  if (!has("rsvg-convert")) GTEST_SKIP() << "rsvg-convert of librsvg2-bin is not installed";
  const Sheet sheet = sheet_of(GetParam());
  const auto svg = sheet_svg(sheet);
  ASSERT_TRUE(svg) << to_string(svg.error());
  const auto image = rendered(*svg, "rsvg-convert -d 150 -p 150 -b white -o sheet.png sheet");
  ASSERT_TRUE(image);
  expect_true_scale(*image, sheet);
}

INSTANTIATE_TEST_SUITE_P(Boards, Printed, ::testing::ValuesIn(kBoards));

struct ShippedBoard {
  const char* file;
  const char* paper;
  const char* board;
};
constexpr ShippedBoard kShippedBoards[] = {
    {"charuco-11x7-23mm-a4.pdf", "A4", "charuco:11x7:23:17.25:DICT_5X5_1000"},
    {"charuco-11x7-34mm-a3.pdf", "A3", "charuco:11x7:34:25.5:DICT_5X5_1000"},
    {"charuco-11x7-60mm-a1.pdf", "A1", "charuco:11x7:60:45:DICT_5X5_1000"},
    {"chessboard-9x6-22mm-a4.pdf", "A4", "chessboard:9x6:22"},
    {"circles-4x11-14mm-a4.pdf", "A4", "circles:4x11:14:14"},
    {"plane-6x4-60mm-a3.pdf", "A3", "plane:6x4:60:24:DICT_4X4_50"},
};

class Shipped : public PrintedTest, public ::testing::WithParamInterface<ShippedBoard> {};

TEST_P(Shipped, IsTheBoardOfItsName) {
  if (!has("pdftoppm")) GTEST_SKIP() << "pdftoppm of poppler-utils is not installed";
  const auto pdf = read_file(std::filesystem::path(SLSD_SOURCE_DIR) / "config/boards" / GetParam().file, 1 << 20);
  ASSERT_TRUE(pdf) << to_string(pdf.error());
  EXPECT_THAT(*pdf, HasSubstr(std::string("/Title (") + GetParam().board + ")"));
  const auto image = rendered(*pdf, "pdftoppm -r 150 -gray -singlefile -png sheet sheet");
  ASSERT_TRUE(image);
  expect_true_scale(*image, *lay_out(*parse_board(GetParam().board), *parse_paper(GetParam().paper)));
}

INSTANTIATE_TEST_SUITE_P(Boards, Shipped, ::testing::ValuesIn(kShippedBoards));

TEST(SheetImage, RefusesWhatNoImageCanBe) {
  const auto image = sheet_image(*lay_out(*parse_board("chessboard:9x6:25"), *parse_paper("A0")), 2400);
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(image.error().message, HasSubstr("--dpi"));
}

TEST(EncodePng, KeepsTheResolution) {
  const auto png = encode_png(Grey8(4, 4), 300);
  ASSERT_TRUE(png);
  const std::string chunk("\x00\x00\x00\x09pHYs\x00\x00\x2e\x23\x00\x00\x2e\x23\x01", 17);
  EXPECT_THAT(*png, HasSubstr(chunk));
}

}  // namespace
}  // namespace slsd
