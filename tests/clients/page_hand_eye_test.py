#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Hand-eye calibration on the page, view by view, against a robot in numpy. SLSD_PICTURES=FOLDER keeps pictures of it."""
import atexit
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

from browser import Browser, is_there
from impostor import Impostor
from page_service import Web, downloaded, name_of

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "daemon"))
import hand_eye_test as robot
from service import BIN, TIMEOUT_S, Service

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
VIEWS = 8
ROBOT_BASE = '\n[frame]\noutput = "robot_base"\nhand_eye = "hand_eye.yml"\n'
STATE = "document.getElementById('hand-eye-state').textContent"
VERDICT = "document.getElementById('hand-eye-verdict').textContent"
ROWS = "document.querySelectorAll('#hand-eye-views tbody tr').length"
# How many pixels of the first picture have the colour of the board's points.
GREEN = """
const canvas = document.querySelector("#hand-eye-pictures canvas");
const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
let count = 0;
for (let i = 0; i < data.length; i += 4) count += data[i] === 0x3d && data[i + 1] === 0xf0 && data[i + 2] === 0x6b;
return count;"""


class Cell:
    """A service whose camera sees drawn boards, and what the robot says at each of them."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        atexit.register(shutil.rmtree, self.folder, ignore_errors=True)
        subprocess.run([BIN / "make_views", self.folder, str(VIEWS)], check=True, timeout=TIMEOUT_S)
        (self.folder / "nothing").mkdir()
        (self.folder / "nothing/white.pgm").write_bytes(b"P5 800 600 255\n" + bytes(800 * 600))
        camera_from_board = numpy.loadtxt(self.folder / "views.csv", delimiter=",").reshape(-1, 4, 4)
        self.poses = [robot.BASE_FROM_BOARD @ numpy.linalg.inv(each) @ numpy.linalg.inv(robot.FLANGE_FROM_RIG)
                      for each in camera_from_board]

    def picture(self, view):
        return self.folder / ("nothing/white.pgm" if view is None else f"pose_{view:02}/white.png")

    def text(self, view):
        text = robot.CONFIGURATION.format(folder=self.folder)
        return text.replace('"frames"', f'"{self.picture(view)}"').replace("loop = false", "loop = true")


def pasted(matrix):
    """A pose as a KUKA's panel has it."""
    return "{" + ", ".join(f"{name} {number:.4f}" for name, number in zip("XYZABC", robot.kuka(matrix))) + "}"


class HandEye(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cell = Cell()

    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))
        self.views = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-")) / "views of a cell"  # a path to be quoted
        atexit.register(shutil.rmtree, self.views.parent, ignore_errors=True)

    def see(self, service, view):
        """Another picture is another camera, which a running service does not take."""
        service.configure(configuration=self.cell.text(view))
        service.stop()
        service.start()
        service.wait_ready()

    def kept(self):
        return {str(each.relative_to(self.views)): each.read_bytes() for each in self.views.rglob("*")
                if each.is_file() and each.name != "choices.json"}


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Operator(HandEye):
    def open(self, browser, web, width=1600, height=1400, scheme="light"):
        browser.resize(width, height)
        browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        browser.open(web.address)
        browser.wait("mayAdminister && !document.getElementById('take-pose').disabled", "no view can be taken")
        if width < 1100:
            browser.click("nav [data-view=calibrate]")
        browser.run("document.getElementById('hand-eye').open = true;")

    def enter(self, browser, pose, notation="kuka", mounted="arm"):
        browser.run("""
            for (const [id, value, kind] of [["mounted", arguments[0], "change"], ["notation", arguments[1], "change"],
                                             ["robot-pose", arguments[2], "input"]]) {
              document.getElementById(id).value = value;
              document.getElementById(id).dispatchEvent(new Event(kind));
            }""", mounted, notation, pose)

    def take(self, browser, pose, said="TAKEN", **options):
        self.enter(browser, pose, **options)
        browser.click("#take-pose")
        browser.wait(f"{STATE}.startsWith('{said}') && !document.getElementById('take-pose').disabled", f"not {said}")

    def picture(self, browser, name, width):
        self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), width)
        browser.run("document.getElementById('hand-eye').scrollIntoView();")
        browser.picture(self.folder / f"hand-eye-{name}-{width}.png")

    def test_from_the_first_view_to_clouds_in_the_robots_base(self):
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, \
                tempfile.TemporaryDirectory() as downloads, Browser(downloads) as browser:
            service.wait_ready()
            self.open(browser, web)
            for i, pose in enumerate(self.cell.poses):
                self.see(service, i)
                self.take(browser, pasted(pose))
                self.assertEqual(browser.run(f"return {ROWS};"), i + 1)
                self.assertGreater(browser.run(GREEN), 200)
                told = json.loads(web.get("/api/hand_eye")[2])
                if i == 1:
                    self.assertIn("2 poses are too few: at least 3 poses are needed", browser.run(f"return {VERDICT};"))
                    self.assertFalse(told["has_file"])
                    self.picture(browser, "begun", 1600)
                if i == 4 and "next_pose" in told["outcome"]:
                    browser.click("#use-next")
                    self.assertEqual(browser.run("return numbersOfPose(document.getElementById('robot-pose').value);"), told["outcome"]["next_pose"])
            self.assertRegex(browser.run(f"return {VERDICT};"), r"is (good|usable): 95 % of points at \d+ mm are placed within [0-2]\.\d\d mm")
            self.picture(browser, "light", 1600)
            self.check_place(self.views / "hand_eye.yml")
            browser.click("#hand-eye-save")
            self.assertEqual(downloaded(downloads, "*.yml")[0].read_bytes(), (self.views / "hand_eye.yml").read_bytes())
            self.check_same_as_the_command(service)
            self.put_into_force(browser, service)
            self.assertEqual(browser.complaints(expected="50[23]"), [])  # while it was started again
            for width, height, scheme in ((1280, 900, "dark"), (390, 844, "light"), (390, 844, "dark")):
                self.open(browser, web, width, height, scheme)
                browser.wait(f"{ROWS} === {VIEWS}", "another browser sees other views")
                browser.run("for (const each of document.querySelectorAll('#hand-eye-views button')) if (/Show/.test(each.textContent)) { each.click(); break; }")
                browser.wait("document.querySelector('#hand-eye-pictures figcaption')", "no picture")
                self.picture(browser, scheme, width)
                browser.run("document.getElementById('hand-eye-views').scrollIntoView();")
                browser.picture(self.folder / f"hand-eye-list-{scheme}-{width}.png")

    def check_place(self, file):
        place = robot.matrix_of(file, "flange_from_rig_T") - robot.FLANGE_FROM_RIG[:3, 3]
        rotation = robot.matrix_of(file, "flange_from_rig_R").reshape(3, 3).T @ robot.FLANGE_FROM_RIG[:3, :3]
        print(f"place off by {numpy.linalg.norm(place):.2f} mm, turn by {1000 * robot.angle_of(rotation):.2f} mrad")
        self.assertLess(numpy.linalg.norm(place), 1.5)
        self.assertLess(robot.angle_of(rotation), 1e-3)

    def check_same_as_the_command(self, service):
        """slsctl hand-eye makes the same file of the same folder."""
        other = self.views.parent / "other.yml"
        done = robot.slsctl("hand-eye", "--mounted", "arm", "--poses", "kuka", "--from", self.views, "--config", service.file, "-o", other)
        self.assertEqual(done.returncode, 0, done.stderr)
        undated = [[line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("date:")]
                   for file in (other, self.views / "hand_eye.yml")]
        self.assertEqual(undated[0], undated[1])

    def put_into_force(self, browser, service):
        """By the command that the page tells, without sudo."""
        place = service.folder / "hand_eye.yml"
        command = browser.run("return document.getElementById('hand-eye-command').textContent;")
        self.assertEqual(command, f"sudo install -m 644 '{self.views}/hand_eye.yml' {place} && sudo kill -HUP {service.process.pid}")
        self.assertIn(ROBOT_BASE.split("hand_eye =")[0].strip(), browser.run("return document.getElementById('hand-eye-table').textContent;"))
        service.configure(configuration=self.cell.text(VIEWS - 1) + ROBOT_BASE)
        with service.client() as client:
            self.assertRaisesRegex(Exception, "hand_eye.yml", client.call, "reload")
        subprocess.run(command.replace("sudo ", ""), shell=True, check=True, capture_output=True)
        browser.wait("document.getElementById('hand-eye-table').hidden", "the page does not see the configuration")

    def test_views_are_deleted_and_the_rest_calculated_again(self):
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web, 1280, 900)
            for i in range(4):
                self.see(service, i)
                self.take(browser, pasted(self.cell.poses[i]))
            browser.click("[data-pose=pose_01] td:last-child button:last-child")
            self.assertEqual(browser.run(f"return {ROWS};"), 4)  # asks first
            browser.click("[data-pose=pose_01] td:last-child button:last-child")
            browser.wait(f"{ROWS} === 3 && {STATE} === ''", "it is not deleted")
            self.assertFalse((self.views / "pose_01").exists())
            self.assertNotIn("pose_01", (self.views / "poses.csv").read_text(encoding="utf-8"))
            self.assertEqual(json.loads(web.get("/api/hand_eye")[2])["outcome"]["poses"], 3)
            browser.click("#hand-eye-clear")
            browser.click("#hand-eye-clear")
            browser.wait(f"{ROWS} === 0", "they are not deleted")
            self.assertEqual(self.kept(), {})
            self.assertTrue(browser.run("return document.getElementById('hand-eye-result').hidden;"))

    def test_a_robtarget_is_read_with_the_text_around_it(self):
        place, turn, more = "[412.5,-231,6.12E+02]", "[0.5,-0.5,0.5,-0.5]", "[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"
        pose = [412.5, -231, 612, 0.5, -0.5, 0.5, -0.5]
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web, 1280, 900)
            browser.wait("handEyePlaced", "the kept choices do not come")
            for text in (f"[{place},{turn},{more}]", f"  [{place}, {turn}, {more}] ", f"\t[ {place} , {turn} , {more} ]\u00a0",
                         f"CONST robtarget p10:=[{place},{turn},{more}];", f"LOCAL PERS robtarget p{{3}} := [{place},{turn},{more}]; ! 2 of 12",
                         f"VAR pose p10:=[{place},{turn}];", f"[{place},{turn}]", f"{place},{turn}", f" {place[1:-1]}, {turn[1:-1]} "):
                self.enter(browser, text, notation="abb")
                self.assertEqual(browser.run("return understandPose();"), pose, text)
                self.assertRegex(browser.run("return document.getElementById('pose-read').textContent;"), r"^x 412.5 mm, .*, q4 -0.5$")
            self.enter(browser, f"[{place},[0.5,0.5],{more}]", notation="abb")
            self.assertIn("5 numbers instead of 7", browser.run("return document.getElementById('pose-read').textContent;"))
            rows = "[[1,0,0,5],[0,1,0,6],[0,0,1,7],[0,0,0,1]]"
            self.enter(browser, rows, notation="matrix")
            self.assertEqual(browser.run("return understandPose();"), [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1])

    def test_late_choices_of_before_leave_the_users_alone(self):
        """The kept choices come after the user has made some: those stand, the others are placed."""
        self.views.mkdir()
        kept = {"mounted": "cell", "poses": "fanuc", "board": "charuco-a3", "distance_mm": 500.0}
        (self.views / "choices.json").write_text(json.dumps(kept), encoding="utf-8")
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            browser.devtools("Page.addScriptToEvaluateOnNewDocument", source="""
                const soon = window.fetch;
                window.fetch = async (path, ...more) => {
                  const answer = await soon(path, ...more);
                  if (path === "api/hand_eye") await new Promise((pass) => { window.letPass = pass; });
                  return answer;
                };""")
            self.open(browser, web, 1280, 900)
            browser.wait("typeof letPass === 'function'", "the page does not ask")
            values = """["mounted", "notation", "hand-eye-board", "hand-eye-distance", "hand-eye-measured"].map((id) => document.getElementById(id).value)"""
            browser.run("""
                for (const [id, value, kind] of [["notation", "kuka", "change"], ["hand-eye-distance", "777", "input"]]) {
                  document.getElementById(id).value = value;
                  document.getElementById(id).dispatchEvent(new Event(kind));
                }
                letPass();""")
            browser.wait("handEyePlaced", "the kept choices do not come")
            self.assertEqual(browser.run(f"return {values};"), ["cell", "kuka", "charuco-a3", "777", ""])
            self.assertIn("KUKA", browser.run("return document.getElementById('notation').selectedOptions[0].textContent;"))
            self.assertIn("on the arm", browser.run("return document.getElementById('mounting-help').textContent;"))

    def test_a_view_of_two_cameras_has_two_pictures(self):
        folder = self.views.parent / "of two"
        subprocess.run([BIN / "make_views", folder, "3", "2"], check=True, timeout=TIMEOUT_S)
        rig_from_board = numpy.loadtxt(folder / "views.csv", delimiter=",").reshape(-1, 4, 4)
        seen = [(folder / f"pose_{i:02}/camera/white.png", folder / f"pose_{i:02}/right/white.png") for i in range(3)]
        seen[2] = (self.cell.picture(None), seen[2][1])

        def text(view):
            words = robot.TWO_CAMERAS.format(folder=folder).replace("loop = false", "loop = true")
            for name, picture in zip(("left", "right"), seen[view]):
                words = words.replace(f'path = "{name}"', f'path = "{picture}"')
            return words
        with Service(configuration=text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web, 1280, 900)
            for i, board in enumerate(rig_from_board):
                service.configure(configuration=text(i))
                service.stop()
                service.start()
                service.wait_ready()
                self.take(browser, pasted(robot.BASE_FROM_BOARD @ numpy.linalg.inv(board) @ numpy.linalg.inv(robot.FLANGE_FROM_RIG)))
                told = browser.run("return [...document.querySelectorAll('#hand-eye-pictures figcaption')].map((each) => each.textContent);")
                self.assertEqual(len(told), 2)
                for camera, words in zip(("camera", "right"), told):
                    found = not (i == 2 and camera == "camera")
                    self.assertRegex(words, rf"pose_{i:02}, camera {camera}: " + (r"\d\d points of the board" if found else "the board was not found"))
                self.assertEqual(browser.run(GREEN) > 200, i < 2)
            views = json.loads(web.get("/api/hand_eye")[2])["looks"]
            self.assertTrue(views[0]["corners"] > 1.5 * views[2]["corners"])
            self.picture(browser, "two", 1280)
            browser.click("[data-pose=pose_01] td:last-child button:last-child")
            browser.click("[data-pose=pose_01] td:last-child button:last-child")
            browser.wait(f"{ROWS} === 2 && {STATE} === ''", "it is not deleted")
            self.assertFalse((self.views / "pose_01").exists())

    def test_bad_input_is_named_and_keeps_nothing(self):
        late = self.cell.poses[3] @ robot.motion(robot.turn((1, 2, 0), 0.06), (25, -12, 8))  # the robot had not arrived
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web, 1280, 900)
            for i in range(2):
                self.see(service, i)
                self.take(browser, pasted(self.cell.poses[i]))
            before = self.kept()
            for text, said in (("", "6 numbers"), ("1, 2, nan, 4, 5, 6", "5 numbers instead of 6"), ("412,5; 1,5", "4 numbers instead of 6")):
                self.enter(browser, text)
                self.assertTrue(browser.run("return document.getElementById('pose-read').textContent;").startswith(said))
                browser.click("#take-pose")
                browser.wait("/KUKA .* has 6 numbers/.test(document.getElementById('message').textContent)", text)
            self.take(browser, ",".join("1" * 16), notation="matrix", said="")
            browser.wait("/the matrix is no rotation/.test(document.getElementById('message').textContent)", "no word of the matrix")
            self.see(service, None)
            self.take(browser, pasted(self.cell.poses[2]), said="Not taken")
            self.assertRegex(browser.run(f"return {VERDICT};"), r"pose_02: .*(board|markers).*pose_02 is not kept")
            self.picture(browser, "refused", 1280)
            self.assertEqual(self.kept(), before)
            self.see(service, 2)
            metres = robot.kuka(self.cell.poses[2], 0.001)
            self.take(browser, json.dumps(metres), said="Not taken")
            self.assertRegex(browser.run(f"return {VERDICT};"), "pose_02 is not kept")
            self.take(browser, pasted(self.cell.poses[2]))
            self.see(service, 3)
            self.take(browser, pasted(self.cell.poses[3]))
            self.see(service, 4)
            before = self.kept()
            self.take(browser, pasted(late), said="Not taken")
            self.assertRegex(browser.run(f"return {VERDICT};"), "pose_04 contradicts the others.*: delete it")
            self.assertEqual({name: data for name, data in self.kept().items() if name != "hand_eye.yml"},
                             {name: data for name, data in before.items() if name != "hand_eye.yml"})

    def test_a_wrong_choice_is_named_as_the_page_has_it(self):
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web, 1280, 900)
            for i in range(6):
                self.see(service, i)
                self.enter(browser, pasted(self.cell.poses[i]), notation="fanuc")
                browser.click("#take-pose")
                browser.wait(f"/^(TAKEN|Not taken)/.test({STATE}) && !document.getElementById('take-pose').disabled", "no view")
                if browser.run(f"return {STATE};").startswith("Not"):
                    break
            self.assertRegex(browser.run(f"return {VERDICT};"), "choose “KUKA")
            self.assertLess(i, 5)


class Requests(HandEye):
    def test_what_does_not_belong_is_refused(self):
        with Service(configuration=self.cell.text(0)) as service, Web(service, "--hand-eye", self.views) as web:
            service.wait_ready()
            right = {"action": "take", "mounted": "arm", "poses": "kuka", "pose": robot.kuka(self.cell.poses[0])}
            for wrong in ({"action": "fly"}, {"action": 7}, {"action": "take"}, {**right, "mounted": "head"}, {**right, "poses": "../ur"},
                          {**right, "pose": "1,2,3,4,5,6"}, {**right, "pose": [1, 2, 3]}, {**right, "pose": [1, 2, 3, 4, 5, None]},
                          {**right, "pose": [1] * 2000}, {**right, "board": 5}, {**right, "board": "a\nb"}, {**right, "board": "x" * 300},
                          {**right, "ruler": "200:199"}, {**right, "distance_mm": "near"}, {**right, "measured_mm": [1, 2]},
                          {**right, "output": "/etc/passwd"}, {**right, "from": "/"}):
                self.assertEqual(name_of(web.post("/api/hand_eye/act", **wrong)), (400, "invalid_params"), wrong)
            self.assertIn("did you mean distance_mm?", web.post("/api/hand_eye/act", **right, distance=5)[2].decode())
            for look in ("", "pose_00", "../pose_00", "..", "/etc", 5, None, "pose_00/../.."):
                self.assertEqual(name_of(web.post("/api/hand_eye/act", action="drop", look=look)), (404, "not_found"), look)
            self.assertFalse(self.views.exists() and any(each.name.startswith("pose") for each in self.views.rglob("*")))
            for query in ("", "?look=pose_00", "?look=..", "?look=../../etc&camera=passwd", "?look=pose_00&camera=../.."):
                self.assertEqual(name_of(web.get("/api/hand_eye/look" + query)), (404, "not_found"), query)
            self.assertEqual(name_of(web.get("/api/hand_eye/file")), (404, "not_found"))
            board = json.loads(web.post("/api/hand_eye/act", **{**right, "board": "nonsense:1"})[2])
            self.assertIn("nonsense", board["error"]["message"])
            self.assertEqual(board["looks"], [])
            taken = json.loads(web.post("/api/hand_eye/act", **right)[2])
            self.assertEqual(([look["name"] for look in taken["looks"]], taken["error"]), (["pose_00"], None))
            self.assertEqual(web.ask("GET", "/api/hand_eye/look?look=pose_00", headers={})[0], 401)
            status, headers, png = web.get("/api/hand_eye/look?look=pose_00&camera=")
            self.assertEqual((status, png), (200, (self.views / "pose_00/white.png").read_bytes()))
            self.assertGreater(len(json.loads(headers["X-Slsd-About"])["points_px"]), 20)
            self.assertEqual(name_of(web.get("/api/hand_eye/look?look=pose_00/..&camera=pose_00")), (404, "not_found"))

    def test_views_outlive_the_page(self):
        with Service(configuration=self.cell.text(0)) as service:
            service.wait_ready()
            with Web(service, "--hand-eye", self.views) as web:
                web.post("/api/hand_eye/act", action="take", mounted="cell", poses="kuka", pose=robot.kuka(self.cell.poses[0]))
            with Web(service, "--hand-eye", self.views) as web:
                told = json.loads(web.get("/api/hand_eye")[2])
        self.assertEqual(told["choices"], {"mounted": "cell", "poses": "kuka"})
        self.assertEqual([look["name"] for look in told["looks"]], ["pose_00"])
        numpy.testing.assert_allclose(told["looks"][0]["pose"], robot.kuka(self.cell.poses[0]), atol=1e-6)

    def test_without_rights_or_service_the_reason_is_the_answer(self):
        pose = {"action": "take", "mounted": "arm", "poses": "kuka", "pose": robot.kuka(self.cell.poses[0])}

        def deny(request):
            error = {"code": -32006, "message": "ask for the role administer", "data": {"name": "permission_denied"}}
            return json.dumps({"jsonrpc": "2.0", "id": request["id"], "error": error}).encode() + b"\n"
        with Impostor(deny) as impostor:
            impostor.socket = impostor.path
            with Web(impostor, "--hand-eye", self.views) as web:
                self.assertEqual(name_of(web.post("/api/hand_eye/act", **pose)), (403, "permission_denied"))
        service = Service(configuration=self.cell.text(0))
        with Web(service, "--hand-eye", self.views) as web:
            away = web.post("/api/hand_eye/act", **pose)
            self.assertEqual(name_of(away), (503, "no_service"))
            self.assertIsNone(json.loads(web.get("/api/hand_eye")[2])["error"])
            self.assertEqual(away[2], web.get("/api/presets")[2])
        with Impostor(lambda request: b"", hangs_up=True) as impostor:
            impostor.socket = impostor.path
            with Web(impostor, "--hand-eye", self.views) as web:
                gone = web.post("/api/hand_eye/act", **pose)
                self.assertEqual(name_of(gone), (503, "no_service"))
                self.assertEqual(gone[2], web.get("/api/presets")[2])


if __name__ == "__main__":
    unittest.main(verbosity=2)
