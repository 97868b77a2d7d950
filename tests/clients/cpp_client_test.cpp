// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>

#include <slsd/scanner.hpp>

namespace slsd::client {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

std::string ply(std::size_t count, const std::string& said = {}, const std::string& fields = {}) {
  return "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex " +
         (said.empty() ? std::to_string(count) : said) + "\n" +
         (fields.empty() ? "property float x\nproperty float y\nproperty float z\n" : fields) + "end_header\n" +
         std::string(12 * count, '\0');
}

std::string result(const std::string& values, const std::string& body = {}) {
  return R"({"jsonrpc":"2.0","id":1,"result":{)" + values + "}}\n" + body;
}

// Listens where slsd would, and answers the first line of each of its peers.
class Impostor {
 public:
  explicit Impostor(std::string answer, int descriptor = -1, bool hangs_up = true) {
    char folder[] = "/tmp/slsd-test-XXXXXX";
    folder_ = ::mkdtemp(folder);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path().copy(address.sun_path, sizeof address.sun_path - 1);
    listener_ = ::socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    thread_ = std::thread([this, answer = std::move(answer), descriptor, hangs_up] {
      std::vector<int> peers;
      for (int peer; (peer = ::accept(listener_, nullptr, nullptr)) >= 0;) {
        char line[4096];
        const ssize_t got = ::read(peer, line, sizeof line);
        {
          const std::lock_guard lock(mutex_);
          asked_.assign(line, got < 0 ? 0 : static_cast<std::size_t>(got));
        }
        send(peer, answer, descriptor);
        if (hangs_up) {
          ::close(peer);
        } else {
          peers.push_back(peer);
        }
      }
      for (const int peer : peers) ::close(peer);
    });
  }
  ~Impostor() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
    std::filesystem::remove_all(folder_);
  }
  [[nodiscard]] std::string path() const { return folder_ + "/slsd.sock"; }
  /// What the last peer sent.
  [[nodiscard]] std::string asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  static void send(int peer, const std::string& bytes, int descriptor) {
    iovec part{const_cast<char*>(bytes.data()), bytes.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
    msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    if (descriptor >= 0) {
      header.msg_control = control;
      header.msg_controllen = sizeof control;
      cmsghdr* passed = CMSG_FIRSTHDR(&header);
      passed->cmsg_level = SOL_SOCKET;
      passed->cmsg_type = SCM_RIGHTS;
      passed->cmsg_len = CMSG_LEN(sizeof(int));
      std::memcpy(CMSG_DATA(passed), &descriptor, sizeof descriptor);
    }
    (void)!::sendmsg(peer, &header, MSG_NOSIGNAL);
  }

  std::string folder_, asked_;
  mutable std::mutex mutex_;
  int listener_;
  std::thread thread_;
};

template <class Error>
std::string refused(const std::string& answer, int descriptor = -1) {
  const Impostor impostor(answer, descriptor);
  Scanner scanner(impostor.path());
  try {
    (void)scanner.scan();
  } catch (const Error& error) {
    return error.what();
  }
  return "not refused as it should be";
}

int memfd(const std::string& bytes, int seals) {
  const int descriptor = ::memfd_create("cloud", MFD_ALLOW_SEALING | MFD_CLOEXEC);
  EXPECT_EQ(::write(descriptor, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  EXPECT_EQ(::fcntl(descriptor, F_ADD_SEALS, seals), 0);
  return descriptor;
}

constexpr int kSealed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL;

TEST(ReadPly, GivesTheFieldsByName) {
  std::string file = ply(0, "2", "property uchar intensity\nproperty float x\nproperty float y\nproperty float z\n");
  for (const float x : {1.5F, -2.0F}) {
    const float xyz[] = {x, 2, 3};
    file.push_back('\x07');
    file.append(reinterpret_cast<const char*>(xyz), sizeof xyz);
  }
  const Cloud cloud = Cloud::read_ply(Bytes(file), R"({"scan":"a-1","lost":3,"sigma_calibration_mm":0.25})");
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_EQ(cloud[1].x, -2);
  EXPECT_EQ(cloud[1].z, 3);
  EXPECT_EQ(cloud[1].intensity, 7);
  EXPECT_EQ(cloud.column<float>("x")[0], 1.5F);
  EXPECT_THROW((void)cloud.column<double>("x"), std::invalid_argument);
  EXPECT_THROW((void)cloud.column<float>("nx"), std::invalid_argument);
  EXPECT_EQ(cloud.comments().at("units"), "mm");
  EXPECT_EQ(cloud.scan, "a-1");
  EXPECT_EQ(cloud.lost, 3U);
  EXPECT_EQ(cloud.sigma_calibration_mm, 0.25);
}

TEST(ReadPly, RefusesHeadersThatLie) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {ply(3, "4"), "but its header says"},
      {ply(3).substr(0, ply(3).size() - 1), "but its header says"},
      {ply(3, "99999999999999999999999"), "an unknown line"},
      {ply(3, "1537228672809129302"), "but its header says"},  // times 12 it is 8
      {ply(3, "-1"), "an unknown line"},
      {"ply\n", "not a binary"},
      {"", "not a binary"},
      {ply(1, "1", "property list uchar int x\n"), "an unknown line"},
      {ply(1, "1", "property float x\nproperty float x\nproperty float z\n"), "an unknown line"},
      {ply(1, "1", "property float x\nproperty int y\nproperty float z\n"), "a header without points"}};
  for (const auto& [file, reason] : cases) {
    try {
      (void)Cloud::read_ply(Bytes(file));
      ADD_FAILURE() << file.substr(0, 80);
    } catch (const ProtocolError& error) {
      EXPECT_THAT(error.what(), HasSubstr(reason));
    }
  }
  EXPECT_EQ(Cloud::read_ply(Bytes(ply(3))).size(), 3U);
  EXPECT_TRUE(Cloud::read_ply(Bytes(ply(0))).empty());
}

TEST(ReadPly, RefusesRubbishByNothingElse) {
  const std::string whole = ply(20);
  std::srand(5);
  for (int i = 0; i < 5000; ++i) {
    std::string file = whole.substr(0, static_cast<std::size_t>(std::rand()) % (whole.size() + 1));
    for (int n = std::rand() % 6; n > 0 && !file.empty(); --n) {
      file[static_cast<std::size_t>(std::rand()) % std::min<std::size_t>(file.size(), 140)] =
          static_cast<char>(std::rand());
    }
    try {
      for (const Point point : Cloud::read_ply(Bytes(file))) EXPECT_EQ(point.sigma_mm, 0);
    } catch (const ProtocolError&) {  // as it should be
    }
  }
}

TEST(Scan, RefusesWhatIsNotSlsd) {
  EXPECT_THAT(refused<ProtocolError>("220 mail ready\n"), HasSubstr("JSON-RPC 2.0"));
  EXPECT_THAT(refused<ProtocolError>("[]\n"), HasSubstr("JSON-RPC 2.0"));
  EXPECT_THAT(refused<ProtocolError>("{\"id\":1,\"result\":{}}\n"), HasSubstr("JSON-RPC 2.0"));
  EXPECT_THAT(refused<ProtocolError>(result("\"a\":" + std::string(100'000, '[') + std::string(100'000, ']'))),
              HasSubstr("JSON-RPC 2.0"));
  EXPECT_THAT(refused<ProtocolError>(std::string((1 << 24) + 70'000, 'x')), HasSubstr("does not end"));
  for (const char* size : {"-1", "true", "\"12\"", "1152921504606846976", "null", "1.5"}) {
    EXPECT_THAT(refused<ProtocolError>(result("\"bytes\":" + std::string(size))), HasSubstr("announces"));
  }
  EXPECT_THAT(refused<ProtocolError>(result("")), HasSubstr("is missing"));
  EXPECT_THAT(refused<ConnectionLost>(result("\"bytes\":4294967296", "ply")), HasSubstr("closed the connection"));
}

TEST(Scan, AsksForReasonsAlone) {
  const std::string file = ply(3);
  const Impostor impostor(result("\"reasons\":[],\"bytes\":" + std::to_string(file.size()), file));
  Scanner scanner(impostor.path());
  ScanOptions options;
  options.why = true;
  EXPECT_THAT(scanner.scan(options).description, HasSubstr("reasons"));
  EXPECT_THAT(impostor.asked(), HasSubstr("\"why\":true"));
  EXPECT_THAT(impostor.asked(), Not(HasSubstr("picture")));
}

TEST(Scan, MapsASealedMemfdAndRefusesAnyOther) {
  const std::string file = ply(3), said = "\"memfd_bytes\":" + std::to_string(file.size());
  EXPECT_THAT(refused<ProtocolError>(result(said)), HasSubstr("no descriptor"));
  const int sealed = memfd(file, kSealed), open = memfd(file, F_SEAL_GROW);
  EXPECT_THAT(refused<ProtocolError>(result(said), open), HasSubstr("not sealed"));
  EXPECT_THAT(refused<ProtocolError>(result("\"memfd_bytes\":4096"), sealed), HasSubstr("size"));
  const Impostor impostor(result(said), sealed);
  Cloud cloud = Scanner(impostor.path()).scan();
  EXPECT_EQ(cloud.size(), 3U);  // after its scanner
  ::close(sealed);
  ::close(open);
}

TEST(Scan, EndsInTimeWhereNobodyAnswers) {
  const Impostor silent("", -1, /*hangs_up=*/false);
  Scanner scanner(silent.path());
  ScanOptions options;
  options.timeout = 1ms;
  EXPECT_THROW((void)scanner.scan(options), TimedOut);
}

TEST(Scan, ThrowsTheProtocolsErrorsByName) {
  const auto answered = [](const std::string& name) {
    return R"({"jsonrpc":"2.0","id":1,"error":{"code":-32018,"message":"why","data":{"name":")" + name + "\"}}}\n";
  };
  EXPECT_EQ(refused<FrameError>(answered("frame_late")), "why");
  EXPECT_EQ(refused<Busy>(answered("busy")), "why");
  EXPECT_EQ(refused<PermissionDenied>(answered("permission_denied")), "why");
  EXPECT_EQ(refused<InvalidRequest>(answered("invalid_params")), "why");
  EXPECT_EQ(refused<ScannerError>(answered("of_another_version")), "why");
}

TEST(AStream, EndsWhereTheServiceVanishesStallsOrLies) {
  const auto event = [](const std::string& bytes) {
    return result("") + R"({"jsonrpc":"2.0","method":"cloud","params":{"scan":"a-1","bytes":)" +
           std::to_string(bytes.size()) + "}}\n" + bytes;
  };
  const auto stream_of = [](const Impostor& service) {
    StreamOptions options;
    options.idle = 50ms;
    return Scanner(service.path()).stream(options);
  };
  const Impostor vanishing(event(ply(3)));
  Stream one = stream_of(vanishing);
  EXPECT_EQ(one.next().size(), 3U);
  EXPECT_THROW((void)one.next(), ConnectionLost);
  const Impostor stalling(event(ply(3)), -1, /*hangs_up=*/false);
  Stream two = stream_of(stalling);
  EXPECT_EQ(two.next().size(), 3U);
  EXPECT_THROW((void)two.next(), TimedOut);
  const Impostor lying(event(ply(3, "4")));
  Stream three = stream_of(lying);
  EXPECT_THROW((void)three.next(), ProtocolError);
}

TEST(AStream, TakesCloudsInSharedMemory) {
  const std::string file = ply(3);
  const int sealed = memfd(file, kSealed);
  const Impostor service(result("") + R"({"jsonrpc":"2.0","method":"cloud","params":{"memfd_bytes":)" +
                             std::to_string(file.size()) + "}}\n",
                         sealed);
  StreamOptions options;
  options.shared = true;
  Stream stream = Scanner(service.path()).stream(options);
  EXPECT_EQ(stream.next().size(), 3U);
  ::close(sealed);
}

TEST(AScanner, TellsThatNobodyIsAccepted) {
  const std::string path = ::testing::TempDir() + "/slsd-accepts-nobody.sock";
  std::filesystem::remove(path);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener, 0), 0);
  std::vector<Scanner> waiting;
  EXPECT_THROW(
      {
        for (int i = 0; i < 10; ++i) waiting.emplace_back(path);
      },
      TimedOut);
  ::close(listener);
  std::filesystem::remove(path);
}

TEST(AScanner, TellsThatNobodyListens) {
  EXPECT_THROW(Scanner("/nonexistent/slsd.sock"), NoService);
  EXPECT_THROW(Scanner("/" + std::string(200, 'a')), ConnectionLost);
}

TEST(AScanner, ConnectsAnewAfterItWasHungUpOn) {
  const Impostor impostor(result("\"role\":\"scan\""));
  Scanner scanner(impostor.path());
  EXPECT_EQ(scanner.role(), "scan");
  EXPECT_THROW((void)scanner.role(), ConnectionLost);
  EXPECT_EQ(scanner.role(), "scan");
}

// Whether a function gave true in a child made by fork.
bool in_a_child(const std::function<bool()>& function) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);
    bool fine = false;
    try {
      fine = function();
    } catch (...) {
    }
    ::_exit(fine ? 0 : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(AChild, HasAConnectionOfItsOwn) {
  const Impostor service(result("\"role\":\"scan\""), -1, /*hangs_up=*/false);
  Scanner scanner(service.path());
  EXPECT_EQ(scanner.role(), "scan");
  EXPECT_TRUE(in_a_child([&] { return scanner.role() == "scan"; }));  // to the first request of each peer it answers
}

TEST(AChild, LeavesItsParentsConnectionOpen) {
  const Impostor service(result(""), -1, /*hangs_up=*/false);
  std::optional<Connection> connection(service.path());
  EXPECT_TRUE(in_a_child([&] {
    connection.reset();
    return true;
  }));
  EXPECT_EQ(connection->send("status", "{}"), 1);
  EXPECT_THAT(connection->receive(std::chrono::steady_clock::now() + 10s).json, HasSubstr("result"));
}

TEST(AChild, IsNotStoppedByALockOfTheParent) {
  const Impostor silent("", -1, /*hangs_up=*/false), service(result("\"role\":\"scan\""), -1, /*hangs_up=*/false);
  const std::string moved = silent.path() + ".silent";
  Scanner scanner(silent.path());
  std::thread waits([&] { EXPECT_THROW((void)scanner.call("status", "{}", 1ms), TimedOut); });
  std::this_thread::sleep_for(100ms);  // longer, and the test proves nothing, but fails for nothing
  std::filesystem::rename(silent.path(), moved);
  std::filesystem::rename(service.path(), silent.path());
  EXPECT_TRUE(in_a_child([&] { return scanner.role() == "scan"; }));
  waits.join();
}

TEST(AChild, ReadsAStreamOverAConnectionOfItsOwn) {
  const std::string file = ply(3);
  const Impostor service(result("") + R"({"jsonrpc":"2.0","method":"cloud","params":{"bytes":)" +
                             std::to_string(file.size()) + "}}\n" + file,
                         -1, /*hangs_up=*/false);
  StreamOptions options;
  options.idle = 10s;
  Stream stream = Scanner(service.path()).stream(options);
  EXPECT_TRUE(in_a_child([&] { return stream.next().size() == 3; }));
  EXPECT_EQ(stream.next().size(), 3U);
}

TEST(AChild, IsRefusedItsParentsConnection) {
  const Impostor service(result(""), -1, /*hangs_up=*/false);
  Connection connection(service.path());
  EXPECT_TRUE(in_a_child([&] {
    try {
      (void)connection.send("status", "{}");
    } catch (const ConnectionLost& error) {
      return error.name() == "disconnected";
    }
    return false;
  }));
  EXPECT_EQ(connection.send("status", "{}"), 1);
  EXPECT_THAT(connection.receive(std::chrono::steady_clock::now() + 10s).json, HasSubstr("result"));
}

}  // namespace
}  // namespace slsd::client
