#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Runs in the guest what guest.py asks for: commands come as lines of JSON by a serial port of virtio, each in a thread."""
import json
import subprocess
import threading

PORT = "/dev/virtio-ports/slsd.agent"


def main():
    with open(PORT, "rb+", buffering=0) as port:
        lock = threading.Lock()

        def say(**answer):
            left = memoryview(json.dumps(answer).encode() + b"\n")
            with lock:
                while left:
                    left = left[port.write(left):]

        def run(asked):
            result = subprocess.run(asked["command"], input=asked["text"], stdin=None if asked["text"] is not None else subprocess.DEVNULL,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                                    env=asked["environment"], cwd="/", check=False)
            say(number=asked["number"], status=result.returncode, output=result.stdout)

        say(ready=True)
        text = b""
        while True:
            text += port.read(65536)
            *lines, text = text.split(b"\n")
            for line in lines:
                threading.Thread(target=run, args=(json.loads(line),), daemon=True).start()


if __name__ == "__main__":
    main()
