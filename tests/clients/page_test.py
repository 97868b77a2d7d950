#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-web: who is let in, what is refused, and each view in a browser. SLSD_PICTURES=FOLDER keeps pictures of them."""
import http.client
import itertools
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "daemon"))
from browser import Browser, free_port, is_there
from point_cloud import vertices
from calibrate_test import BOARD, stage
from gige_double import Double, service_on
from service import BIN, PATIENCE_S, Service, wait_until

PAGE = {"X-Slsd-Page": "1"}
TOKEN = "correct horse battery staple"
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")


class Web:
    """slsd-web on a port of its own."""

    def __init__(self, service, *arguments, port=None):
        self.port = port or free_port()
        self.process = subprocess.Popen([BIN / "slsd-web", "--socket", service.socket, "--port", str(self.port),
                                         *map(str, arguments)])

    def __enter__(self):
        def answers():
            with socket.socket() as look:
                return look.connect_ex(("127.0.0.1", self.port)) == 0
        wait_until(lambda: answers() or self.process.poll() is not None, "the page's port")
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    def ask(self, method, path, body=None, headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        try:
            connection.request(method, path, body, PAGE if headers is None else headers)
            response = connection.getresponse()
            return response.status, response.headers, response.read()
        finally:
            connection.close()

    def get(self, path, **headers):
        return self.ask("GET", path, headers={**PAGE, **headers})

    def post(self, path, **body):
        return self.ask("POST", path, json.dumps(body))

    def name_of(self, answer):
        return answer[0], json.loads(answer[2])["error"]["name"]

    def raw(self, data):
        with socket.create_connection(("127.0.0.1", self.port), timeout=20) as connection:
            connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            answer = b""
            try:
                while chunk := connection.recv(65536):
                    answer += chunk
            except ConnectionError:
                pass
            return answer


def resident_mib(web):
    with open(f"/proc/{web.process.pid}/status", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


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

    def test_only_the_page_itself_may_ask(self):
        with Service() as service, Web(service) as web:
            self.assertEqual(web.get("/api/status")[0], 200)
            self.assertEqual(web.name_of(web.ask("GET", "/api/status", headers={})), (403, "not_from_the_page"))
            self.assertEqual(web.name_of(web.get("/api/status", Origin="http://evil.example")), (403, "not_from_the_page"))
            self.assertEqual(web.name_of(web.get("/api/status", Origin="null")), (403, "not_from_the_page"))
            self.assertEqual(web.name_of(web.get("/api/status", **{"Sec-Fetch-Site": "cross-site"})),
                             (403, "not_from_the_page"))
            self.assertEqual(web.name_of(web.get("/api/status", Host="evil.example")), (403, "unknown_host"))
            self.assertEqual(web.name_of(web.get("/", Host="evil.example:80")), (403, "unknown_host"))
            self.assertEqual(web.get("/api/status", Host=f"localhost:{web.port}", Origin=f"http://localhost:{web.port}")[0],
                             200)
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
            with Web(service, "--token-file", file, "--listen", "0.0.0.0", "--name", "127.0.0.1") as web:
                self.assertEqual(web.get("/")[0], 200)
                for path in ("/api/status", "/api/frame", "/api/cloud?density=symbols&after=0", "/api/metrics"):
                    self.assertEqual(web.name_of(web.get(path)), (401, "no_token"), path)
                self.assertEqual(web.name_of(web.post("/api/scan")), (401, "no_token"))
                status, headers, _ = web.post("/api/login", token=TOKEN)
                self.assertEqual(status, 200)
                cookie = headers["Set-Cookie"]
                self.assertIn("HttpOnly; SameSite=Strict", cookie)
                session = cookie.split(";")[0]
                self.assertEqual(web.get("/api/status", Cookie=session)[0], 200)
                self.assertEqual(web.get("/api/status", Cookie=session[:-1] + "x")[0], 401)
                self.assertEqual(web.get("/api/status", Cookie="slsd_session=")[0], 401)
                answers = [web.name_of(web.post("/api/login", token=f"{i}")) for i in range(8)]
                self.assertEqual(answers[:5], [(401, "wrong_token")] * 5)
                self.assertEqual(answers[5:], [(429, "too_many_tokens")] * 3)
                self.assertEqual(web.name_of(web.post("/api/login", token=TOKEN)), (429, "too_many_tokens"))
                self.assertEqual(web.get("/api/status", Cookie=session)[0], 200)  # who is in stays in

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
                    web.get("/api/past?scan=..%2f..%2fetc"): (404, "not_found"),
                    web.get("/api/frame?camera=nobody"): (502, "not_found"),
                    web.get("/api/nothing"): (404, "not_found")}.items():
                self.assertEqual(web.name_of(answer), expected)
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
                connection.sendall(b"GET /api/frame?format=raw HTTP/1.1\r\nHost: localhost\r\nX-Slsd-Page: 1\r\n\r\n")
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
            with Web(service, "--token-file", file) as web:
                session = web.post("/api/login", token=TOKEN)[1]["Set-Cookie"].split(";")[0]
                answers = []
                for i in range(60):
                    answers.append(web.name_of(web.post("/api/login", token=f"{TOKEN}{i}"))[1])
                    self.assertEqual(web.get("/api/status", Cookie=session)[0], 200)
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
                connection.sendall(f"GET /api/{what} HTTP/1.1\r\nHost: localhost\r\nX-Slsd-Page: 1\r\n\r\n".encode())
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
                self.assertEqual(web.name_of(web.get("/api/status")), (503, "no_service"))
                self.assertEqual(web.get("/")[0], 200)
                self.assertEqual(web.name_of(web.get("/api/cloud?density=symbols&after=0")), (503, "no_service"))


class Clouds(unittest.TestCase):
    def test_scans_are_kept_as_the_history(self):
        with Service() as service, Web(service) as web:
            status, headers, ply = web.post("/api/scan", density="symbols")
            about = json.loads(headers["X-Slsd-About"])
            self.assertEqual(status, 200)
            self.assertEqual(len(vertices(ply)), about["points"])
            past = json.loads(web.get("/api/status")[2])["past"]
            self.assertEqual([scan["scan"] for scan in past], [about["scan"]])
            self.assertEqual(web.get("/api/past?scan=" + about["scan"])[2], ply)

    def test_clouds_of_pixels_are_not_held_while_they_are_watched(self):
        with Service() as service, Web(service) as web:
            service.wait_ready()
            ends, sizes, most = threading.Event(), [], [0]

            def watch():
                after = 0
                for _ in range(2):
                    status, headers, ply = web.get(f"/api/cloud?density=pixels&after={after}")
                    about = json.loads(headers["X-Slsd-About"])
                    after = about["number"]
                    sizes.append((status, len(ply) > 18 * about["points"] > 1_000_000))

            def look():
                while not ends.wait(0.005):
                    most[0] = max(most[0], resident_mib(web))
            watchers = [threading.Thread(target=watch) for _ in range(4)]
            looking = threading.Thread(target=look)
            for thread in (*watchers, looking):
                thread.start()
            for watcher in watchers:
                watcher.join()
            ends.set()
            looking.join()
            self.assertEqual(sizes, [(200, True)] * 8)
            self.assertLess(most[0], 40)  # a cloud alone has 30 MiB

    def test_watchers_get_each_newer_cloud_and_cost_one_subscription(self):
        with Service() as service, Web(service) as web, service.client() as client:
            seen = []

            def watch():
                after = 0
                for _ in range(5):
                    status, headers, ply = web.get(f"/api/cloud?density=symbols&after={after}")
                    about = json.loads(headers["X-Slsd-About"])
                    seen.append((status, about["number"] > after, len(vertices(ply)) == about["points"]))
                    after = about["number"]
            watchers = [threading.Thread(target=watch) for _ in range(10)]
            for watcher in watchers:
                watcher.start()
            wait_until(lambda: client.call("status")[0]["subscribers"] > 0, "a subscription")
            self.assertEqual(client.call("status")[0]["subscribers"], 1)
            for watcher in watchers:
                watcher.join()
            self.assertEqual(seen, [(200, True, True)] * 50)
            wait_until(lambda: client.call("status")[0]["subscribers"] == 0, "an end of it")


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Views(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))

    def test_each_view_works_at_both_widths(self):
        with Service() as service, Web(service) as web, tempfile.TemporaryDirectory() as downloads, \
                Browser(downloads) as browser:
            service.wait_ready()
            browser.resize(1600, 1100)
            browser.open(f"http://127.0.0.1:{web.port}/")
            browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "no state")
            browser.wait("/clipped/.test(document.getElementById('picture-figures').textContent)", "no picture")
            browser.click("#camera-live")
            browser.wait("!document.getElementById('scan').disabled", "nothing to draw clouds with")
            browser.click("#camera-live")
            browser.click("#scan")
            browser.wait("/points of scan/.test(document.getElementById('cloud-figures').textContent)", "no cloud")
            points = browser.run("return view.ply.count;")
            self.assertGreater(points, 2000)
            browser.picture(self.folder / "whole-1600.png")
            browser.run("document.getElementById('measure').checked = true;")
            self.assertIn("mm ±", self.measure(browser))
            for colour in ("intensity", "sigma_mm", "symbol", "z"):
                browser.run("const c = document.getElementById('colour'); c.value = arguments[0];"
                            "c.dispatchEvent(new Event('change'));", colour)
                low, high = browser.run("return view.range;")
                self.assertLess(low, high, colour)
            for extension in ("ply", "pcd"):
                browser.click(f"#save-{extension}")
            wait_until(lambda: len(list(pathlib.Path(downloads).glob("*.p??"))) == 2, "two files")
            ply = next(pathlib.Path(downloads).glob("*.ply")).read_bytes()
            pcd = next(pathlib.Path(downloads).glob("*.pcd")).read_bytes()
            self.assertEqual(len(vertices(ply)), points)
            self.assertEqual(ply.split(b"end_header\n", 1)[1], pcd.split(b"DATA binary\n", 1)[1])
            self.assertIn(f"POINTS {points}\n".encode(), pcd)
            browser.click("[data-project=focus]")
            browser.wait("/shows held/.test(document.getElementById('device-list').textContent)", "no chart")
            browser.click("#propose")
            browser.wait("document.querySelectorAll('#exposure p').length > 0 && "
                         "!/looks at/.test(document.getElementById('exposure').textContent)", "no proposal")
            browser.click("#cloud-live")
            shown = browser.run("return shownScan.scan;")
            browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud")
            browser.click("#cloud-live")
            browser.resize(390, 844)
            for view in ("devices", "camera", "cloud", "calibrate", "history"):
                browser.click(f"nav [data-view={view}]")
                time.sleep(0.3)
                self.assertEqual(browser.run("return [...document.querySelectorAll('main section')]"
                                             ".filter((s) => s.offsetParent).map((s) => s.id);"), [view])
                self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390, view)
                browser.picture(self.folder / f"{view}-390.png")
            self.assertEqual(browser.complaints(), [])

    def test_a_calibration_from_the_first_pose_to_the_verdict(self):
        with tempfile.TemporaryDirectory() as state, stage(state) as service, Web(service) as web, Browser() as browser:
            browser.resize(1600, 1400)
            browser.open(f"http://127.0.0.1:{web.port}/")
            browser.wait("/Not calibrated/.test(document.getElementById('state').textContent)", "no state")
            browser.run("document.getElementById('board').value = arguments[0];"
                        "document.getElementById('poses').value = 8;", BOARD)
            browser.run("""
                window.seen = new Set();
                new MutationObserver(() => window.seen.add(document.getElementById('calibrate-state').textContent))
                  .observe(document.getElementById('calibrate-state'), {childList: true, characterData: true, subtree: true});""")
            browser.wait("!document.getElementById('calibrate-begin').disabled", "not allowed to")
            browser.click("#calibrate-begin")
            browser.wait("/^[3-7] of 8 poses/.test(document.getElementById('calibrate-next').textContent)", "no poses")
            browser.wait("document.querySelectorAll('#calibrate-pictures figure').length === 2", "no pictures")
            browser.wait("/Being|being calibrated/.test(document.getElementById('state').textContent)", "no state")
            self.assertEqual(browser.run("return [...document.querySelectorAll('#calibrate .bar')].map((b) => b.offsetParent !== null);"),
                             [False, True])
            browser.picture(self.folder / "calibrating-1600.png")
            browser.resize(390, 844)
            browser.click("nav [data-view=calibrate]")
            browser.wait("/% covered/.test(document.getElementById('calibrate-pictures').textContent)", "no coverage")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            browser.picture(self.folder / "calibrating-390.png")
            browser.wait("document.getElementById('calibrate-state').textContent === 'Calibrated, and in force'", "no verdict")
            self.assertIn("The calibration is ", browser.run("return document.getElementById('verdict').textContent;"))
            self.assertTrue({"TAKEN ✓", "HOLD"} & set(browser.run("return [...window.seen];")))
            browser.picture(self.folder / "calibrated-390.png")
            browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "not ready")
            self.assertEqual(browser.complaints(), [])

    def test_an_exposure_is_taken_and_one_that_the_camera_refuses_is_not(self):
        double = Double()
        self.addCleanup(double.close)
        with service_on(double, "exposure_us = 4000.0") as service, Web(service) as web, Browser() as browser, \
                service.client() as client:
            service.wait_ready()
            client.call("set", decode={"density": "pixels"})
            browser.resize(1600, 1100)
            browser.open(f"http://127.0.0.1:{web.port}/")
            browser.wait("document.getElementById('which-camera').value === 'camera'", "no camera")
            self.assertEqual(browser.run("return document.getElementById('density').value;"), "pixels")
            told = {"present": {"exposure_us": 4000, "gain_db": 0}, "proposed": {"exposure_us": 9000, "gain_db": 0}}
            take = "document.getElementById('exposure').replaceChildren(takeExposure('camera', arguments[0]));"
            browser.run(take, told)
            browser.click("#take-exposure")
            browser.wait("/Taken: exposure_us = 9000/.test(document.getElementById('exposure').textContent)", "not taken")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["exposure_us"], 9000)
            told["proposed"]["gain_db"] = 59
            browser.run(take, told)
            browser.click("#take-exposure")
            browser.wait("/0 to 24, not to 59/.test(document.getElementById('message').textContent)", "no reason")
            browser.picture(self.folder / "refused-1600.png")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["gain_db"], 0)

    def test_a_page_that_is_open_for_long_holds_no_more_and_outlives_both_services(self):
        with Service() as service, Browser() as browser:
            web = Web(service)
            with web:
                service.wait_ready()
                browser.resize(1600, 1100)
                browser.open(f"http://127.0.0.1:{web.port}/")
                browser.wait("!document.getElementById('scan').disabled", "nothing to draw clouds with")
                browser.click("#scan")
                browser.wait("view.ply && view.ply.count > 2000", "no cloud")
                browser.run("document.getElementById('measure').checked = true;")

                def held():  # what three.js holds of the graphics card's memory, after clouds and measurements
                    self.measure(browser)
                    return browser.run("""
                        const buffer = view.ply.buffer;
                        for (let i = 0; i < 30; ++i) { view.show(buffer); view.renderer.render(view.scene, view.camera); }
                        return view.renderer.info.memory.geometries;""")
                first = held()
                for _ in range(5):
                    self.assertLessEqual(held(), first)
                nodes = browser.run("return document.querySelectorAll('*').length;")
                browser.click("#cloud-live")
                service.stop()
                browser.wait("document.getElementById('state').className === 'bad'", "it does not say that slsd is gone")
                service.start()
                service.wait_ready()
                browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "slsd is not back")
                shown = browser.run("return shownScan.scan;")
                browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud after slsd came back")
            browser.wait("/slsd-web does not answer/.test(document.body.innerText)", "it does not say that slsd-web is gone")
            again = Web(service, port=web.port)
            with again:
                browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "slsd-web is not back")
                shown = browser.run("return shownScan.scan;")
                browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud after slsd-web came back")
                self.assertLessEqual(browser.run("return document.querySelectorAll('*').length;"), nodes + 5)

    def measure(self, browser):
        """Clicks at two points of the cloud, where they are on the screen."""
        browser.run("""
            const at = view.points.geometry.getAttribute('position').array;
            const place = document.getElementById('space').getBoundingClientRect();
            for (const index of [Math.floor(view.ply.count / 3), Math.floor(2 * view.ply.count / 3)]) {
              const p = new THREE.Vector3(at[3 * index], at[3 * index + 1], at[3 * index + 2]).project(view.camera);
              const where = {clientX: place.left + (p.x + 1) / 2 * place.width,
                             clientY: place.top + (1 - p.y) / 2 * place.height, bubbles: true};
              const space = document.getElementById('space');
              space.dispatchEvent(new PointerEvent('pointerdown', where));
              space.dispatchEvent(new PointerEvent('pointerup', where));
            }""")
        return browser.run("return document.getElementById('distance').textContent;")


if __name__ == "__main__":
    unittest.main(verbosity=2)
