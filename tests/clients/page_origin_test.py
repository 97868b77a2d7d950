#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Pages of other origins in a real browser that is let in to slsd-web: none of their requests may reach the service."""
import contextlib
import http.server
import json
import pathlib
import socket
import tempfile
import threading
import time
import unittest

from browser import Browser, is_there
from page_service import Web
from service import wait_until

QUIET_S = 1.5  # so long without a call, and what a page sent has arrived

# What the page itself never asks for when it is opened: any call of these is another page's.
INNER = ("POST /api/project HTTP/1.1\\r\\nHost: 127.0.0.1:{port}\\r\\nX-Slsd-Page: 1\\r\\nAuthorization: Bearer {token}\\r\\n"
         "Content-Type: application/json\\r\\nContent-Length: 19\\r\\n\\r\\n{{\\\"picture\\\":\\\"white\\\"}}")
SEND = """
const at = "http://127.0.0.1:{port}", inner = "{inner}";
const send = (path, options) => fetch(at + path, {{mode: "no-cors", credentials: "include", ...options}}).catch(() => null);
const tell = (promises) => Promise.allSettled(promises).then(() => {{ document.title = "sent"; }});
"""
SCRIPTS = {
    "a body behind a long address": 'tell([send("/" + "a".repeat(9000), {method: "POST", body: inner})]);',
    "bodies that are refused": """
        tell(["/", "/nothing", "/page.js", "/api/status", "/api/scan", "/api/login", "/api/cloud", "/api/project", "/%00", "/%0d%0a"]
          .flatMap((path) => [inner, " ".repeat(20000) + inner].map((body) => send(path, {method: "POST", body}))));""",
    "a body behind long headers": """
        tell([send("/", {method: "POST", body: inner, headers: {Accept: "a".repeat(120), "Accept-Language": "b".repeat(120)}}),
              send("/?" + "a".repeat(7900), {method: "POST", body: inner})]);""",
    "JSON as plain text": """
        tell([["project", {picture: "white"}], ["scan", {}], ["set", {decode: {density: "pixels"}}], ["calibrate", {action: "begin"}]]
          .map(([name, body]) => send("/api/" + name, {method: "POST", body: JSON.stringify(body)})));""",
    "JSON, a guessed key and other methods, with leave to be asked for": """
        tell(["POST", "PUT", "DELETE", "PATCH"].map((method) => fetch(at + "/api/project", {method, credentials: "include",
          headers: {"Content-Type": "application/json", "X-Slsd-Page": "1"}, body: '{"picture":"white"}'})));""",
    "a beacon": 'navigator.sendBeacon(at + "/api/project", \'{"picture":"white"}\'); tell([]);',
    "reading": """
        tell(["metrics", "preview", "exposure", "cloud?density=symbols&after=0", "calibration"]
          .flatMap((name) => [send("/api/" + name), fetch(at + "/api/" + name, {credentials: "include"})]));""",
    "pictures, scripts, styles and films": """
        const kinds = {img: "src", script: "src", link: "href", video: "src", object: "data", embed: "src"};
        tell(Object.entries(kinds).flatMap(([kind, name]) => ["metrics", "preview", "exposure", "scan"].map((what) => new Promise((done) => {
          const made = Object.assign(document.createElement(kind), {onload: done, onerror: done});
          made.rel = "stylesheet";
          made[name] = at + "/api/" + what;
          document.body.append(made);
          setTimeout(done, 3000);
        }))));""",
    "a WebSocket and an EventSource": """
        tell([new WebSocket("ws" + at.slice(4) + "/api/metrics"), new EventSource(at + "/api/metrics", {withCredentials: true})]
          .map((each) => new Promise((done) => { each.onerror = done; })));""",
    "guessed tokens": """
        tell([send("/?token=guess"), send("/api/login", {method: "POST", body: '{"token":"guess"}'}),
              send("/api/metrics?token=guess")]);"""}
# A form of each encoding; a name and a value of text/plain make JSON.
FORMS = {f"a form as {kind}": f"""
    <iframe name="there"></iframe>
    <form action="http://127.0.0.1:{{port}}/api/project" method="{method}" enctype="{kind}" target="there">
    <input name='{{{{"picture":"white","a":"' value='"}}}}'><input name="picture" value="white"></form>
    <script>document.forms[0].submit(); document.title = "sent";</script>"""
    for kind, method in (("text/plain", "post"), ("application/x-www-form-urlencoded", "post"),
                         ("multipart/form-data", "post"), ("application/x-www-form-urlencoded", "get"))}
FRAMES = """<iframe id="there" src="http://127.0.0.1:{port}/" style="opacity: 0"></iframe>
    <script>document.getElementById("there").onload = () => {{ document.title = "sent"; }};</script>"""
NAVIGATIONS = """<script>const w = open("http://127.0.0.1:{port}/api/preview"); document.title = "sent";
    setTimeout(() => {{ location = "http://127.0.0.1:{port}/api/metrics"; }}, 500);</script>"""


class Recorder:
    """In the place of slsd: notes what is asked of it, and hangs up."""

    def __init__(self, folder):
        self.socket, self.methods = pathlib.Path(folder, "slsd.sock"), []
        self.listening = socket.socket(socket.AF_UNIX)
        self.listening.bind(str(self.socket))
        self.listening.listen(64)
        self.changed = time.monotonic()
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        with contextlib.suppress(OSError):
            while True:
                connection = self.listening.accept()[0]
                threading.Thread(target=self.note, args=(connection,), daemon=True).start()

    def note(self, connection):
        with connection, contextlib.suppress(OSError, ValueError):
            self.methods.append(json.loads(connection.makefile().readline())["method"])
            self.changed = time.monotonic()

    def settle(self):
        begin = time.monotonic()
        wait_until(lambda: time.monotonic() - max(begin, self.changed) > QUIET_S, "silence")


class Elsewhere:
    """Serves one page, at any path."""

    def __init__(self):
        outer = self
        self.page = ""

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                body = outer.page.encode()
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                pass
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.port = self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()


@unittest.skipUnless(is_there(), "no Chromium with its driver (./run deps)")
class OtherOrigins(unittest.TestCase):
    def test_no_request_of_another_origin_is_obeyed(self):
        with tempfile.TemporaryDirectory() as folder:
            recorder, elsewhere = Recorder(folder), Elsewhere()
            with Web(recorder) as web, Browser(arguments=["--host-resolver-rules=MAP rebound.test 127.0.0.1"]) as browser:
                self.let_in(browser, web, recorder)
                where = {"port": web.port, "token": web.token}
                begin = SEND.format(port=web.port, inner=INNER.format(**where))
                pages = {name: f"<body><script>{begin}{script}</script>" for name, script in SCRIPTS.items()}
                pages |= {name: form.format(**where) for name, form in FORMS.items()}
                pages |= {"a frame": FRAMES.format(**where), "navigations": NAVIGATIONS.format(**where)}
                obeyed, kinds = {}, 0
                for host in ("localhost", "127.0.0.1"):  # another site; and the same site at another port, with the cookie
                    for name, page in pages.items():
                        kinds += 1
                        elsewhere.page = page
                        calls = self.calls_of(browser, recorder, f"http://{host}:{elsewhere.port}/")
                        if calls:
                            obeyed[f"{name} from {host}"] = calls
                calls = self.calls_by_another_name(browser, web, recorder)
                kinds += 1
                if calls:
                    obeyed["another name for the same address"] = calls
                print(f"requests from another origin that were obeyed: {sum(map(len, obeyed.values()))}, of {kinds} kinds of pages")
                self.assertEqual(obeyed, {})
                self.let_in(browser, web, recorder)  # it was let in all the time

    def let_in(self, browser, web, recorder):
        browser.open(web.address)
        before = len(recorder.methods)
        wait_until(lambda: "status" in recorder.methods[before:], "a call by the page itself")

    def calls_of(self, browser, recorder, address):
        browser.open("about:blank")
        recorder.settle()
        before = len(recorder.methods)
        browser.open(address)
        end = time.monotonic() + 10  # what a browser refuses to send never ends
        while time.monotonic() < end and browser.run("return document.title;") != "sent" and "/api/" not in browser.run("return location.href;"):
            time.sleep(0.05)
        recorder.settle()
        browser.close_others()
        return recorder.methods[before:]

    def calls_by_another_name(self, browser, web, recorder):
        """DNS rebinding: the browser takes it for one origin with the page that it came from."""
        browser.open("about:blank")
        recorder.settle()
        before = len(recorder.methods)
        browser.open(f"http://rebound.test:{web.port}/")
        for path, body in (("project", {"picture": "white"}), ("metrics", None)):
            browser.run("""const [path, body] = arguments;
                fetch("/api/" + path, {method: body ? "POST" : "GET", headers: {"X-Slsd-Page": "1"},
                                       body: body && JSON.stringify(body)}).finally(() => { document.title = "sent"; });""", path, body)
            browser.wait("document.title === 'sent'", "no answer")
        recorder.settle()
        return recorder.methods[before:]


if __name__ == "__main__":
    unittest.main(verbosity=2)
