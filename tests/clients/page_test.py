#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The page's clouds and each of its views in a browser. SLSD_PICTURES=FOLDER keeps pictures of the views."""
import json
import os
import pathlib
import tempfile
import threading
import time
import unittest

from browser import Browser, is_there
from page_service import TOKEN, Web, downloaded, resident_mib
from calibrate_test import BOARD, stage
from clipped_frame import write_clipped
from gige_double import Double, service_on
from point_cloud import vertices
from service import Service, wait_until

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")


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
                    status, headers, ply = web.cloud("pixels", after)
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
                    status, headers, ply = web.cloud("symbols", after)
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
            browser.open(web.address)
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
            ply = downloaded(downloads, "*.p??", 2)[1].read_bytes()
            self.assertEqual(len(vertices(ply)), points)
            browser.click("[data-project=focus]")
            browser.wait("/shows held/.test(document.getElementById('device-list').textContent)", "no chart")
            browser.click("#propose")
            browser.wait("document.querySelectorAll('#exposure p').length > 0 && "
                         "!/Taking two frames/.test(document.getElementById('exposure').textContent)", "no proposal")
            browser.click("#ask-reasons")
            browser.wait("!document.getElementById('reasons-list').hidden", "no reasons")
            self.assertIn("touches border", browser.run("return document.getElementById('reasons-list').textContent;"))
            self.assertGreater(browser.run("return document.getElementById('reasons').width;"), 640)
            browser.click("#cloud-live")
            shown = browser.run("return shownScan.scan;")
            browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud")
            browser.click("#cloud-live")
            browser.resize(390, 844)
            for view in ("devices", "camera", "cloud", "model", "calibrate", "history"):
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
            browser.open(web.address)
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
            browser.wait("/Calibrating|being calibrated/.test(document.getElementById('state').textContent)", "no state")
            self.assertEqual(browser.run("return [...document.querySelectorAll('#calibrate > .bar')].map((b) => b.offsetParent !== null);"),
                             [False, True])
            browser.picture(self.folder / "calibrating-1600.png")
            browser.resize(390, 844)
            browser.click("nav [data-view=calibrate]")
            browser.wait("/% covered/.test(document.getElementById('calibrate-pictures').textContent)", "no coverage")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            browser.picture(self.folder / "calibrating-390.png")
            browser.wait("document.getElementById('calibrate-state').textContent === 'Calibrated and in force'", "no verdict")
            self.assertIn("The calibration is ", browser.run("return document.getElementById('verdict').textContent;"))
            self.assertTrue({"TAKEN ✓", "HOLD"} & set(browser.run("return [...window.seen];")))
            browser.picture(self.folder / "calibrated-390.png")
            browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "not ready")
            self.assertEqual(browser.complaints(), [])

    def test_a_proposal_names_the_troubles_of_the_light(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            clipped = write_clipped(pathlib.Path(folder) / "clipped.pgm")
            with Service(camera_path=clipped) as service, Web(service) as web, Browser() as browser:
                service.wait_ready()
                browser.resize(1600, 1100)
                browser.open(web.address)
                browser.wait("document.getElementById('which-camera').value === 'camera'", "no camera")
                browser.click("#propose")
                browser.wait("/symbols are clipped/.test(document.getElementById('exposure').textContent)", "no trouble")

    def test_an_exposure_is_taken_and_one_that_the_camera_refuses_is_not(self):
        double = Double()
        self.addCleanup(double.close)
        # After the camera's table: a busy machine is slow to reopen a camera.
        with service_on(double, "exposure_us = 4000.0\n[scan]\ntimeout_ms = 600000") as service, Web(service) as web, Browser() as browser, \
                service.client() as client:
            service.wait_ready()
            client.call("set", decode={"density": "pixels"})
            browser.resize(1600, 1100)
            browser.open(web.address)
            browser.wait("document.getElementById('which-camera').value === 'camera'", "no camera")
            self.assertEqual(browser.run("return document.getElementById('density').value;"), "pixels")
            told = {"present": {"exposure_us": 4000, "gain_db": 0}, "proposed": {"exposure_us": 9000, "gain_db": 0}}
            take = "document.getElementById('exposure').replaceChildren(takeExposure('camera', arguments[0]));"
            browser.run(take, told)
            browser.click("#take-exposure")
            browser.wait("/Set: exposure_us = 9000/.test(document.getElementById('exposure').textContent)", "not taken")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["exposure_us"], 9000)
            told["proposed"]["gain_db"] = 59
            browser.run(take, told)
            browser.click("#take-exposure")
            browser.wait("/0 to 24, not 59/.test(document.getElementById('message').textContent)", "no reason")
            browser.picture(self.folder / "refused-1600.png")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["gain_db"], 0)

    def test_a_page_that_is_open_for_long_holds_no_more_and_outlives_both_services(self):
        with Service() as service, Browser() as browser, tempfile.NamedTemporaryFile("w", suffix=".token") as file:
            file.write(TOKEN)
            file.flush()
            with Web(service, "--token-file", file.name, token=TOKEN) as web:
                service.wait_ready()
                browser.resize(1600, 1100)
                browser.open(web.address)
                self.enter_token(browser)
                browser.wait("!document.getElementById('scan').disabled", "nothing to draw clouds with")
                browser.click("#scan")
                browser.wait("view.ply && view.ply.count > 2000", "no cloud")
                browser.run("document.getElementById('measure').checked = true;")

                def held():  # what three.js holds of the graphics card's memory, after clouds and measurements
                    browser.click("#clear-distances" if browser.run("return measurements.distances.length > 0;") else "#whole")
                    self.measure(browser)
                    return browser.run("""
                        const buffer = view.ply.buffer;
                        for (let i = 0; i < 30; ++i) { view.show(readCloud(buffer)); view.renderer.render(view.scene, view.camera); }
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
            with Web(service, "--token-file", file.name, port=web.port, token=TOKEN):
                self.enter_token(browser)
                browser.wait("document.getElementById('message').hidden", "the complaint stays")
                browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "slsd-web is not back")
                shown = browser.run("return shownScan.scan;")
                browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud after slsd-web came back")
                self.assertLessEqual(browser.run("return document.querySelectorAll('*').length;"), nodes + 5)

    def enter_token(self, browser):
        browser.wait("document.getElementById('login').open", "no token is asked for")
        browser.run("document.getElementById('token').value = arguments[0];", TOKEN)
        browser.click("#login-form button")
        browser.wait("!document.getElementById('login').open", "the token is not taken")

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
