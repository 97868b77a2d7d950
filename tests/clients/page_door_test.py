#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-web: who is let in, what is refused, and that neither strangers nor the slow disturb anybody."""
import itertools
import json
import os
import pathlib
import socket
import subprocess
import tempfile
import threading
import time
import unittest

from impostor import Impostor
from page_service import BIN, TIMEOUT_S, TOKEN, Web, name_of, resident_mib
from service import Service, wait_until


class Door(unittest.TestCase):
    def test_the_page_has_a_policy_without_exceptions(self):
        with Service() as service, Web(service) as web:
            for path, kind in {"/": "text/html", "/page.js": "text/javascript", "/page.css": "text/css"}.items():
                status, headers, body = web.get(path)
                self.assertEqual((status, headers["Content-Type"].split(";")[0]), (200, kind))
                self.assertTrue(body.startswith((b"<!DOCTYPE", b"//", b"/*")), body[:20])
                policy = headers["Content-Security-Policy"]
                self.assertIn("default-src 'none'", policy)
                for word in ("unsafe", "data:", "blob:", "http", "*"):
                    self.assertNotIn(word, policy)
            self.assertEqual(web.get("/../../etc/passwd")[0], 404)
            self.assertEqual(web.get("/page/../../../etc/passwd")[0], 404)

    def test_metrics_are_scraped_in_the_older_format_that_they_are_said_to_have(self):
        with Service() as service, Web(service) as web:
            status, headers, body = web.get("/api/metrics")
        self.assertEqual((status, headers["Content-Type"]), (200, "text/plain; version=0.0.4; charset=utf-8"))
        self.assertIn(b"# TYPE slsd_scans_succeeded_total counter\n", body)
        self.assertNotIn(b"# EOF", body)

    def test_only_the_page_itself_may_ask(self):
        with Service() as service, Web(service) as web:
            self.assertEqual(web.get("/api/status")[0], 200)
            for stranger in ({}, {"X-Slsd-Page": "1"}, {"Authorization": "Bearer "}, {"Authorization": "Bearer " + "0" * 48},
                             {"Authorization": "Basic " + web.token}, {"Cookie": f"slsd_session_{web.port}="}):
                for path in ("status", "frame", "preview", "reasons", "cloud?density=symbols&after=0", "past?scan=1", "metrics", "exposure",
                             "calibration", "presets", "boards", "board?name=a", "nothing"):
                    status, name = name_of(web.ask("GET", "/api/" + path, headers=stranger))
                    self.assertEqual((status, name in ("no_token", "wrong_token")), (401, True), (path, stranger))
                for path in ("scan", "project", "set", "preset", "calibrate"):
                    status, name = name_of(web.ask("POST", "/api/" + path, "{}", headers=stranger))
                    self.assertEqual((status, name in ("no_token", "wrong_token")), (401, True), (path, stranger))
            self.assertEqual(name_of(web.get("/api/status", Origin="http://evil.example")), (403, "not_from_the_page"))
            self.assertEqual(name_of(web.get("/api/status", Origin="null")), (403, "not_from_the_page"))
            self.assertEqual(name_of(web.get("/api/status", **{"Sec-Fetch-Site": "cross-site"})),
                             (403, "not_from_the_page"))
            self.assertEqual(name_of(web.get("/api/status", Host="evil.example")), (403, "unknown_host"))
            self.assertEqual(name_of(web.get("/", Host="evil.example:80")), (403, "unknown_host"))
            for origin in (f"http://127.0.0.1:{web.port + 1}", "http://127.0.0.1", f"http://localhost:{web.port}"):
                self.assertEqual(name_of(web.get("/api/status", Origin=origin)), (403, "not_from_the_page"), origin)
            for name in ("localhost", "LocalHost", "127.0.0.1"):
                self.assertEqual(web.get("/api/status", Host=f"{name}:{web.port}", Origin=f"http://{name}:{web.port}")[0], 200)
            self.assertEqual(web.get("/api/status", Host="localhost", Origin="https://localhost:443")[0], 200)  # by a proxy
            with service.client() as client:
                self.assertEqual(client.call("status")[0]["scans"]["succeeded"], 0)

    def test_beyond_loopback_a_token_is_asked_for(self):
        with tempfile.TemporaryDirectory() as folder, Service() as service:
            refused = subprocess.run([BIN / "slsd-web", "--listen", "0.0.0.0"], capture_output=True, text=True, check=False)
            self.assertEqual(refused.returncode, 1)
            self.assertIn("--token-file", refused.stderr)
            file = pathlib.Path(folder, "token")
            file.write_text("short\n", encoding="utf-8")
            refused = subprocess.run([BIN / "slsd-web", "--token-file", file], capture_output=True, text=True, check=False)
            self.assertEqual(refused.returncode, 1)
            file.write_text(TOKEN + "\n", encoding="utf-8")
            with Web(service, "--token-file", file, "--listen", "0.0.0.0", token=TOKEN) as web:
                self.assertNotIn(TOKEN, web.told)
                self.assertEqual(web.ask("GET", "/", headers={})[0], 200)
                self.assertEqual(name_of(web.ask("GET", "/api/status", headers={})), (401, "no_token"))
                session = web.log_in()
                self.assertEqual(web.ask("GET", "/api/status", headers=session)[0], 200)
                answers = [name_of(web.post("/api/login", token=f"{i}")) for i in range(8)]
                self.assertEqual(answers[:5], [(401, "wrong_token")] * 5)
                self.assertEqual(answers[5:], [(429, "too_many_tokens")] * 3)
                self.assertEqual(name_of(web.post("/api/login", token=TOKEN)), (429, "too_many_tokens"))
                self.assertEqual(name_of(web.get("/api/status")), (429, "too_many_tokens"))
                self.assertEqual(web.ask("GET", "/api/status", headers=session)[0], 200)  # who is in stays in

    def test_bad_requests_are_refused_and_disturb_nobody(self):
        with Service() as service, Web(service) as web:
            for answer, expected in {
                    web.ask("POST", "/api/scan", "x" * 100_000): (413, "invalid_request"),
                    web.ask("POST", "/api/scan", "{"): (400, "invalid_request"),
                    web.ask("POST", "/api/scan", "[]"): (400, "invalid_request"),
                    web.post("/api/scan", colour=1): (400, "invalid_params"),
                    web.post("/api/scan", density=1): (400, "invalid_params"),
                    web.post("/api/project", picture="image"): (400, "invalid_params"),
                    web.post("/api/project", picture={"a": 1}): (400, "invalid_params"),
                    web.get("/api/cloud?density=symbols&after=-1"): (400, "invalid_params"),
                    web.get("/api/cloud?density=all&after=1"): (400, "invalid_params"),
                    web.get("/api/cloud?density=symbols&after=1&organised=1"): (400, "invalid_params"),
                    web.get("/api/cloud?density=pixels&after=1&organised=yes"): (400, "invalid_params"),
                    web.get("/api/past?scan=..%2f..%2fetc"): (404, "not_found"),
                    web.get("/api/frame?camra=left"): (400, "invalid_params"),
                    web.get("/api/frame?as_shown=true"): (400, "invalid_params"),
                    web.get("/api/frame?format=RAW"): (400, "invalid_params"),
                    web.get("/api/status?camera=left"): (400, "invalid_params"),
                    web.get("/api/preview?format=raw"): (400, "invalid_params"),
                    web.post("/api/scan?density=pixels"): (400, "invalid_params"),
                    web.post("/api/project", picture="white", timeout_ms=5): (400, "invalid_params"),
                    web.post("/api/model/background", density="pixels"): (400, "invalid_params"),
                    web.get("/api/frame?camera=nobody"): (502, "not_found"),
                    web.get("/api/nothing"): (404, "not_found")}.items():
                self.assertEqual(name_of(answer), expected)
            for data in (b"", b"\0" * 1000, b"GET\r\n\r\n", b"GET / HTTP/1.1\r\nHost: " + b"a" * 100_000 + b"\r\n\r\n",
                         b"POST /api/scan HTTP/1.1\r\nContent-Length: 99999999999999\r\n\r\nx",
                         b"POST /api/scan HTTP/1.1\r\nContent-Length: -1\r\n\r\n{}",
                         b"POST /api/scan HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nFFFFFFFFFFFFFFFFFF\r\n",
                         b"GET /api/frame HTTP/1.1\r\nRange: bytes=9999999999999999999-\r\nHost: localhost\r\n\r\n"):
                web.raw(data)
            idle = [socket.create_connection(("127.0.0.1", web.port)) for _ in range(20)]
            self.assertEqual(web.get("/api/status")[0], 200)
            for connection in idle:
                connection.close()
            self.assertIsNone(web.process.poll())

    def test_who_is_slow_or_takes_nothing_holds_up_nobody(self):
        with Service() as service, Web(service) as web:
            service.wait_ready()
            ends, slow = threading.Event(), []

            def dribble(head):
                while not ends.is_set():  # again and again, as an enemy would
                    with socket.create_connection(("127.0.0.1", web.port)) as connection:
                        try:
                            for letter in itertools.cycle(head):
                                connection.sendall(letter)
                                if ends.wait(0.4):
                                    return
                        except ConnectionError:
                            pass
            for head in 40 * [[b"G"]] + 40 * [[b"POST /api/scan HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999\r\n\r\n", b"x"]]:
                slow.append(threading.Thread(target=dribble, args=(head,)))
                slow[-1].start()
            deaf = []
            for _ in range(20):  # ask for a picture and read nothing of it
                connection = socket.create_connection(("127.0.0.1", web.port))
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.sendall(f"GET /api/frame?format=raw HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {web.token}\r\n\r\n".encode())
                deaf.append(connection)
            time.sleep(3)
            took = []
            for _ in range(5):
                begin = time.monotonic()
                self.assertEqual(web.get("/api/status")[0], 200)
                took.append(time.monotonic() - begin)
            ends.set()
            for each in slow:
                each.join()
            for connection in deaf:
                connection.close()
            self.assertLess(sorted(took)[2], 8, took)
            with service.client() as client:
                self.assertGreater(client.call("scan")[0]["points"], 2000)
            self.assertLess(resident_mib(web), 160)

    def test_wrong_tokens_ten_times_a_second_disturb_nobody(self):
        with tempfile.TemporaryDirectory() as folder, Service() as service:
            file = pathlib.Path(folder, "token")
            file.write_text(TOKEN, encoding="utf-8")
            with Web(service, "--token-file", file, token=TOKEN) as web:
                session = web.log_in()
                answers = []
                for i in range(60):
                    answers.append(name_of(web.post("/api/login", token=f"{TOKEN}{i}"))[1])
                    self.assertEqual(web.ask("GET", "/api/status", headers=session)[0], 200)
                    time.sleep(0.05)
                self.assertEqual(answers, ["wrong_token"] * 5 + ["too_many_tokens"] * 55)

    def test_watchers_that_are_killed_leave_nothing(self):
        with Service() as service, Web(service) as web, service.client() as client:
            service.wait_ready()
            client.call("subscribe", rate_hz=10)
            files = lambda: len(list(pathlib.Path(f"/proc/{web.process.pid}/fd").iterdir()))
            before = files()
            lost = 0
            for i in range(60):
                connection = socket.create_connection(("127.0.0.1", web.port))
                what = ("cloud?density=symbols&after=0", "frame?format=raw", "status")[i % 3]
                connection.sendall(
                    f"GET /api/{what} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {web.token}\r\n\r\n".encode())
                time.sleep(0.01 * (i % 5))
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # a reset
                connection.close()
                if i % 10 == 0:
                    lost += client.receive()[0]["params"].get("lost", 0)
            self.assertEqual(web.get("/api/status")[0], 200)
            wait_until(lambda: files() <= before + 3, "what they had open")
            self.assertIsNone(web.process.poll())

    def test_without_a_service_the_page_says_so(self):
        with Service() as service:
            with Web(service) as web:
                service.stop()
                self.assertEqual(name_of(web.get("/api/status")), (503, "no_service"))
                self.assertEqual(web.get("/")[0], 200)
                self.assertEqual(name_of(web.get("/api/cloud?density=symbols&after=0")), (503, "no_service"))

    def test_a_service_that_hangs_up_or_stops_counts_as_away(self):
        def stopping(request):
            error = {"code": -32013, "message": "the service is stopping", "data": {"name": "cancelled"}}
            return json.dumps({"jsonrpc": "2.0", "id": request["id"], "error": error}).encode() + b"\n"

        def answers(impostor):
            with Web(impostor) as web:
                got = [web.get("/api/" + path) for path in ("status", "frame", "reasons", "metrics", "exposure", "presets",
                                                            "calibration", "cloud?density=pixels&after=0")]
                got += [web.post("/api/" + path) for path in ("scan", "set", "preset", "calibrate")]
                self.assertEqual([name_of(answer) for answer in got], [(503, "no_service")] * len(got))
                return [json.loads(answer[2])["error"]["message"] for answer in got]

        for answer in (lambda request: b"", stopping):
            with Impostor(answer, hangs_up=True) as impostor:
                impostor.socket = impostor.path
                messages = answers(impostor)
            self.assertEqual(messages, answers(impostor))  # as if nothing listens
            self.assertEqual(set(messages), {f"{impostor.path}: no service answers there: start slsd "
                                             "(sudo systemctl start slsd), or wait if it restarts"})

    def test_the_printed_address_is_exchanged_for_a_session(self):
        with Service() as service, Web(service) as web:
            self.assertRegex(web.told, r"^slsd-web: open http://127\.0\.0\.1:\d+/\?token=[0-9a-f]{48}\n$")
            path = web.address[web.address.index("/?"):]
            status, headers, _ = web.ask("GET", path, headers={})
            self.assertEqual(status, 303)
            place, key = headers["Location"].split("#key=")
            self.assertEqual(place, "./")  # relative: a proxy may have the page below a path
            cookie, *rules = headers["Set-Cookie"].split("; ")
            self.assertEqual(rules[:2], ["HttpOnly", "SameSite=Strict"])
            self.assertNotIn("Path", headers["Set-Cookie"])
            session = {"Cookie": cookie, "X-Slsd-Page": key}
            self.assertEqual(web.ask("GET", "/api/status", headers=session)[0], 200)
            several = {**session, "Cookie": f"a=b; slsd_session_{web.port}=of another path; {cookie}"}
            self.assertEqual(web.ask("GET", "/api/status", headers=several)[0], 200)
            for half in ({"Cookie": cookie}, {"X-Slsd-Page": key}, {**session, "X-Slsd-Page": key[:-1] + "x"},
                         {**session, "Cookie": cookie[:-1] + "x"}, {**session, "X-Slsd-Page": ""}):
                self.assertEqual(name_of(web.ask("GET", "/api/status", headers=half)), (401, "no_token"), half)
            status, headers, body = web.ask("GET", path[:-1] + "x", headers={})
            self.assertEqual((status, headers["Set-Cookie"]), (401, None))
            self.assertTrue(body.startswith(b"<!DOCTYPE"))
            status, headers, _ = web.ask("GET", path, headers={"Sec-Fetch-Dest": "image"})
            self.assertEqual((status, headers["Set-Cookie"]), (200, None))
            self.assertEqual(web.ask("GET", path, headers={"Host": "evil.example"})[0], 403)

    def test_each_run_has_a_token_of_its_own_and_the_address_can_be_found_again(self):
        with Service() as service, Web(service) as web, Web(service) as other:
            self.assertNotEqual(web.token, other.token)

            def addresses(runtime):
                return subprocess.run([BIN / "slsd-web", "--address"], capture_output=True, text=True, check=False,
                                      env={**web.environment(), "XDG_RUNTIME_DIR": runtime})
            self.assertEqual(addresses(web.runtime).stdout, web.address + "\n")
            file, = pathlib.Path(web.runtime, "slsd-web").iterdir()
            self.assertEqual(file.stat().st_mode & 0o777, 0o600)
            other.process.kill()  # which leaves its file
            other.process.wait()
            none = addresses(other.runtime)
            self.assertEqual((none.returncode, none.stdout), (1, ""))
            self.assertIn("no slsd-web is running", none.stderr)
            web.process.terminate()
            web.process.wait()
            self.assertEqual(list(pathlib.Path(web.runtime, "slsd-web").iterdir()), [])

    def test_is_ready_once_its_address_can_be_asked_for(self):
        with Service() as service, tempfile.TemporaryDirectory() as folder:
            manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self.addCleanup(manager.close)
            manager.bind(f"{folder}/notify")
            manager.settimeout(600)
            environment = {**os.environ, "NOTIFY_SOCKET": f"{folder}/notify", "RUNTIME_DIRECTORY": f"{folder}/run"}
            os.mkdir(f"{folder}/run")
            web = subprocess.Popen([BIN / "slsd-web", "--socket", service.socket, "--port", "0"], stdout=subprocess.DEVNULL, env=environment)
            try:
                self.assertEqual(manager.recv(64), b"READY=1")
                self.assertEqual(len(os.listdir(f"{folder}/run")), 1)
            finally:
                web.terminate()
                web.wait()

    def test_a_socket_that_can_never_answer_is_refused(self):
        for program in (["slsd-web"], ["slsd-tcp", "--token-file", "/dev/null"]):
            wrong = subprocess.run([BIN / program[0], *program[1:], "--port", "0", "--socket", "/tmp/" + 200 * "x"],
                                   capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
            self.assertEqual((wrong.returncode, wrong.stdout, wrong.stderr.count("\n")), (1, "", 1), wrong.stderr)
            self.assertIn("x: the socket's path is longer than 107 bytes", wrong.stderr)

    def test_suggests_the_nearest_option(self):
        wrong = subprocess.run([BIN / "slsd-web", "--prot", "1"], capture_output=True, text=True, check=False)
        self.assertEqual((wrong.returncode, wrong.stdout), (2, ""))
        self.assertIn("did you mean --port?", wrong.stderr)

    def test_a_port_that_is_taken_is_refused(self):
        with Service() as service, Web(service) as web:
            for listen in ("127.0.0.1", "::", "0.0.0.0"):
                with tempfile.NamedTemporaryFile("w", suffix=".token") as file:
                    file.write(TOKEN)
                    file.flush()
                    second = subprocess.run([BIN / "slsd-web", "--port", str(web.port), "--listen", listen, "--token-file", file.name],
                                            capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
                self.assertEqual((second.returncode, second.stdout), (1, ""), listen)
                self.assertIn(f"{web.port}", second.stderr)
                self.assertIn(f"the port is in use by slsd-web (process {web.process.pid})", second.stderr)
                self.assertIn("--port", second.stderr)
            with socket.socket() as listening:  # by any other program
                listening.bind(("127.0.0.1", 0))
                listening.listen()
                second = subprocess.run([BIN / "slsd-web", "--port", str(listening.getsockname()[1])], capture_output=True,
                                        text=True, check=False, timeout=TIMEOUT_S)
                self.assertIn(f"(process {os.getpid()})", second.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
