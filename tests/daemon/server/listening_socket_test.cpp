// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/listening_socket.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "clients/connection/connection.hpp"
#include "daemon/configuration/server_options.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

class ListeningSocketTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "slsd-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  path folder_;
};

TEST_F(ListeningSocketTest, TakesConnectionsAndGoesWithItsObject) {
  const path socket = folder_ / "s";
  {
    const auto listening = ListeningSocket::open(socket, 0640);
    ASSERT_TRUE(listening) << to_string(listening.error());
    EXPECT_EQ(std::filesystem::status(socket).permissions(), std::filesystem::perms(0640));
    EXPECT_TRUE(Connection::open(socket));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  }
  EXPECT_FALSE(std::filesystem::exists(socket));
}

TEST_F(ListeningSocketTest, LeavesALivingOneAlone) {
  const path socket = folder_ / "s";
  const auto first = ListeningSocket::open(socket, 0600);
  const auto second = ListeningSocket::open(socket, 0600);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kBusy);
  EXPECT_TRUE(Connection::open(socket));
}

TEST_F(ListeningSocketTest, ReplacesADeadOne) {
  const path socket = folder_ / "s";
  {
    auto dead = ListeningSocket::open(socket, 0600);
    ASSERT_TRUE(dead);
    std::filesystem::create_hard_link(socket, folder_ / "kept");
  }
  std::filesystem::rename(folder_ / "kept", socket);
  EXPECT_TRUE(ListeningSocket::open(socket, 0600));
}

TEST_F(ListeningSocketTest, LeavesWhatIsNoSocketAlone) {
  const path file = folder_ / "s";
  std::ofstream(file) << "precious";
  for (const path& taken : {file, folder_}) {
    const auto listening = ListeningSocket::open(taken, 0600);
    ASSERT_FALSE(listening);
    EXPECT_EQ(listening.error().code, ErrorCode::kAlreadyExists);
  }
  EXPECT_EQ(std::filesystem::file_size(file), 8U);
}

TEST_F(ListeningSocketTest, LeavesTheSocketThatTookItsPlaceAlone) {
  const path socket = folder_ / "s";
  auto first = ListeningSocket::open(socket, 0600);
  std::filesystem::rename(socket, folder_ / "away");
  const auto second = ListeningSocket::open(socket, 0600);
  ASSERT_TRUE(second);
  { const ListeningSocket gone = std::move(*first); }
  EXPECT_TRUE(Connection::open(socket));
}

TEST_F(ListeningSocketTest, TakesTheLongestPathAndNoLongerOne) {
  const std::size_t room = kMaxSocketPath - folder_.string().size() - 1;
  const path longest = folder_ / std::string(room, 'x');
  EXPECT_TRUE(ListeningSocket::open(longest, 0600));
  const auto longer = ListeningSocket::open(longest.string() + "x", 0600);
  ASSERT_FALSE(longer);
  EXPECT_EQ(longer.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ListeningSocketTest, NamesAFolderThatIsMissing) {
  const auto listening = ListeningSocket::open(folder_ / "missing" / "s", 0600);
  ASSERT_FALSE(listening);
  EXPECT_EQ(listening.error().code, ErrorCode::kNotFound);
}

TEST_F(ListeningSocketTest, RemovesWhatADaemonThatWasKilledLeft) {
  const pid_t dead = ::fork();
  if (dead == 0) ::_exit(0);
  ::waitpid(dead, nullptr, 0);
  for (const std::string& name : {".slsd-" + std::to_string(dead), ".slsd-" + std::to_string(::getppid())}) {
    ASSERT_TRUE(ListeningSocket::open(folder_ / "other", 0600));
    const FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, (folder_ / name).c_str(), sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  std::ofstream(folder_ / (".slsd-" + std::to_string(dead) + "x")) << "a file of somebody";
  ASSERT_TRUE(ListeningSocket::open(folder_ / "s", 0600));
  EXPECT_FALSE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(dead))));
  EXPECT_TRUE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(::getppid()))));
  EXPECT_TRUE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(dead) + "x")));
}

}  // namespace
}  // namespace slsd
