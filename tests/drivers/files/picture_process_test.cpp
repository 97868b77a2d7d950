// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/picture_process.hpp"

#include <sys/wait.h>

#include <cerrno>
#include <filesystem>

#include <gmock/gmock.h>

#include "drivers/files/encode_png.hpp"
#include "drivers/system/own_program.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr auto kTimeout = 60s;

Result<Grey8> decode(std::string_view png, int width_px, int height_px) {
  return decode_in_process(png, width_px, height_px, std::chrono::steady_clock::now() + kTimeout,
                           find_own_program("slsd-picture"));
}

Grey8 noise(int width_px, int height_px) {
  Grey8 image(width_px, height_px);
  std::uint32_t state = 1;
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      image.at(x, y) = static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  return image;
}

TEST(DecodeInProcess, GivesThePixels) {
  const Grey8 image = noise(1280, 800);  // larger than what a socket holds, both ways
  EXPECT_EQ(decode(*encode_png(image), 1280, 800), image);
}

TEST(DecodeInProcess, NamesWhatIsNoPictureForTheProjector) {
  const std::string png = *encode_png(noise(40, 30));
  const auto other = decode(png, 50, 30);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(other.error().message, HasSubstr("40x30 pixels, the projector 50x30"));
  EXPECT_EQ(decode(*encode_png(Grey16(40, 30)), 40, 30).error().code, ErrorCode::kMismatch);
  EXPECT_EQ(decode("P5 40 30 255\n" + std::string(1200, 'x'), 40, 30).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(decode("", 40, 30).error().code, ErrorCode::kUnsupported);
}

TEST(DecodeInProcess, SurvivesEveryDamage) {
  const std::string png = test::png_bytes(test::samples_of(noise(9, 7)));
  for (std::size_t size = 8; size < png.size(); size += 7)
    EXPECT_EQ(decode(png.substr(0, size), 9, 7).error().code, ErrorCode::kMalformed);
  std::string huge = png;
  huge[16] = 0x7f;
  EXPECT_FALSE(decode(huge, 9, 7));
}

/// What may stand in the place of slsd-picture once somebody has taken it over.
class HostileProgram : public ::testing::Test {
 protected:
  Result<Grey8> decode_by(const std::string& script, std::chrono::milliseconds time = kTimeout) {
    const auto program = folder_.write("program", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return decode_in_process(std::string(1 << 20, 'x'), 4, 3, std::chrono::steady_clock::now() + time, program);
  }

  void TearDown() override {
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
    EXPECT_EQ(errno, ECHILD);
  }

  test::TemporaryFolder folder_;
};

TEST_F(HostileProgram, ThatDiesIsNamed) {
  const auto killed = decode_by("kill -SYS $$");
  ASSERT_FALSE(killed);
  EXPECT_EQ(killed.error().code, ErrorCode::kMalformed);
  EXPECT_THAT(killed.error().message, HasSubstr("killed by signal 31"));
  EXPECT_THAT(decode_by("printf 'ok\\n123456789012'; kill -SEGV $$").error().message, HasSubstr("signal 11"));
  EXPECT_THAT(decode_by("exit 3").error().message, HasSubstr("status 3"));
}

TEST_F(HostileProgram, ThatHangsIsEndedInTime) {
  for (const std::string script :
       {"exec sleep 100", "cat >/dev/null; exec sleep 100", "exec 0>&- 1>&-; exec sleep 100"}) {
    const auto begin = std::chrono::steady_clock::now();
    const auto hung = decode_by(script, 1s);
    EXPECT_FALSE(hung) << script;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 20s) << script;
  }
  EXPECT_EQ(decode_by("exec sleep 100", 500ms).error().code, ErrorCode::kTimeout);
}

TEST_F(HostileProgram, ThatLiesIsNotBelieved) {
  for (const std::string script :
       {"printf 'ok\\n'", "printf 'ok\\n12345678901'", "printf 'ok\\n1234567890123'", "printf 'ok'", "printf '\\n'",
        "exec yes", "printf 'busy come again\\n'", "printf 'mismatch x\\nmore'", "printf 'mismatch'", "cat"}) {
    const auto lied = decode_by(script);
    ASSERT_FALSE(lied) << script;
    EXPECT_EQ(lied.error().code, ErrorCode::kMalformed) << script;
  }
  const auto dressed = decode_by("printf 'mismatch red\\033[31m\\n'");
  EXPECT_EQ(dressed.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(dressed.error().message, Not(HasSubstr("\033")));
}

TEST_F(HostileProgram, MayAnswerBeforeItHasReadAll) {
  EXPECT_EQ(*decode_by("printf 'ok\\n123456789012'"), [] {
    Grey8 image(4, 3);
    for (int i = 0; i < 12; ++i) image.at(i % 4, i / 4) = static_cast<std::uint8_t>("123456789012"[i]);
    return image;
  }());
}

TEST(DecodeInProcess, ThatIsNotInstalledIsNamed) {
  const auto missing =
      decode_in_process("x", 4, 3, std::chrono::steady_clock::now() + kTimeout, "/nowhere/slsd-picture");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(to_string(missing.error()), HasSubstr("/nowhere/slsd-picture: is not installed"));
}

}  // namespace
}  // namespace slsd
