// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/listening_socket.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <vector>

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

/// Binds and listens as another service would. @return none: the path is taken
FileDescriptor listener_at(const path& path) {
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const bool listens = ::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
                       ::listen(socket.number(), 1) == 0;
  return listens ? std::move(socket) : FileDescriptor();
}

/// Processes that open the same socket at the same moment, and keep it until the object ends.
class Starters {
 public:
  Starters(const path& socket, int count) {
    EXPECT_EQ(::pipe(start_.data()), 0);
    EXPECT_EQ(::pipe(told_.data()), 0);
    for (int i = 0; i < count; ++i) {
      const pid_t child = ::fork();
      if (child == 0) start(socket);
      children_.push_back(child);
    }
  }
  ~Starters() {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
    for (const int end : {start_[0], start_[1], told_[0], told_[1]}) ::close(end);
  }
  Starters(const Starters&) = delete;
  Starters& operator=(const Starters&) = delete;

  /// Starts all. @return for each 'w' if it listens, 'b' if it found another, 'x' for another error; sorted
  [[nodiscard]] std::string outcomes() {
    const std::string go(children_.size(), '!');
    EXPECT_EQ(::write(start_[1], go.data(), go.size()), static_cast<ssize_t>(go.size()));
    std::string outcomes(children_.size(), '?');
    for (char& outcome : outcomes) EXPECT_EQ(::read(told_[0], &outcome, 1), 1);
    std::ranges::sort(outcomes);
    return outcomes;
  }

 private:
  [[noreturn]] void start(const path& socket) {
    char outcome = 'x';
    if (::read(start_[0], &outcome, 1) != 1) ::_exit(1);
    const auto listening = ListeningSocket::open(socket, 0600);
    outcome = listening ? 'w' : listening.error().code == ErrorCode::kBusy ? 'b' : 'x';
    if (::write(told_[1], &outcome, 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }

  std::array<int, 2> start_{}, told_{};
  std::vector<pid_t> children_;
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

TEST_F(ListeningSocketTest, GivesThePathToOneOfSeveralThatStartAtOnce) {
  for (int round = 0; round < 20; ++round) {
    const path socket = folder_ / "s";  // the killed ones of the round before leave a dead socket
    Starters starters(socket, 4);
    EXPECT_EQ(starters.outcomes(), "bbbw");
    EXPECT_TRUE(Connection::open(socket));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  }
}

TEST_F(ListeningSocketTest, WaitsForAnotherThatIsStarting) {
  const FileDescriptor starting(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(::flock(starting.number(), LOCK_EX), 0);
  auto second = std::async(std::launch::async, [&] { return ListeningSocket::open(folder_ / "s", 0600); });
  const FileDescriptor first = listener_at(folder_ / "s");
  ASSERT_TRUE(first);
  ASSERT_EQ(::flock(starting.number(), LOCK_UN), 0);
  const auto refused = second.get();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBusy);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("another service runs here"));
  EXPECT_EQ(refused.error().where, folder_ / "s");
}

TEST_F(ListeningSocketTest, DoesNotWaitForeverForAnotherThatIsStarting) {
  const FileDescriptor starting(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(::flock(starting.number(), LOCK_EX), 0);
  const auto refused = ListeningSocket::open(folder_ / "s", 0600);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBusy);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("a process locks the socket's folder"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "s"));
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
    ASSERT_TRUE(listener_at(folder_ / name));
  }
  std::ofstream(folder_ / (".slsd-" + std::to_string(dead) + "x")) << "a file of somebody";
  ASSERT_TRUE(ListeningSocket::open(folder_ / "s", 0600));
  EXPECT_FALSE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(dead))));
  EXPECT_TRUE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(::getppid()))));
  EXPECT_TRUE(std::filesystem::exists(folder_ / (".slsd-" + std::to_string(dead) + "x")));
}

}  // namespace
}  // namespace slsd
