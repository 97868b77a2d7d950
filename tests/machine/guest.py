# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A guest of QEMU with Debian's kernel, whose disk make_guest.sh makes."""
import contextlib
import itertools
import json
import pathlib
import queue
import shutil
import socket
import subprocess
import tempfile
import threading
import time

from machine import ENVIRONMENT, Machine, require, wait_for

BOOT_S = 600


def accelerator():
    """An openable /dev/kvm proves nothing: where the processor lends no virtualization it is slower than none."""
    flags = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    if pathlib.Path("/dev/kvm").exists() and {"vmx", "svm"} & set(flags):
        return ["-accel", "kvm", "-cpu", "host"]
    return ["-accel", "tcg,thread=multi,tb-size=512", "-cpu", "max"]


def connect(path, patience_s=30):
    end = time.monotonic() + patience_s
    while True:
        with contextlib.suppress(OSError):
            client = socket.socket(socket.AF_UNIX)
            client.connect(str(path))
            return client
        require(time.monotonic() < end, f"QEMU does not open {path}")
        time.sleep(0.1)


class Running:
    def __init__(self, words):
        self.words, self.answer = words, queue.Queue()

    def finish(self, seconds):
        try:
            answer = self.answer.get(timeout=seconds)
        except queue.Empty:
            raise TimeoutError(f"{' '.join(self.words)}: not within {seconds:.0f} s") from None
        return answer["status"], answer["output"]


class Guest(Machine):
    has_drivers = True

    def __init__(self, folder, packages):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-guest-"))
        self.numbers, self.running, self.ready = itertools.count(), {}, threading.Semaphore(0)
        self.qemu = None
        try:
            self.put_packages(packages)
            self.boot(folder)
        except BaseException:
            self.close()
            raise

    def put_packages(self, packages):
        disk = self.folder / "packages.img"
        with open(disk, "wb") as file:
            file.truncate(256 << 20)
        subprocess.run(["mke2fs", "-q", "-t", "ext4", "-O", "^has_journal,^metadata_csum,^64bit", "-m0", "-d", packages, disk], check=True)

    def boot(self, folder):
        at = self.folder
        with open(at / "log", "wb") as log:
            self.qemu = subprocess.Popen(
                ["qemu-system-x86_64", "-M", "q35", *accelerator(), "-smp", "2", "-m", "1536", "-nodefaults", "-no-user-config",
                 "-display", "none", "-monitor", "none", "-serial", f"file:{at}/console", "-kernel", folder / "vmlinuz",
                 "-initrd", folder / "initrd.img", "-append", "console=ttyS0 quiet net.ifnames=0 mitigations=off panic=-1",
                 "-drive", f"file={folder}/disk.img,format=raw,if=virtio,snapshot=on,cache=unsafe",
                 "-drive", f"file={at}/packages.img,format=raw,if=virtio,snapshot=on,cache=unsafe",
                 "-device", "virtio-rng-pci", "-device", "virtio-serial",
                 "-chardev", f"socket,id=agent,path={at}/agent,server=on,wait=off", "-device", "virtserialport,chardev=agent,name=slsd.agent"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.port = connect(at / "agent")
        threading.Thread(target=self.listen, daemon=True).start()
        self.wait_until_booted()

    def wait_until_booted(self):
        require(self.ready.acquire(timeout=BOOT_S), f"no boot in {BOOT_S} s; see {self.folder}/console")
        wait_for(lambda: self.run("systemctl", "is-system-running", check=False)[1].strip() in ("running", "degraded"), "the boot")

    def listen(self):
        with contextlib.suppress(OSError), self.port.makefile("r", encoding="utf-8", errors="replace") as lines:
            for line in lines:
                with contextlib.suppress(ValueError, KeyError):
                    answer = json.loads(line)
                    if answer.get("ready"):
                        self.ready.release()
                    else:
                        self.running.pop(answer["number"]).answer.put(answer)

    def close(self):
        if self.qemu and self.qemu.poll() is None:
            self.qemu.kill()
            self.qemu.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start_as_root(self, arguments, text):
        number, started = next(self.numbers), Running([str(word) for word in arguments])
        self.running[number] = started
        asked = {"number": number, "command": started.words, "text": text, "environment": ENVIRONMENT}
        self.port.sendall(json.dumps(asked).encode() + b"\n")
        return started
