// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#define FUSE_USE_VERSION 35
#include "tests/doubles/v4l2/fuse_file.hpp"

#include <fcntl.h>
#include <fuse3/fuse_lowlevel.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace slsd::test {
namespace {

constexpr const char* kName = "video0";
constexpr off_t kFileBytes = off_t{1} << 40;  // every offset that a buffer can have
constexpr std::size_t kArgumentMax = 1 << 14;

struct stat status_of(fuse_ino_t inode) {
  struct stat status {};
  status.st_ino = inode;
  status.st_mode = inode == FUSE_ROOT_ID ? S_IFDIR | 0755 : S_IFREG | 0660;
  status.st_nlink = 1;
  status.st_uid = getuid();
  status.st_gid = getgid();
  status.st_size = inode == FUSE_ROOT_ID ? 0 : kFileBytes;
  return status;
}

}  // namespace

/// An open descriptor.
struct FuseFile::Handle {
  std::shared_ptr<DoubleDevice> device;
  std::uint64_t inode = 0;
  bool blocking = true;
  fuse_pollhandle* poll = nullptr;
  fuse_req_t dequeue = nullptr;  ///< a DQBUF that waits for a frame
  v4l2_buffer argument{};
};

/// What the kernel asks for.
struct FuseFile::Operations {
  static FuseFile& self(fuse_req_t request) { return *static_cast<FuseFile*>(fuse_req_userdata(request)); }
  static Handle& handle(const fuse_file_info* file) { return *reinterpret_cast<Handle*>(file->fh); }

  static void lookup(fuse_req_t request, fuse_ino_t parent, const char* name) {
    FuseFile& file = self(request);
    const std::lock_guard lock(file.mutex_);
    if (parent != FUSE_ROOT_ID || std::strcmp(name, kName) != 0 || !file.device_) {
      fuse_reply_err(request, ENOENT);
      return;
    }
    fuse_entry_param entry{};
    entry.ino = file.inode();
    entry.attr = status_of(entry.ino);
    fuse_reply_entry(request, &entry);
  }

  static void getattr(fuse_req_t request, fuse_ino_t inode, fuse_file_info*) {
    const struct stat status = status_of(inode);
    fuse_reply_attr(request, &status, 0);
  }

  static void open(fuse_req_t request, fuse_ino_t inode, fuse_file_info* info) {
    FuseFile& file = self(request);
    const std::lock_guard lock(file.mutex_);
    if (!file.device_ || inode != file.inode()) {
      fuse_reply_err(request, ENODEV);
      return;
    }
    auto opened = std::make_unique<Handle>();
    opened->device = file.device_;
    opened->inode = inode;
    opened->blocking = (info->flags & O_NONBLOCK) == 0;
    info->fh = reinterpret_cast<std::uint64_t>(opened.get());
    info->keep_cache = 1;
    if (fuse_reply_open(request, info) == 0) file.handles_.insert(opened.release());
  }

  static void release(fuse_req_t request, fuse_ino_t, fuse_file_info* info) {
    FuseFile& file = self(request);
    const std::unique_ptr<Handle> closed(
        &handle(info));  // a device that ends with it joins a thread that may need the lock
    const std::lock_guard lock(file.mutex_);
    file.handles_.erase(closed.get());
    if (closed->poll != nullptr) fuse_pollhandle_destroy(closed->poll);
    closed->device->release(closed.get());
    fuse_reply_err(request, 0);
  }

  static void read(fuse_req_t request, fuse_ino_t, std::size_t bytes, off_t offset, fuse_file_info* info) {
    const auto content = handle(info).device->read(static_cast<std::uint64_t>(offset), bytes);
    fuse_reply_buf(request, reinterpret_cast<const char*>(content.data()), content.size());
  }

  static void poll(fuse_req_t request, fuse_ino_t, fuse_file_info* info, fuse_pollhandle* poll) {
    FuseFile& file = self(request);
    const std::lock_guard lock(file.mutex_);
    Handle& polled = handle(info);
    if (poll != nullptr) {
      if (polled.poll != nullptr) fuse_pollhandle_destroy(polled.poll);
      polled.poll = poll;
    }
    ++file.polls_;  // before the answer, after which the caller may go on
    fuse_reply_poll(request, polled.device->poll(&polled));
  }

  static void ioctl(fuse_req_t request, fuse_ino_t, unsigned command, void*, fuse_file_info* info, unsigned,
                    const void* in, std::size_t in_bytes, std::size_t out_bytes) {
    FuseFile& file = self(request);
    const std::lock_guard lock(file.mutex_);
    if (in_bytes > kArgumentMax || out_bytes > kArgumentMax) {
      fuse_reply_err(request, EINVAL);
      return;
    }
    alignas(std::max_align_t) std::array<std::byte, kArgumentMax> argument{};
    if (in_bytes > 0) std::memcpy(argument.data(), in, in_bytes);
    Handle& called = handle(info);
    const int error = called.device->ioctl(&called, command, argument.data(), fuse_req_ctx(request)->pid);
    if (error == EAGAIN && command == VIDIOC_DQBUF && called.blocking) {
      wait(request, called, argument.data());
    } else if (error != 0) {
      fuse_reply_err(request, error);
    } else {
      fuse_reply_ioctl(request, 0, argument.data(), out_bytes);
    }
  }

  static void wait(fuse_req_t request, Handle& handle, const void* argument) {
    if (handle.dequeue != nullptr) {
      fuse_reply_err(request, EBUSY);
      return;
    }
    std::memcpy(&handle.argument, argument, sizeof handle.argument);
    handle.dequeue = request;
    fuse_req_interrupt_func(request, interrupt, &handle);
  }

  static void interrupt(fuse_req_t request, void* waiting) {
    const std::lock_guard lock(self(request).mutex_);
    auto& handle = *static_cast<Handle*>(waiting);
    if (handle.dequeue != request) return;
    handle.dequeue = nullptr;
    fuse_reply_err(request, EINTR);
  }
};

Result<std::unique_ptr<FuseFile>> FuseFile::mount(const std::string& folder) {
  std::unique_ptr<FuseFile> file(new FuseFile);
  fuse_lowlevel_ops operations{};
  operations.lookup = Operations::lookup;
  operations.getattr = Operations::getattr;
  operations.open = Operations::open;
  operations.release = Operations::release;
  operations.read = Operations::read;
  operations.poll = Operations::poll;
  operations.ioctl = Operations::ioctl;
  std::array<char*, 2> words{const_cast<char*>("v4l2-double"), nullptr};
  fuse_args arguments = FUSE_ARGS_INIT(1, words.data());
  file->session_ = fuse_session_new(&arguments, &operations, sizeof operations, file.get());
  fuse_opt_free_args(&arguments);
  if (file->session_ == nullptr || access("/dev/fuse", R_OK | W_OK) != 0 ||
      fuse_session_mount(file->session_, folder.c_str()) != 0)
    return fail(ErrorCode::kUnsupported, "this user cannot mount FUSE files on this machine", "/dev/fuse");
  file->end_ = eventfd(0, EFD_CLOEXEC);
  file->thread_ = std::jthread([serving = file.get()] { serving->serve(); });
  return file;
}

// Not fuse_session_loop(): that ends only when the mount does, which a mapping that is held still keeps.
void FuseFile::serve() {
  fuse_buf request{};
  std::array<pollfd, 2> files{pollfd{fuse_session_fd(session_), POLLIN, 0}, pollfd{end_, POLLIN, 0}};
  while (::poll(files.data(), files.size(), -1) > 0 && files[1].revents == 0) {
    const int bytes = fuse_session_receive_buf(session_, &request);
    if (bytes == -EINTR || bytes == -EAGAIN) continue;
    if (bytes <= 0) break;
    fuse_session_process_buf(session_, &request);
  }
  std::free(request.mem);
}

FuseFile::~FuseFile() {
  if (session_ == nullptr) return;
  plug(nullptr);
  if (thread_.joinable()) {
    [[maybe_unused]] const int woken = eventfd_write(end_, 1);
    thread_.join();
    fuse_session_unmount(session_);
  }
  if (end_ >= 0) close(end_);
  for (Handle* handle : handles_) {
    if (handle->poll != nullptr) fuse_pollhandle_destroy(handle->poll);
    delete handle;
  }
  fuse_session_destroy(session_);
}

DoubleDevice::Hooks FuseFile::hooks() {
  const std::lock_guard lock(mutex_);
  const std::uint64_t next_inode = inode() + 1;
  return {[this, next_inode](std::uint64_t offset, std::span<const std::byte> bytes) {
            fuse_bufvec buffer = FUSE_BUFVEC_INIT(bytes.size());
            buffer.buf[0].mem = const_cast<std::byte*>(bytes.data());
            fuse_lowlevel_notify_store(session_, next_inode, static_cast<off_t>(offset), &buffer, {});
          },
          [this] { answer_waiting(); }};
}

void FuseFile::plug(std::shared_ptr<DoubleDevice> device) {
  const std::lock_guard lock(mutex_);
  if (device) ++lives_;
  device_.swap(device);
}

std::uint64_t FuseFile::inode() const {
  return FUSE_ROOT_ID + lives_;
}

void FuseFile::answer_waiting() {
  const std::lock_guard lock(mutex_);
  for (Handle* handle : handles_) {
    if (handle->poll != nullptr && handle->device->poll(handle) != 0) fuse_lowlevel_notify_poll(handle->poll);
    if (handle->dequeue == nullptr) continue;
    const int error = handle->device->ioctl(handle, VIDIOC_DQBUF, &handle->argument, 0);
    if (error == EAGAIN) continue;
    fuse_req_t request = std::exchange(handle->dequeue, nullptr);
    if (error != 0) {
      fuse_reply_err(request, error);
    } else {
      fuse_reply_ioctl(request, 0, &handle->argument, sizeof handle->argument);
    }
  }
}

}  // namespace slsd::test
