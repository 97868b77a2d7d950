# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Headless Chromium by its driver, over the WebDriver protocol, with the standard library alone. The tests of a program share
one: each begins without a page, cookies, cache and complaints."""
import atexit
import base64
import json
import re
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request

TIMEOUT_S = 600
ARGUMENTS = ["--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars",
             "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-rasterization"]


def is_there():
    return all(map(shutil.which, ("chromium", "chromedriver")))


def free_port():
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return listening.getsockname()[1]


class Browser:
    idle = []  # what tests left behind that need no arguments

    def __init__(self, downloads=None, arguments=()):
        self.arguments = tuple(arguments)
        if self.idle and not self.arguments:
            self.__dict__ = self.idle.pop().__dict__
        else:
            self.start()
            atexit.register(self.end)
        self.devtools("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(downloads or self.profile))

    def start(self):
        self.port = free_port()
        self.profile = tempfile.mkdtemp(prefix="slsd-test-chromium-")
        self.driver = subprocess.Popen(["chromedriver", f"--port={self.port}"], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
        options = {"binary": shutil.which("chromium"), "args": [*ARGUMENTS, *self.arguments, f"--user-data-dir={self.profile}"]}
        end = time.monotonic() + TIMEOUT_S
        while True:
            try:
                made = self.ask("POST", "/session", {"capabilities": {"alwaysMatch": {
                    "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"},
                    "timeouts": {"script": 1000 * TIMEOUT_S, "pageLoad": 1000 * TIMEOUT_S}}}})
                break
            except (urllib.error.URLError, ConnectionError):
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)
        self.session = "/session/" + made["sessionId"]

    def ask(self, method, path, body=None):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", method=method,
                                         data=None if body is None else json.dumps(body).encode(),
                                         headers={"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=TIMEOUT_S) as response:
                return json.load(response)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()) from error

    def open(self, url):
        self.ask("POST", self.session + "/url", {"url": url})

    def run(self, script, *arguments):
        return self.ask("POST", self.session + "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, condition, what, seconds=TIMEOUT_S):
        """Until an expression of the page's is true; its value."""
        end = time.monotonic() + seconds
        while True:
            value = self.run(f"return {condition};")
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"{what}; the page says: " + self.run("return document.body.innerText;"))
            time.sleep(0.02)

    def click(self, selector):
        element = self.ask("POST", self.session + "/element", {"using": "css selector", "value": selector})
        self.ask("POST", f"{self.session}/element/{next(iter(element.values()))}/click", {})

    def drag(self, selector, begin, end):
        """With the mouse, as a hand does, between pixels from the upper left corner of an element. The element may move."""
        element, x, y = self.run("""
            const element = document.querySelector(arguments[0]);
            element.scrollIntoView({block: "center"});
            const {left, top, right, bottom} = element.getBoundingClientRect();
            return [element, left - (Math.max(0, left) + Math.min(innerWidth, right)) / 2,
                    top - (Math.max(0, top) + Math.min(innerHeight, bottom)) / 2];""", selector)
        moves = [{"type": "pointerMove", "duration": 0, "origin": element, "x": round(x + place[0]), "y": round(y + place[1])}
                 for place in (begin, end)]
        self.ask("POST", self.session + "/actions", {"actions": [
            {"type": "pointer", "id": "mouse", "actions": [moves[0], {"type": "pointerDown", "button": 0}, moves[1],
                                                           {"type": "pointerUp", "button": 0}]}]})

    def key(self, key):
        self.ask("POST", self.session + "/actions", {"actions": [
            {"type": "key", "id": "keys", "actions": [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]}]})

    def devtools(self, command, **parameters):
        return self.ask("POST", self.session + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def close_others(self):
        """Windows that pages opened; the first goes on."""
        first, *others = self.ask("GET", self.session + "/window/handles")
        for handle in (*others, first):
            self.ask("POST", self.session + "/window", {"handle": handle})
            if handle != first:
                self.ask("DELETE", self.session + "/window")

    def resize(self, width, height):
        # A headless window is never narrower than 500 px; what a narrow one shows is asked of the engine itself.
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)

    def picture(self, file):
        shot = self.devtools("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(shot["data"]))

    def complaints(self, expected=None):
        """What the browser wrote to its console as an error: refused by the policy, or thrown; then what the page says.
        Errors that match an expected pattern are left out."""
        log = self.ask("POST", self.session + "/se/log", {"type": "browser"})
        errors = [entry["message"] for entry in log if entry["level"] == "SEVERE" and not (expected and re.search(expected, entry["message"]))]
        return errors and [*errors, self.run("return document.body.innerText;")]

    def __enter__(self):
        return self

    def __exit__(self, failure, *_):
        if failure or self.arguments:
            self.end()
        else:
            self.forget()
            self.idle.append(self)

    def forget(self):
        self.close_others()
        self.open("about:blank")
        for command in ("Network.clearBrowserCookies", "Network.clearBrowserCache", "Emulation.clearDeviceMetricsOverride"):
            self.devtools(command)
        self.devtools("Emulation.setEmulatedMedia", features=[])
        self.complaints()

    def end(self):
        if self.driver.poll() is not None:
            return
        try:
            self.ask("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()
            shutil.rmtree(self.profile, ignore_errors=True)
