#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A model of a turning object on the page, from the first cloud to the files. SLSD_PICTURES=FOLDER keeps pictures of it."""
import functools
import json
import os
import pathlib
import re
import shutil
import signal
import tempfile
import threading
import unittest
import unittest.mock

import numpy as np

from browser import Browser, is_there
from impostor import Impostor, result
from mesh_test import mesh_ply
from turning_ball import bumpy_ball, calibration, cloud, coloured, nothing, off_truth_mm, room
from page_service import Web, downloaded, name_of

from service import BIN, TIMEOUT_S, Service, wait_until

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
FORMATS = ("3mf", "glb", "obj", "ply", "stl")
VIEWS = 12


@functools.lru_cache(None)
def view(degrees):
    return cloud(bumpy_ball, degrees, degrees)


def has_ended(process):
    """Also if nobody has waited for it."""
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


class Scanner:
    """In front of a service: clouds of an object that turns by a step with each scan that it lets through; all else is the service's."""

    def __init__(self, service, step=12):
        self.service, self.step = service, step
        self.allowed, self.scans, self.changed = 0, 0, threading.Condition()
        self.behind = self.error = None
        self.impostor = Impostor(self.answer)
        self.socket = self.impostor.path

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.let(10 ** 6)
        self.impostor.__exit__()

    def let(self, scans):
        with self.changed:
            self.allowed += scans
            self.changed.notify_all()

    def answer(self, request):
        if request["method"] == "scan" and request["params"].get("density") == "pixels":
            return self.scan(request)
        with self.service.client() as client:
            client.send(json.dumps(request).encode() + b"\n")
            message, data = client.receive()
        if request["method"] == "settings":
            message["result"]["calibration"] = calibration()
        return json.dumps(message).encode() + b"\n" + data

    def scan(self, request):
        if self.error:
            return json.dumps({"jsonrpc": "2.0", "id": request["id"], "error": self.error}).encode() + b"\n"
        if self.behind:
            body = self.behind
        else:
            with self.changed:
                self.changed.wait_for(lambda: self.allowed > self.scans)
                self.scans += 1
            body = view((self.scans - 1) * self.step)
            if request["params"].get("colour"):
                body = coloured(body)
        return result(request, body, scan=f"s-{self.scans}", bytes=len(body), format="ply")


class ModelTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-")) / "model of a thing"
        self.addCleanup(shutil.rmtree, self.folder.parent, ignore_errors=True)

    def web(self, scanner):
        return Web(scanner, "--model", self.folder)

    def look(self, web):
        return json.loads(web.get("/api/model")[2])

    def act(self, web, action, **choices):
        status, _, body = web.post("/api/model/act", action=action, **choices)
        self.assertEqual(status, 200, body)
        return json.loads(body)

    def placed(self, web):
        return (self.look(web)["progress"] or {}).get("placed", 0)

    def wait_placed(self, web, count):
        wait_until(lambda: self.placed(web) == count, f"{count} clouds: {self.look(web)}")

    def wait_state(self, web, state):
        wait_until(lambda: self.look(web)["state"] not in ("following", "building"), f"no end: {self.look(web)}")
        told = self.look(web)
        self.assertEqual(told["state"], state, told)
        return told

    def children(self, web):
        return [int(child) for task in pathlib.Path(f"/proc/{web.process.pid}/task").glob("*/children")
                for child in task.read_text(encoding="ascii").split()]


class Requests(ModelTest):
    def test_from_the_first_cloud_to_every_file(self):
        with Service() as service, Scanner(service) as scanner:
            with self.web(scanner) as web:
                told = self.look(web)
                self.assertEqual((told["state"], told["installed"], told["formats"], told["kept_clouds"]), ("none", True, {}, 0))
                self.assertEqual(self.act(web, "start", close=False)["state"], "following")
                scanner.let(4)
                self.wait_placed(web, 4)
                self.assertEqual(name_of(web.post("/api/model/act", action="start")), (503, "busy"))
                self.assertEqual(name_of(web.post("/api/model/act", action="build")), (503, "busy"))
                self.assertEqual(name_of(web.get("/api/model/file?format=ply")), (404, "not_found"))
                told = self.look(web)
                np.testing.assert_allclose(told["progress"]["views_degrees"], [0, 12, 24, 36], atol=3)
                self.assertAlmostEqual(told["progress"]["missing_degrees"], 324, delta=3)
                self.assertEqual(told["kept_clouds"], 4)
                self.assertIn("turn the object; Ctrl-C ends, and writes the model", told["messages"])
                status, headers, points = web.get("/api/model/preview")
                self.assertEqual(status, 200)
                before = json.loads(headers["X-Slsd-About"])["number"]
                self.assertRegex(points, rb"element vertex \d{4,}\n(?s:.*)property float nx\n")
                self.act(web, "stop")
                scanner.let(2)
                told = self.wait_state(web, "done")
                self.check_files(web, told)
                self.assertGreater(told["previews"], before)
                self.assertIn(b"property float sigma_mm\n", web.get("/api/model/preview")[2])
                self.assertEqual(self.children(web), [])
            with self.web(scanner) as web:  # another run of the page
                again = self.look(web)
                self.assertEqual([again[key] for key in ("state", "report", "choices", "formats")],
                                 [told[key] for key in ("state", "report", "choices", "formats")])
                self.assertEqual(self.act(web, "build", close=True)["state"], "building")
                told = self.wait_state(web, "done")
                self.assertGreater(told["report"]["invented_share"], 0.1)
                self.check_files(web, told)
                told = self.act(web, "clear")
                self.assertEqual((told["state"], told["formats"], told["kept_clouds"], told["previews"]), ("none", {}, 0, 0))
                self.assertEqual(list(self.folder.iterdir()), [])

    def check_files(self, web, told):
        self.assertEqual(sorted(told["formats"]), sorted(FORMATS))
        self.assertIsNone(told["error"])
        self.assertEqual((told["report"]["fused"], told["report"]["refused"]), (5, []))
        for format_ in FORMATS:
            status, _, data = web.get("/api/model/file?format=" + format_)
            self.assertEqual((status, len(data)), (200, told["formats"][format_]))
            self.assertEqual(data, (self.folder / f"model.{format_}").read_bytes())
        points, triangles = mesh_ply(web.get("/api/model/file?format=ply")[2])
        self.assertEqual(len(triangles), told["report"]["triangles"])
        self.assertLess(np.quantile(abs(off_truth_mm(points[points["frames"] > 0])), 0.95), 0.2)

    def test_a_turntable_is_scanned_view_by_view(self):
        with Service() as service, Scanner(service, 30) as scanner, self.web(scanner) as web:
            self.act(web, "start", turntable=True, views=VIEWS)
            self.act(web, "next")
            self.assertEqual(name_of(web.post("/api/model/act", action="next")), (409, "not_now"))  # it is being scanned
            for i in range(1, 4):
                scanner.let(1)
                self.wait_placed(web, i)
                self.act(web, "next") if i < 3 else self.act(web, "stop")
            told = self.wait_state(web, "done")
            self.assertEqual((told["report"]["frames"], told["report"]["fused"], scanner.scans), (3, 3, 3))
            self.assertIn("view 1 of 12 is placed; turn by 30 degrees, then press Enter", told["messages"])

    def test_what_does_not_belong_is_refused(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web:
            for wrong in ({}, {"action": "fly"}, {"action": 7}, {"action": "start", "output": "/etc/passwd"},
                          {"action": "start", "close": 1}, {"action": "start", "views": 12}, {"action": "start", "turntable": True},
                          {"action": "start", "turntable": True, "views": 7}, {"action": "start", "turntable": True, "views": "9"},
                          {"action": "start", "turntable": True, "views": 12, "until_closed": True},
                          {"action": "start", "colour": True}, {"action": "start", "turntable": True, "views": 12, "colour": 1},
                          {"action": "build", "colour": True},
                          {"action": "start", "box": [1, 2, 3]}, {"action": "start", "box": [0, 0, 0, 1, 0, 1]},
                          {"action": "start", "box": [0, 0, "0", 1, 1, 1]}, {"action": "start", "voxel_mm": 0},
                          {"action": "build", "turntable": True, "views": 12}):
                self.assertEqual(name_of(web.post("/api/model/act", **wrong)), (400, "invalid_params"), wrong)
            self.assertIn("did you mean voxel_mm?", web.post("/api/model/act", action="build", voxel=1)[2].decode())
            for action in ("stop", "next", "build"):
                self.assertEqual(name_of(web.post("/api/model/act", action=action)), (409, "not_now"), action)
            self.assertEqual(name_of(web.post("/api/model/act", action="start", use_background=True)), (409, "not_now"))
            self.assertEqual(name_of(web.get("/api/model/preview")), (404, "not_found"))
            for format_ in ("", "..", "../session.json", "ply/../../x", "exe"):
                self.assertEqual(name_of(web.get("/api/model/file?format=" + format_)), (400, "invalid_params"), format_)
            start = json.dumps({"action": "start"})
            for path, body in (("act", start), ("background", "{}")):
                self.assertEqual(web.ask("POST", "/api/model/" + path, body, headers={})[0], 401)
                self.assertEqual(web.ask("GET", "/api/model/" + path)[0], 405)
                self.assertEqual(web.ask("POST", "/api/model/" + path, body, {**web.secret, "Origin": "http://127.0.0.1:1"})[0], 403)
            for path in ("", "/preview", "/file?format=ply"):
                self.assertEqual(web.ask("GET", "/api/model" + path, headers={})[0], 401)
            self.assertEqual(self.children(web), [])
            self.assertFalse(self.folder.exists())

    def test_the_program_ends_with_the_page_and_its_clouds_are_kept(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            with self.subTest(number=number), Service() as service, Scanner(service) as scanner:
                with self.web(scanner) as web:
                    self.act(web, "start")
                    scanner.let(3)
                    self.wait_placed(web, 3)
                    (child,) = self.children(web)
                    web.process.send_signal(number)
                    web.process.wait(TIMEOUT_S)
                    if number == signal.SIGKILL:  # then it ends as soon as it has something to tell
                        scanner.let(1)
                    wait_until(lambda: has_ended(child), "it still runs")
                with self.web(scanner) as web:
                    told = self.look(web)
                    self.assertEqual(told["state"], "cut")
                    self.assertGreaterEqual(told["kept_clouds"], 3)
                    self.act(web, "build")
                    told = self.wait_state(web, "done")
                    self.assertGreaterEqual(told["report"]["fused"], 3)
                    self.assertIn(f"the recording was cut: its first {told['kept_clouds']} clouds are used", told["messages"])

    def test_errors_are_told_word_for_word(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web:
            scanner.error = {"code": -32000, "message": "calibrate the scanner: slsd --calibrate", "data": {"name": "not_calibrated"}}
            self.act(web, "start")
            self.assertEqual(self.wait_state(web, "failed")["error"]["message"], "calibrate the scanner: slsd --calibrate")
            scanner.error = None
            self.act(web, "start")
            wait_until(lambda: self.children(web), "no program")
            os.kill(self.children(web)[0], signal.SIGKILL)
            self.assertIn("probably because memory ran out", self.wait_state(web, "failed")["error"]["message"])
        service = Service()
        with self.web(service) as web:
            self.act(web, "start")
            message = self.wait_state(web, "failed")["error"]["message"]
            self.assertIn(str(service.socket), message)
            self.assertNotIn("slsd-model: ", message)

    def test_a_build_that_fails_leaves_the_model_before(self):
        with Service() as service, Scanner(service) as scanner:
            with self.web(scanner) as web:
                before, kept = self.finished(web, scanner)
                points = web.get("/api/model/preview")[2]
                self.act(web, "build", box=[0, 0, 1, 1, 1, 2])  # nothing lies in it
                failed = self.wait_state(web, "failed")
                self.assertIn("no frame is usable", failed["error"]["message"])
                self.assertEqual([failed[key] for key in ("report", "formats", "progress")],
                                 [before[key] for key in ("report", "formats", "progress")])
                self.assertGreater(failed["previews"], before["previews"])
                self.assertEqual(self.kept(web), kept)
                self.assertEqual(web.get("/api/model/preview")[2], points)
                self.build_and_kill(web, "failed")
                self.assertEqual(self.kept(web), kept)
            with self.web(scanner) as web:  # another run of the page
                again = self.look(web)
                self.assertEqual((again["state"], again["report"]), ("failed", before["report"]))
                self.assertEqual(self.kept(web), kept)
                self.act(web, "build", voxel_mm=2)
                told = self.wait_state(web, "done")
                self.assertIsNone(told["error"])
                self.assertLess(told["report"]["triangles"], before["report"]["triangles"])
                self.assertNotEqual(self.kept(web), kept)
                self.assertFalse((self.folder / "new").exists())

    def finished(self, web, scanner):
        self.act(web, "start")
        scanner.let(4)
        self.wait_placed(web, 4)
        self.act(web, "stop")
        scanner.let(2)
        return self.wait_state(web, "done"), self.kept(web)

    def kept(self, web):
        answers = [web.get("/api/model/file?format=" + format_) for format_ in FORMATS]
        self.assertEqual([answer[0] for answer in answers], [200] * len(FORMATS))
        return [answer[2] for answer in answers]

    def build_and_kill(self, web, state):
        self.act(web, "build", close=True)
        wait_until(lambda: self.children(web), "no program")
        os.kill(self.children(web)[0], signal.SIGKILL)
        self.wait_state(web, state)

    def test_a_model_is_kept_while_it_is_built_again(self):
        with Service() as service, Scanner(service) as scanner:
            with self.web(scanner) as web:
                before, kept = self.finished(web, scanner)
                self.assertEqual(self.act(web, "build", close=True)["state"], "building")
                (child,) = self.children(web)
                os.kill(child, signal.SIGSTOP)
                told = self.look(web)
                self.assertEqual((told["state"], told["report"]), ("building", before["report"]))
                self.assertEqual(self.kept(web), kept)
                web.process.kill()
                web.process.wait(TIMEOUT_S)
                os.kill(child, signal.SIGCONT)
                wait_until(lambda: has_ended(child), "it still runs")
            with self.web(scanner) as web:
                told = self.look(web)
                self.assertEqual((told["state"], told["report"]), ("done", before["report"]))
                self.assertEqual(self.kept(web), kept)
                self.assertFalse((self.folder / "new").exists())

    def test_a_model_that_cannot_be_replaced_is_named(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web:
            self.finished(web, scanner)
            (self.folder / "model.glb").unlink()
            (self.folder / "model.glb" / "in the way").mkdir(parents=True)
            self.act(web, "build", voxel_mm=2)
            told = self.wait_state(web, "failed")
            self.assertIn("cannot replace the previous model: ", told["error"]["message"])
            self.assertIn("model.glb", told["error"]["message"])
            self.assertEqual((told["report"], told["formats"]), (None, {}))
            (self.folder / "model.glb" / "in the way").rmdir()
            (self.folder / "model.glb").rmdir()
            self.act(web, "build", voxel_mm=2)
            self.wait_state(web, "done")
            self.kept(web)

    def test_without_the_package_it_says_what_to_install(self):
        alone = self.folder.parent / "bin"
        alone.mkdir()
        shutil.copy(BIN / "slsd-web", alone)
        with unittest.mock.patch("page_service.BIN", alone), Service() as service, self.web(service) as web:
            self.assertFalse(self.look(web)["installed"])
            status, _, body = web.post("/api/model/act", action="start")
            self.assertEqual(status, 502)
            self.assertIn("sudo apt install slsd-model", json.loads(body)["error"]["message"])
            self.assertEqual(self.look(web)["state"], "none")

    def test_the_empty_scene_is_left_out(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web:
            scanner.behind = cloud(nothing, 0, 1000, room)
            self.assertTrue(json.loads(web.post("/api/model/background")[2])["has_background"])
            self.assertEqual((self.folder / "background.ply").read_bytes(), scanner.behind)
            self.act(web, "start", use_background=True, box=[-100, -100, 500, 100, 100, 700])
            wait_until(lambda: self.left_out(web), "it is not left out")
            self.assertIn("it shows almost nothing", self.left_out(web))
            self.assertTrue(self.act(web, "clear")["has_background"])
            self.assertFalse(self.act(web, "forget_background")["has_background"])

    def left_out(self, web):
        return (self.look(web)["progress"] or {}).get("left_out")


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Operator(ModelTest):
    def setUp(self):
        super().setUp()
        self.admitted = []
        self.pictures = pathlib.Path(os.environ.get("SLSD_PICTURES") or self.folder.parent)

    def open(self, browser, web, width=1280, height=1000, scheme="light"):
        browser.resize(width, height)
        browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        # The token lets a browser in once: another session would end that of the page before amid its requests.
        browser.open(web.address if browser not in self.admitted else f"http://127.0.0.1:{web.port}/")
        self.admitted.append(browser)
        browser.wait("document.getElementById('state').textContent === 'Ready to scan.' && typeof THREE === 'object' && Boolean(THREE.OrbitControls)",
                     "no page")
        if width < 1100:
            browser.click("nav [data-view=model]")
        browser.wait("modelTold !== null", "no word of the model")

    def follow_and_stop(self, browser, scanner):
        """A model of the first clouds, as soon as it is built."""
        self.choose(browser, "model-turned", "stopped")
        browser.click("#model-start")
        scanner.let(3)
        browser.wait("modelTold.progress && modelTold.progress.placed === 3", "nothing is placed")
        browser.click("#model-stop")
        scanner.let(2)

    def choose(self, browser, name, value):
        browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                    "c.dispatchEvent(new Event('change'));", name, value)

    def text(self, browser, name):
        return browser.run("return document.getElementById(arguments[0]).textContent;", name)

    def picture(self, browser, name, width):
        self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), width)
        browser.run("document.getElementById('model').scrollIntoView();")
        browser.picture(self.pictures / f"model-{name}-{width}.png")

    def scan_views(self, browser, scanner, first, last):
        for i in range(first, last + 1):
            browser.wait("!document.getElementById('model-next').disabled", "no next view")
            browser.click("#model-next")
            scanner.let(1)
            browser.wait(f"modelTold.progress && modelTold.progress.placed === {i}", f"view {i} is not placed")

    def drawn(self, browser):
        """How many pixels of the view have the model, and how many of the ring are green."""
        return browser.run("""
            modelView.render(performance.now());
            const gl = modelView.renderer.getContext(), width = gl.drawingBufferWidth, height = gl.drawingBufferHeight;
            const data = new Uint8Array(4 * width * height);
            gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
            const ring = document.getElementById("model-ring"), marks = ring.getContext("2d").getImageData(0, 0, ring.width, ring.height).data;
            let model = 0, green = 0;
            for (let i = 0; i < data.length; i += 4) model += data[i] > 0x40;
            for (let i = 0; i < marks.length; i += 4) green += marks[i] === 0x5f && marks[i + 1] === 0xd3 && marks[i + 2] === 0x8d;
            return [model, green];""")

    def test_a_turntable_from_start_to_the_downloaded_file(self):
        with Service() as service, Scanner(service, 30) as scanner, self.web(scanner) as web, \
                tempfile.TemporaryDirectory() as downloads, Browser(downloads) as browser:
            service.wait_ready()
            self.open(browser, web)
            self.choose(browser, "model-turned", "table")
            self.choose(browser, "model-views", str(VIEWS))
            self.picture(browser, "begin", 1280)
            browser.click("#model-start")
            self.scan_views(browser, scanner, 1, 5)
            browser.wait("Boolean(modelView && modelView.ply) && modelPreview === modelTold.previews", "nothing is drawn")
            self.assertRegex(self.text(browser, "model-state"), r"^View 5 of 12. Seen 1[12]\d° of 360°. Missing: 1[12]\d° to 360° after")
            self.assertIn("press “Next view”", self.text(browser, "model-log"))
            few, green = self.drawn(browser)
            self.assertGreater(few, 5000)
            self.picture(browser, "growing", 1280)
            for width, height, scheme in ((390, 844, "light"), (390, 844, "dark"), (1280, 1000, "dark")):
                self.open(browser, web, width, height, scheme)
                browser.wait("Boolean(modelView && modelView.ply)", "another browser draws nothing")
                self.picture(browser, "growing-" + scheme, width)
            self.scan_views(browser, scanner, 6, VIEWS)
            browser.wait("modelTold.state === 'done'", "no model")
            browser.wait("modelPreview === modelTold.previews", "the mesh is not drawn")
            self.assertGreater(self.drawn(browser)[1], 2 * green)
            self.assertIn("12 of 12 clouds fused", self.text(browser, "model-figures"))
            for colour in ("frames", "sigma_mm", "plain"):
                self.choose(browser, "model-colour", colour)
                self.assertGreater(self.drawn(browser)[0], 5000, colour)
                self.picture(browser, "ready-" + colour, 1280)
            self.choose(browser, "model-format", "stl")
            browser.click("#model-save")
            self.assertEqual(downloaded(downloads, "model.stl")[0].read_bytes(), (self.folder / "model.stl").read_bytes())
            for width, height, scheme in ((390, 844, "light"), (390, 844, "dark")):
                self.open(browser, web, width, height, scheme)
                browser.wait("Boolean(modelView && modelView.ply)", "nothing is drawn of a model that is ready")
                self.picture(browser, "ready-" + scheme, width)
            self.assertEqual(browser.complaints(), [])

    def test_the_growing_model_has_the_colour_of_the_surface(self):
        with Service() as service, Scanner(service, 30) as scanner, self.web(scanner) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web)
            self.choose(browser, "model-turned", "table")
            self.choose(browser, "model-views", str(VIEWS))
            browser.click("#model-tinted")
            browser.click("#model-start")
            self.scan_views(browser, scanner, 1, 3)
            drawn = "[...modelView.points.geometry.getAttribute('colour').array.slice(0, 3)]"
            browser.wait("Boolean(modelView && modelView.ply && modelView.ply.fields.red)", "no colours")
            browser.wait(f"{drawn}.join() === '200,100,50'", "it is not drawn in its colours")
            self.assertEqual(browser.run("return document.getElementById('model-colour').value;"), "own")
            self.picture(browser, "coloured", 1280)
            self.choose(browser, "model-colour", "plain")
            self.scan_views(browser, scanner, 4, 4)
            browser.wait("modelPreview === modelTold.previews", "nothing new is drawn")
            self.assertEqual(browser.run("return document.getElementById('model-colour').value;"), "plain")  # as was chosen
            browser.click("#model-stop")
            scanner.let(1)
            browser.wait("modelTold.state === 'done' && modelPreview === modelTold.previews", "no model")
            self.choose(browser, "model-colour", "own")
            level = browser.run(f"return {drawn};")
            np.testing.assert_allclose(level, (200, 100, 50), atol=2)
            self.open(browser, web, 390, 844)
            browser.wait("Boolean(modelView && modelView.ply)", "nothing is drawn")
            self.picture(browser, "coloured", 390)
            self.assertEqual(browser.complaints(), [])

    def test_a_press_that_deletes_asks_once_more(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web)
            self.follow_and_stop(browser, scanner)
            browser.wait("modelTold.state === 'done' && document.getElementById('model-start').dataset.busy !== 'yes'", "no model")
            browser.click("#model-start")
            self.assertEqual(self.text(browser, "model-start"), "Replace the model?")
            self.assertEqual(self.look(web)["state"], "done")
            browser.click("#model-start")
            browser.wait("modelTold.state === 'following'", "it does not begin")
            browser.click("#model-clear")
            browser.wait("document.getElementById('model-clear').textContent === 'End without a model?'", "it does not ask")
            browser.click("#model-clear")
            browser.wait("modelTold.state === 'none' && document.getElementById('model-shown').hidden", "it is not deleted")

    def test_the_model_before_is_shown_beside_the_error_of_the_next(self):
        with Service() as service, Scanner(service) as scanner, self.web(scanner) as web, \
                tempfile.TemporaryDirectory() as downloads, Browser(downloads) as browser:
            service.wait_ready()
            self.open(browser, web)
            self.follow_and_stop(browser, scanner)
            browser.wait("modelTold.state === 'done' && modelPreview === modelTold.previews", "no model")
            figures, drawn = self.text(browser, "model-figures"), self.drawn(browser)[0]
            browser.run("boxChosen = [0, 0, 1, 1, 1, 2];")
            browser.wait("!document.getElementById('model-build').disabled", "it cannot be built again")
            browser.click("#model-build")
            browser.wait("modelTold.state === 'failed' && modelPreview === modelTold.previews", "no failure")
            self.assertEqual(self.text(browser, "model-state"), "The new build failed. The previous model is kept.")
            self.assertIn("no frame is usable", self.text(browser, "model-problem"))
            self.assertEqual(self.text(browser, "model-figures"), "Previous model:\n" + figures)
            self.assertGreater(self.drawn(browser)[0], 0.9 * drawn)
            self.picture(browser, "kept", 1280)
            self.choose(browser, "model-format", "stl")
            browser.click("#model-save")
            self.assertEqual(downloaded(downloads, "model.stl")[0].read_bytes(), (self.folder / "model.stl").read_bytes())
            self.assertEqual(browser.complaints(), [])

    def test_without_the_package_or_a_service_the_page_says_so(self):
        alone = self.folder.parent / "bin"
        alone.mkdir()
        shutil.copy(BIN / "slsd-web", alone)
        with Service() as service, Browser() as browser:
            service.wait_ready()
            with unittest.mock.patch("page_service.BIN", alone), self.web(service) as web:
                self.open(browser, web, 390, 844)
                self.assertTrue(browser.run("return document.getElementById('model-start').disabled;"))
                self.assertIn("sudo apt install slsd-model", browser.run("return document.getElementById('model').innerText;"))
                self.picture(browser, "missing", 390)
            with self.web(service) as web, Browser() as browser:
                self.open(browser, web)
                service.stop()
                browser.click("#model-start")
                browser.wait("modelTold.state === 'failed'", "no failure")
                self.assertIn(f"{service.socket}: no service answers there", self.text(browser, "model-problem"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
