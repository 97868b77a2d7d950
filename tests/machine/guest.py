# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A guest of QEMU with Debian's kernel, its second monitor, and what it shows. make_guest.sh makes its disk."""
import contextlib
import itertools
import json
import pathlib
import queue
import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import time

from machine import ENVIRONMENT, Machine, require, wait_for

BOOT_S = 600
SECOND_HEAD = 1


def accelerator():
    """An openable /dev/kvm proves nothing: where the processor lends no virtualization it is slower than none."""
    flags = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    if pathlib.Path("/dev/kvm").exists() and {"vmx", "svm"} & set(flags):
        return ["-accel", "kvm", "-cpu", "host"]
    return ["-accel", "tcg,thread=multi,tb-size=512", "-cpu", "max"]


def connect(path, timeout_s=30):
    end = time.monotonic() + timeout_s
    while True:
        with contextlib.suppress(OSError):
            client = socket.socket(socket.AF_UNIX)
            client.connect(str(path))
            return client
        require(time.monotonic() < end, f"QEMU does not open {path}")
        time.sleep(0.1)


def receive(client, size):
    data = b""
    while len(data) < size:
        part = client.recv(size - len(data))
        require(part, "QEMU hung up")
        data += part
    return data


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
                 "-chardev", f"socket,id=agent,path={at}/agent,server=on,wait=off", "-device", "virtserialport,chardev=agent,name=slsd.agent",
                 "-device", "virtio-vga,id=screen,max_outputs=2,xres=1024,yres=768", "-vnc", f"unix:{at}/monitor,display=screen,head=1",
                 "-qmp", f"unix:{at}/qmp,server=on,wait=off"],
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

    def reboot(self):
        self.start("systemctl", "reboot")
        self.wait_until_booted()

    def plug_monitor(self, width, height):
        """The second head, as RFB's SetDesktopSize has it; of no size it is unplugged. Its EDID names the size as preferred."""
        with contextlib.closing(connect(self.folder / "monitor")) as client:
            receive(client, 12)
            client.sendall(b"RFB 003.008\n")
            receive(client, receive(client, 1)[0])
            client.sendall(b"\x01")  # no password
            receive(client, 4)
            client.sendall(b"\x01")  # shared
            receive(client, 20)
            receive(client, struct.unpack(">I", receive(client, 4))[0])
            client.sendall(struct.pack(">BBHi", 2, 0, 1, -308))  # ExtendedDesktopSize
            time.sleep(0.3)
            client.sendall(struct.pack(">BBHHBB", 251, 0, width, height, 1, 0) + struct.pack(">IHHHHI", 0, 0, 0, width, height, 0))
            time.sleep(0.7)

    def unplug_monitor(self):
        self.plug_monitor(0, 0)

    def screen(self, head=SECOND_HEAD):
        """@return width, height and the bytes of red, green and blue that the head shows"""
        path = self.folder / "screen.ppm"
        with contextlib.closing(connect(self.folder / "qmp")) as client, client.makefile("rw", encoding="utf-8") as lines:
            for asked in ({"execute": "qmp_capabilities"},
                          {"execute": "screendump", "arguments": {"filename": str(path), "device": "screen", "head": head}}):
                lines.readline()
                lines.write(json.dumps(asked) + "\n")
                lines.flush()
            while "return" not in (answer := json.loads(lines.readline())):
                require("error" not in answer, str(answer))
        kind, width, height, _, pixels = path.read_bytes().split(None, 4)
        require(kind == b"P6", "not a PPM")
        return int(width), int(height), pixels
