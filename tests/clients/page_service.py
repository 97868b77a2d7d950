# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-web as the tests of the page start it, and what they ask it for."""
import http.client
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "daemon"))
from service import BIN, TIMEOUT_S, wait_until

TOKEN = "correct horse battery staple"
# A frame with few pixels: its dense clouds are quickly computed and drawn.
BUST = pathlib.Path(__file__).resolve().parents[1] / "corpus" / "8px-6-bust"
CONFIGURATION = f"""
[pattern]
file = "{BUST}/pattern.toml"
[[camera]]
name = "camera"
driver = "file"
path = "{BUST}/frame.png"
[calibration]
file = "{BUST}/calibration.yml"
[scan]
timeout_ms = 600000
[server]
socket = "slsd.sock"
"""


class Web:
    """slsd-web on a port of its own; it says where it listens."""

    def __init__(self, service, *arguments, port=0, token=None):
        self.runtime = tempfile.mkdtemp(prefix="slsd-test-")
        self.process = subprocess.Popen([BIN / "slsd-web", "--socket", service.socket, "--port", str(port), *map(str, arguments)],
                                        stdout=subprocess.PIPE, text=True, env=self.environment())
        self.told = self.process.stdout.readline()
        self.address = re.search(r"http://\S+", self.told)[0]
        self.port = int(re.search(r":(\d+)/", self.address)[1])
        self.token = token or self.address.split("?token=")[1]
        self.secret = {"Authorization": "Bearer " + self.token}

    def environment(self):
        """Without a folder of systemd's, and with one of its own for the address."""
        inherited = {name: value for name, value in os.environ.items() if name != "RUNTIME_DIRECTORY"}
        return {**inherited, "XDG_RUNTIME_DIR": self.runtime}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()
        shutil.rmtree(self.runtime, ignore_errors=True)

    def ask(self, method, path, body=None, headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT_S)
        try:
            connection.request(method, path, body, self.secret if headers is None else headers)
            response = connection.getresponse()
            return response.status, response.headers, response.read()
        finally:
            connection.close()

    def get(self, path, **headers):
        return self.ask("GET", path, headers={**self.secret, **headers})

    def cloud(self, density, after):
        """The next live cloud. A service that takes more than 10 s for one is asked again, as by the page."""
        while True:
            status, headers, ply = self.get(f"/api/cloud?density={density}&after={after}")
            if status != 204:
                return status, headers, ply

    def post(self, path, **body):
        return self.ask("POST", path, json.dumps(body))

    def log_in(self, token=None):
        """The headers of a browser that has shown the token."""
        status, headers, body = self.ask("POST", "/api/login", json.dumps({"token": token or self.token}), headers={})
        if status != 200:
            raise AssertionError(body)
        return {"Cookie": headers["Set-Cookie"].split(";")[0], "X-Slsd-Page": json.loads(body)["key"]}

    def raw(self, data):
        """What comes back until the connection ends."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=TIMEOUT_S) as connection:
            answer = b""
            try:
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                while chunk := connection.recv(65536):
                    answer += chunk
            except ConnectionError:
                pass
            return answer


def downloaded(folder, pattern, count=1):
    """The files that a browser saved, once they are whole: it keeps the place of each with an empty one."""
    def whole():
        return sorted(file for file in pathlib.Path(folder).glob(pattern) if file.stat().st_size > 0)
    wait_until(lambda: len(whole()) == count, f"{count} of {pattern}")
    return whole()


def name_of(answer):
    return answer[0], json.loads(answer[2])["error"]["name"]


def resident_mib(web):
    with open(f"/proc/{web.process.pid}/status", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024
