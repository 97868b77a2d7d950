# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A service that is simulated: it answers what a test wants, true or not."""
import array
import json
import pathlib
import socket
import tempfile
import threading


def ply(count, said=None, lines=("property float x", "property float y", "property float z")):
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {count if said is None else said}", *lines]
    return "\n".join([*head, "end_header\n"]).encode() + bytes(12 * count)


class Impostor:
    """Listens where slsd would, and answers each request by a function of it that gives bytes."""

    def __init__(self, answer, descriptor=None, hangs_up=False):
        self.hangs_up = hangs_up
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name) / "slsd.sock"
        self.answer, self.descriptor = answer, descriptor
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(self.path))
        self.listener.listen()
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        try:
            while True:
                peer, _ = self.listener.accept()
                threading.Thread(target=self.talk, args=(peer,), daemon=True).start()
        except OSError:
            pass

    def talk(self, peer):
        with peer, peer.makefile("rb") as lines:
            for line in lines:
                data = self.answer(json.loads(line))
                passed = [] if self.descriptor is None else [
                    (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [self.descriptor]))]
                try:
                    peer.sendmsg([data], passed)
                except OSError:  # the client is gone
                    return
                if self.hangs_up:
                    return

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.close()
        self.folder.cleanup()


def result(request, body=b"", **values):
    return json.dumps({"jsonrpc": "2.0", "id": request["id"], "result": values}).encode() + b"\n" + body
