# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-tcp as its tests start it, and a client over TCP that shares no code with slsd."""
import pathlib
import re
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "daemon"))
from client import Client, RpcError
from service import BIN, TIMEOUT_S

TOKEN = "correct horse battery staple"


class Tcp:
    """slsd-tcp on a port of its own, before the service's socket or another."""

    def __init__(self, path, *arguments, token=TOKEN):
        self.folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.token_file = pathlib.Path(self.folder.name, "token")
        self.token_file.write_text(token + "\n", encoding="utf-8")
        self.log = open(pathlib.Path(self.folder.name, "log"), "w+", encoding="utf-8")
        self.process = subprocess.Popen([BIN / "slsd-tcp", "--socket", path, "--port", "0", "--token-file", self.token_file, *map(str, arguments)],
                                        stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.told = self.process.stdout.readline()
        self.port = int(re.search(r"port (\d+)$", self.told)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.status = self.process.wait(TIMEOUT_S)
        self.process.stdout.close()
        self.log.close()
        self.folder.cleanup()

    def log_text(self):
        self.log.seek(0)
        return self.log.read()

    def connect(self, address="127.0.0.1", source=None):
        return socket.create_connection((address, self.port), TIMEOUT_S, source_address=source and (source, 0))

    def client(self, token=TOKEN, **options):
        return TcpClient(self.connect(**options), token)

    def say(self, data, **options):
        """What comes back for these bytes until the connection ends."""
        with self.connect(**options) as connection:
            try:
                connection.sendall(data)
            except ConnectionError:
                pass
            answer = b""
            while chunk := connection.recv(65536):
                answer += chunk
            return answer


class TcpClient(Client):
    def __init__(self, connection, token):  # pylint: disable=super-init-not-called
        self.socket = connection
        self.buffer = b""
        self.last_id = 0
        self.events = []
        if token is not None:
            self.call("authenticate", token=token)


__all__ = ["RpcError", "TOKEN", "Tcp", "TcpClient"]
