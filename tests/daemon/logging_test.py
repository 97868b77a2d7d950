#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The log of the whole service, and readers of it that stand still. With --seconds it goes on for so long."""
import argparse
import fcntl
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from client import RpcError
from service import BIN, TIMEOUT_S, Service, wait_until

F_SETPIPE_SZ = 1031
PRIVATE_RUN = ["unshare", "--mount", "--map-root-user", "sh", "-c", 'mount --bind "$0" /run && exec "$@"']
QUEUE = 1024
LONGEST = 2048
SECONDS = 0.0
DEVICE_LOST = "4d5bfa985efe404790a7f9fc62e585d8"  # as systemd/slsd.catalog has them, for good
SCAN_FAILED = "aa8fd2b94774407b8c04099fd35bb9fd"


class FullPipe(Service):
    """A service whose standard error is a pipe that nobody reads."""

    def launch(self):
        self.reader, writer = os.pipe()
        fcntl.fcntl(writer, F_SETPIPE_SZ, 4096)
        self.process = subprocess.Popen([BIN / "slsd", "--config", self.file], stderr=writer, env=self.environment)
        os.close(writer)

    def start(self):
        self.launch()
        wait_until(self.socket.exists, "the socket")
        return self

    def read_on(self):
        """Reads what is there and what comes, in the background."""
        text = bytearray()

        def read():
            while chunk := os.read(self.reader, 65536):
                text.extend(chunk)
        threading.Thread(target=read, daemon=True).start()
        return text


class Journaled(Service):
    """A service in whose view of /run the journal is ours."""

    def launch(self):
        run = self.folder / "run"
        (run / "systemd/journal").mkdir(parents=True)
        self.journal = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.journal.bind(str(run / "systemd/journal/socket"))
        self.journal.settimeout(TIMEOUT_S)
        with open(self.log, "ab") as log:
            about = os.fstat(log.fileno())
            self.process = subprocess.Popen(
                [*PRIVATE_RUN, run, BIN / "slsd", "--config", self.file], stderr=log,
                env={**self.environment, "JOURNAL_STREAM": f"{about.st_dev}:{about.st_ino}"})

    def entries(self, *patterns):
        """The fields of the next line for each of the patterns, which it begins with, in whatever order they come."""
        found = {}
        while len(found) < len(patterns):
            fields = dict(line.split("=", 1) for line in self.journal.recv(65536).decode().splitlines())
            for pattern in patterns:
                if pattern not in found and re.match(pattern, fields["MESSAGE"]):
                    found[pattern] = fields
        return [found[pattern] for pattern in patterns]


def refuse_reloads(client, count):
    """Each is a line of the log, with what a file says in it."""
    for _ in range(count):
        try:
            client.call("reload")
        except RpcError:
            pass


class Log(unittest.TestCase):
    def flood(self, service, client):
        good = service.file.read_text(encoding="utf-8")
        service.file.write_text('"a\\n<2>kernel panic ' + "x" * 900_000 + '" = 1\n', encoding="utf-8")
        refuse_reloads(client, 3)
        service.file.write_text("x = \n", encoding="utf-8")
        refuse_reloads(client, 3 * QUEUE)
        service.file.write_text(good, encoding="utf-8")

    def test_a_reader_that_stands_still_holds_nothing_up(self):
        with FullPipe() as service, service.client() as client:
            end = time.monotonic() + SECONDS
            self.flood(service, client)
            while time.monotonic() < end:
                self.flood(service, client)
            status = client.call("status")[0]
            self.assertGreater(status["log_lines_dropped"], QUEUE)
            self.assertGreater(client.call("scan")[0]["points"], 2000)
            text = service.read_on()
            wait_until(lambda: b"lines of the log were dropped here" in text, "the line that tells it")
            told = re.search(rb"(\d+) lines of the log were dropped here", text)
            self.assertEqual(int(told[1]), client.call("status")[0]["log_lines_dropped"])
            lines = bytes(text).split(b"\n")
            self.assertLess(max(map(len, lines)), LONGEST)
            self.assertFalse([line for line in lines if line.startswith(b"<2>")])
            status, _ = service.stop()
            self.assertEqual(status, 0)
            wait_until(lambda: text.rstrip().endswith(b"stopped"), "the last line")

    def test_a_reader_that_stands_still_does_not_delay_the_end(self):
        with Service() as usual:
            _, usual_s = usual.stop()
        with FullPipe() as service, service.client() as client:
            self.flood(service, client)
            status, seconds = service.stop()
            self.assertEqual(status, 0)
            self.assertLess(seconds, 10 * usual_s + 5)
            print(f"ends after {seconds:.2f} s, usually {usual_s:.2f} s")

    def test_a_reader_that_is_gone_does_not_matter(self):
        with FullPipe() as service, service.client() as client:
            os.close(service.reader)
            self.flood(service, client)
            self.assertGreater(client.call("scan")[0]["points"], 2000)
            self.assertEqual(service.stop()[0], 0)

    def test_another_programs_journal_is_not_taken_for_ours(self):
        with Service(environment={"JOURNAL_STREAM": "1:1"}) as service:
            wait_until(lambda: "ready at" in service.log_text(), "the line")
            self.assertRegex(service.log_text(), r"(?m)^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z info    slsd ")

    def test_priorities_are_told_where_the_journal_reads(self):
        service = Service()
        with open(service.log, "wb") as log:
            about = os.fstat(log.fileno())
        service.environment["JOURNAL_STREAM"] = f"{about.st_dev}:{about.st_ino}"
        if os.access("/run/systemd/journal/socket", os.W_OK):
            self.skipTest("here it goes to the journal itself")
        with service:
            wait_until(lambda: "ready at" in service.log_text(), "the line")
            self.assertRegex(service.log_text(), r"(?m)^<6>slsd .* starts with ")

    def test_the_journal_has_fields_of_what_a_line_is_about(self):
        with tempfile.TemporaryDirectory() as empty:
            if subprocess.run([*PRIVATE_RUN, empty, "true"], stderr=subprocess.DEVNULL, check=False).returncode:
                self.skipTest("this machine gives no mount namespace")
        with Journaled(camera='faults = ["disconnect@2"]') as service, service.client() as client, service.journal:
            (starts,) = service.entries("slsd .* starts with ")
            self.assertEqual(starts["SYSLOG_IDENTIFIER"], "slsd")
            (ready,) = service.entries(".*ready at ")
            self.assertEqual(ready["PRIORITY"], "6")
            client.call("scan")
            with self.assertRaises(RpcError):
                client.call("scan")
            lost, failed = service.entries("camera camera: ", r"scan \S+ failed \(disconnected\)")  # of two threads
            self.assertEqual((lost["SLSD_CAMERA"], lost["SLSD_ERROR"], lost["PRIORITY"]), ("camera", "disconnected", "4"))
            self.assertEqual(failed["SLSD_ERROR"], "disconnected")
            self.assertEqual((lost["MESSAGE_ID"], failed["MESSAGE_ID"]), (DEVICE_LOST, SCAN_FAILED))
            self.assertTrue(failed["MESSAGE"].startswith(f"scan {failed['SLSD_SCAN']} failed"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.0)
    options, rest = parser.parse_known_args()
    SECONDS = options.seconds
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
