# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Xorg with the dummy driver: an operator's monitor, DUMMY0, and a projector, DUMMY1, that is plugged in and out."""
import ctypes
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile

XORG = "/usr/lib/xorg/Xorg"
ALL_PLANES = 2 ** 64 - 1
Z_PIXMAP = 2
# Else xrandr rounds the desktop's millimetres down at each change, after some two hundred to none, which X refuses.
FIXED_DPI = ("--dpi", "96")
CONFIGURATION = """
Section "ServerFlags"
  Option "AutoAddDevices" "false"
  Option "AutoAddGPU" "false"
EndSection
Section "Device"
  Identifier "dummy"
  Driver "dummy"
  VideoRam 131072
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5.0 - 1000.0
  VertRefresh 5.0 - 200.0
  Modeline "1280x800" 83.50 1280 1352 1480 1680 800 803 809 831
EndSection
Section "Screen"
  Identifier "screen"
  Device "dummy"
  Monitor "monitor"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Modes "1024x768" "1280x800"
  EndSubSection
EndSection
"""


class XImage(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_int) for name in ("width", "height", "xoffset", "format")), ("data", ctypes.c_void_p),
                *((name, ctypes.c_int) for name in ("byte_order", "unit", "bit_order", "pad", "depth", "bytes_per_line"))]


class XServer:
    """Raises OSError where it does not start. Its display has a number that no other server takes by itself: those take
    the lowest that is free, which would be that of one that is about to be started again."""

    x11 = ctypes.CDLL("libX11.so.6")
    started = 0

    def __init__(self, display=None):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        (self.folder / "xorg.conf").write_text(CONFIGURATION, encoding="utf-8")
        XServer.started += 1
        own = f":{1000 + (16 * os.getpid() + XServer.started) % 50000}"
        arguments = [display or own, "-config", str(self.folder / "xorg.conf"), "-configdir", str(self.folder / "none"),
                     "-logfile", str(self.folder / "log"), "-nolisten", "tcp", "-noreset", "-displayfd", "1"]
        self.process = subprocess.Popen([XORG, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        number = self.process.stdout.readline().strip()
        self.display = ":" + number
        if not number:
            self.close()
            raise OSError("Xorg with the dummy driver does not start (xserver-xorg-video-dummy)")

    def xrandr(self, *arguments):
        subprocess.run(["xrandr", "--display", self.display, *arguments], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    def plug(self):
        self.xrandr("--addmode", "DUMMY1", "1280x800")
        self.xrandr(*FIXED_DPI, "--output", "DUMMY1", "--mode", "1280x800", "--right-of", "DUMMY0")
        self.xrandr("--query")  # lets the driver look for monitors

    def unplug(self):
        self.xrandr(*FIXED_DPI, "--output", "DUMMY1", "--off")

    def screenshot(self, left, top, width, height):
        """One byte to a pixel, its green."""
        self.x11.XOpenDisplay.restype = ctypes.c_void_p
        self.x11.XGetImage.restype = ctypes.POINTER(XImage)
        display = ctypes.c_void_p(self.x11.XOpenDisplay(self.display.encode()))
        root = ctypes.c_ulong(self.x11.XDefaultRootWindow(display))
        image = self.x11.XGetImage(display, root, left, top, width, height, ctypes.c_ulong(ALL_PLANES), Z_PIXMAP)
        rows = ctypes.string_at(image.contents.data, image.contents.bytes_per_line * height)
        self.x11.XDestroyImage(image)
        self.x11.XCloseDisplay(display)
        return rows[1::4]

    def freeze(self):
        """Lets it hang: it takes connections and answers nothing."""
        self.process.send_signal(signal.SIGSTOP)

    def thaw(self):
        self.process.send_signal(signal.SIGCONT)

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def can_start():
    """False, with the reason printed, where this machine or user can start none."""
    try:
        server = XServer()
    except OSError as error:
        print(error)
        return False
    try:
        server.plug()
    except (OSError, subprocess.CalledProcessError) as error:
        print("xrandr plugs no monitor in (x11-xserver-utils):", error)
        return False
    finally:
        server.close()
    return True
