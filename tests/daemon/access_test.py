#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Who may do what: users that are not the service's own, at a real service."""
import json
import os
import pwd
import socket
import time
import unittest

from client import RpcError
from service import Service

STRANGER = pwd.getpwnam("nobody")
OTHER = pwd.getpwnam("daemon")
DOT = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg=="  # a PNG


def as_user(user, act):
    """What a function gives in a process of that user; forked, as an interpreter may lie where only root can read."""
    ours, theirs = socket.socketpair()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.setgroups([])
            os.setgid(user.pw_gid)
            os.setuid(user.pw_uid)
            theirs.sendall(json.dumps(act()).encode())
            status = 0
        finally:
            os._exit(status)
    theirs.close()
    with ours:
        text = b"".join(iter(lambda: ours.recv(65536), b""))
    os.waitpid(child, 0)
    return json.loads(text)


def ask_once(connection, path, method):
    connection.connect(str(path))
    try:
        connection.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "method": method}).encode() + b"\n")
    except BrokenPipeError:
        pass  # who is turned away is told why before
    with connection.makefile("rb") as stream:
        return json.loads(stream.readline())


def ask(service, user, method):
    def once():
        with socket.socket(socket.AF_UNIX) as connection:
            return ask_once(connection, service.socket, method)

    reply = as_user(user, once)
    return reply["error"] if "error" in reply else reply["result"]


@unittest.skipUnless(os.geteuid() == 0, "only root can ask as somebody else")
class Access(unittest.TestCase):
    def service(self, server):
        service = Service(server="socket_mode = 0o666\n" + server)
        service.folder.chmod(0o755)
        return service

    def test_whoever_can_open_the_socket_scans_and_administers_nothing(self):
        with self.service("") as service:
            service.wait_ready()
            status = ask(service, STRANGER, "status")
            self.assertEqual(status["role"], "scan")
            self.assertIn("pattern", ask(service, STRANGER, "settings"))
            for method in ("reload", "project", "set", "calibrate", "bundle"):
                error = ask(service, STRANGER, method)
                self.assertEqual(error["data"]["name"], "permission_denied")
                self.assertIn(f'"{method}" needs the role "administer", but user {STRANGER.pw_uid} has "scan"',
                              error["message"])
            with service.client() as client:
                self.assertEqual(client.call("status")[0]["role"], "administer")
                client.call("reload")
            log = service.log_text()
            self.assertIn(f"user {STRANGER.pw_uid}) asked for reload, which needs the role \"administer\": refused", log)
            self.assertIn("reload: by user 0 (process", log)

    def test_roles_are_given_by_name(self):
        with self.service('observe = ["*"]\nscan = ["daemon"]\nadminister = ["@daemon"]') as service:
            service.wait_ready()
            self.assertEqual(ask(service, STRANGER, "status")["role"], "observe")
            error = ask(service, STRANGER, "frame")
            self.assertEqual(error["data"]["name"], "permission_denied")
            self.assertIn("[server] scan", error["message"])
            self.assertEqual(ask(service, OTHER, "status")["role"], "administer")
            self.assertNotIn("message", ask(service, OTHER, "reload"))

    def test_who_has_no_role_is_told_so(self):
        with self.service('observe = ["daemon"]\nscan = []\nadminister = []') as service:
            error = ask(service, STRANGER, "status")
            self.assertEqual(error["data"]["name"], "permission_denied")
            self.assertIn("may not use this scanner: let an administrator add you to [server] observe", error["message"])

    def test_one_user_gets_no_more_places_than_are_left(self):
        with self.service("clients_max = 16") as service:
            def fill():
                held = [socket.socket(socket.AF_UNIX) for _ in range(12)]
                taken = ["error" not in ask_once(each, service.socket, "status") for each in held]
                for each in held:
                    each.close()
                return taken

            self.assertEqual(as_user(STRANGER, fill), [True] * 8 + [False] * 4)

    def test_one_user_has_only_so_many_pictures_shown_a_second(self):
        request = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "project", "params": {"picture": "image", "png": DOT}})
        request = request.encode() + b"\n"
        with self.service('administer = ["daemon"]') as service:
            service.wait_ready()

            def show():
                with socket.socket(socket.AF_UNIX) as connection:
                    connection.connect(str(service.socket))
                    with connection.makefile("rwb") as stream:
                        def one():
                            stream.write(request)
                            stream.flush()
                            return json.loads(stream.readline())
                        begin = time.monotonic()
                        replies = [one() for _ in range(200)]
                        took = time.monotonic() - begin
                        time.sleep(0.5)
                        return took, [reply["error"]["data"]["name"] for reply in (*replies, one())]

            took, (*names, later) = as_user(OTHER, show)
            self.assertLessEqual(set(names), {"mismatch", "busy"})  # a busy machine may be too slow to be refused
            self.assertEqual(set(names[:30]), {"mismatch"})  # which is of the picture: it was looked at
            self.assertLessEqual(names.count("mismatch"), 31 + 30 * took)
            self.assertEqual(later, "mismatch")

    def test_a_group_that_nobody_made_is_an_error_and_the_old_state_stays(self):
        with self.service("") as service, service.client() as client:
            service.configure(server='socket_mode = 0o666\nscan = ["@nobody-made-this"]')
            with self.assertRaises(RpcError) as refused:
                client.call("reload")
            self.assertEqual(refused.exception.name, "not_found")
            self.assertIn('scan names the group "nobody-made-this", which does not exist on this host',
                          str(refused.exception))
            self.assertEqual(ask(service, STRANGER, "status")["role"], "scan")


if __name__ == "__main__":
    unittest.main(verbosity=2)
