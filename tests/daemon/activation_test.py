#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A socket that systemd listens at, and hands over: by systemd-socket-activate, which does that part of it."""
import shutil
import signal
import socket
import subprocess
import sys
import unittest

from client import Client
from service import BIN, Service, wait_until

CANNOT_START = 77
WRONG_CONFIGURATION = 78
ACTIVATE = shutil.which("systemd-socket-activate")


def listens(path):
    """It is there as soon as it is bound, and refuses who comes before it listens."""
    accepts = "00010000"  # among the flags of net/unix
    with open("/proc/net/unix", encoding="utf-8") as sockets:
        return any(line.split()[3] == accepts and line.split()[-1] == str(path) for line in sockets)


class Activation(unittest.TestCase):
    def activate(self, service, at):
        """Listens, and starts the service at the first connection."""
        with open(service.log, "ab") as log:
            process = subprocess.Popen([ACTIVATE, "-l", str(at), BIN / "slsd", "--config", service.file], stderr=log)
        self.addCleanup(lambda: (process.kill(), process.wait()))
        wait_until(lambda: listens(at), "the socket")
        return process

    def test_answers_who_connected_before_it_ran(self):
        service = Service()
        process = self.activate(service, service.socket)
        with Client(service.socket) as client:
            self.assertTrue(client.call("scan", format="ply")[0]["points"] > 0)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(600), 0)
        self.assertTrue(service.socket.exists(), "it is systemd's to remove")

    def test_takes_what_waits_from_one_that_was_killed(self):
        service = Service()
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(service.socket))
            listening.listen()

            def start():
                """As systemd does: the socket as descriptor 3, and its own number in the environment."""
                code = f"import os; os.dup2({listening.fileno()}, 3); os.set_inheritable(3, True); " \
                       f"os.environ.update(LISTEN_FDS='1', LISTEN_PID=str(os.getpid())); " \
                       f"os.execv('{BIN / 'slsd'}', ['slsd', '--config', '{service.file}'])"
                with open(service.log, "ab") as log:
                    return subprocess.Popen([sys.executable, "-c", code], stderr=log, pass_fds=[listening.fileno()])

            first = start()
            with Client(service.socket) as client:
                client.call("status")
            first.kill()
            first.wait()
            with Client(service.socket) as client:  # nobody is there to answer yet
                second = start()
                self.addCleanup(lambda: (second.kill(), second.wait()))
                self.assertTrue(client.call("scan", format="ply")[0]["points"] > 0)

    def test_names_a_socket_elsewhere(self):
        service = Service()
        elsewhere = service.folder / "elsewhere.sock"
        process = self.activate(service, elsewhere)
        with socket.socket(socket.AF_UNIX) as knock:
            knock.connect(str(elsewhere))
            self.assertEqual(process.wait(600), WRONG_CONFIGURATION)
        self.assertIn(f"systemd listens on {elsewhere} for this service", service.log_text())


if __name__ == "__main__":
    if not ACTIVATE:
        sys.exit(CANNOT_START)
    unittest.main(verbosity=2)
