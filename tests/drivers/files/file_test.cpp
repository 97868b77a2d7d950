// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/file.hpp"

#include <csignal>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/drivers/temporary_folder.hpp"

namespace slsd {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// While it lives no file may grow beyond the limit: a full disk that needs no disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(ReadFile, GivesAllBytes) {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\n\xff", 5);
  EXPECT_EQ(read_file(folder.write("file", bytes), 100), bytes);
  EXPECT_EQ(read_file(folder.write("empty", ""), 100), std::string());
}

TEST(ReadFile, RefusesWhatIsLongerThanTheLimit) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "12345");
  EXPECT_TRUE(read_file(path, 5));
  const auto refused = read_file(path, 4);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(refused.error().where, path.string());
  EXPECT_THAT(refused.error().message, HasSubstr("the limit of 4 bytes"));
}

TEST(ReadFile, NamesWhatIsWrongWithThePath) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_EQ(read_file(folder.path() / "none", 1).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_file(folder.path() / "file" / "below", 1).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_file(folder.path(), 1).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_file("/dev/null", 1).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_file("", 1).error().code, ErrorCode::kNotFound);
}

TEST(ReadFile, DoesNotWaitForAPipe) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(read_file(path, 1).error().code, ErrorCode::kInvalidArgument);
}

/// Root may do everything: there what follows is done by somebody else, to whom the folder and its files are given.
class AsNobody {
 public:
  explicit AsNobody(const fs::path& folder) {
    if (!was_root_) return;
    for (const auto& entry : fs::directory_iterator(folder)) give(entry.path());
    give(folder);
    EXPECT_EQ(::setresuid(kNobody, kNobody, 0), 0);  // access() goes by the real one
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
  ~AsNobody() {
    const bool back = !was_root_ || ::setresuid(0, 0, 0) == 0;
    EXPECT_TRUE(back);
  }

 private:
  static constexpr uid_t kNobody = 65534;
  const bool was_root_ = ::geteuid() == 0;
  static void give(const fs::path& path) { EXPECT_EQ(::chown(path.c_str(), kNobody, static_cast<gid_t>(-1)), 0); }
};

TEST(ReadFile, SaysThatAFileMayNotBeRead) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "x");
  fs::permissions(path, fs::perms::none);
  const AsNobody somebody(folder.path());
  EXPECT_EQ(read_file(path, 1).error().code, ErrorCode::kPermissionDenied);
}

TEST(WriteFileAtomically, WritesANewFileAndNothingElse) {
  const TemporaryFolder folder;
  const std::string bytes("a\0b", 3);
  ASSERT_TRUE(write_file_atomically(folder.path() / "new", bytes));
  EXPECT_EQ(bytes_of(folder.path() / "new"), bytes);
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(WriteFileAtomically, LeavesAReaderOfTheOldFileWithTheOldFile) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "old");
  std::ifstream reader(path);
  ASSERT_TRUE(write_file_atomically(path, "new"));
  std::string seen;
  reader >> seen;
  EXPECT_EQ(seen, "old");
  EXPECT_EQ(bytes_of(path), "new");
}

TEST(WriteFileAtomically, KeepsPermissionsAndFollowsLinks) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  fs::create_symlink("file", folder.path() / "link");
  ASSERT_TRUE(write_file_atomically(folder.path() / "link", "new"));
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_EQ(bytes_of(path), "new");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST(WriteFileAtomically, FollowsALinkToAFileThatIsNotThereYet) {
  const TemporaryFolder folder;
  fs::create_symlink("target", folder.path() / "link");
  ASSERT_TRUE(write_file_atomically(folder.path() / "link", "new"));
  EXPECT_EQ(bytes_of(folder.path() / "target"), "new");
}

TEST(WriteFileAtomically, LeavesTheOldFileAndNoRestOnAFullDisk) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "old");
  Result<> written;
  {
    const FileSizeLimit full(10000);
    written = write_file_atomically(path, std::string(100000, 'x'));
  }
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(written.error().where, path.string());
  EXPECT_EQ(bytes_of(path), "old");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(WriteFileAtomically, WritesDevicesInPlace) {
  EXPECT_TRUE(write_file_atomically("/dev/null", "x"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(write_file_atomically("/dev/full", "x").error().code, ErrorCode::kNoSpace);
}

TEST(WriteFileAtomically, NamesWhatIsWrongWithThePath) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_EQ(write_file_atomically(folder.path(), "x").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(write_file_atomically("", "x").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(write_file_atomically(folder.path() / "no" / "file", "x").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(write_file_atomically(folder.path() / "file" / "x", "x").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(write_file_atomically(folder.path() / std::string(300, 'n'), "x").error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(WriteFileAtomically, RespectsAWriteProtectedFile) {
  const TemporaryFolder folder;
  const fs::path path = folder.write("file", "old");
  fs::permissions(path, fs::perms::owner_read);
  const AsNobody somebody(folder.path());
  EXPECT_EQ(write_file_atomically(path, "new").error().code, ErrorCode::kPermissionDenied);
  EXPECT_EQ(bytes_of(path), "old");
}

TEST(CheckWritable, AgreesWithWritingAndLeavesEverythingAsItWas) {
  const TemporaryFolder folder;
  const fs::path there = folder.write("there", "old");
  EXPECT_TRUE(check_writable(there));
  EXPECT_EQ(bytes_of(there), "old");
  EXPECT_TRUE(check_writable(folder.path() / "new"));
  EXPECT_EQ(entries(folder.path()), 1U);
  for (const fs::path& path : {folder.path(), folder.path() / "none" / "file", there / "file", fs::path()}) {
    const auto checked = check_writable(path), written = write_file_atomically(path, "x");
    ASSERT_FALSE(checked) << path;
    EXPECT_EQ(to_string(checked.error()), to_string(written.error()));
  }
}

TEST(CheckWritable, FindsAFullDisk) {
  const TemporaryFolder folder;
  Result<> checked;
  {
    const FileSizeLimit full(1000);
    checked = check_writable(folder.path() / "new");
  }
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(entries(folder.path()), 0U);
}

TEST(LowerExtension, IsHowTheNameEnds) {
  EXPECT_EQ(lower_extension("a/B.PLY"), ".ply");
  EXPECT_EQ(lower_extension("a.b/c"), "");
}

}  // namespace
}  // namespace slsd
