# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A proxy that has several pages below paths of one name, as nginx's `location /left/ { proxy_pass ...:8384/; }`."""
import http.client
import http.server
import threading

HOPS = {"connection", "keep-alive", "transfer-encoding", "te", "upgrade", "proxy-connection"}


class PathProxy:
    def __init__(self, **ports):
        outer = self
        self.asked = []

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def pass_on(self):
                outer.asked.append(self.path)
                name, _, rest = self.path[1:].partition("/")
                if name not in ports:
                    self.send_error(404)
                    return
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                connection = http.client.HTTPConnection("127.0.0.1", ports[name], timeout=600)
                connection.putrequest(self.command, "/" + rest, skip_host=True, skip_accept_encoding=True)
                for header, value in self.headers.items():
                    if header.lower() not in HOPS:
                        connection.putheader(header, value)
                connection.endheaders(body or None)
                answer = connection.getresponse()
                content = answer.read()
                self.send_response(answer.status)
                for header, value in answer.headers.items():
                    if header.lower() not in HOPS | {"content-length"}:
                        self.send_header(header, value)
                if answer.status != 204:
                    self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)
                connection.close()

            do_GET = do_POST = do_HEAD = pass_on

            def log_message(self, *_):
                pass
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.port = self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()
