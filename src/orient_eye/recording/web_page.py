"""Rerun's page for the browser, as a page that talks to this machine only.

The page that the viewer serves sends usage statistics from the browser, whatever the viewer's own settings are, and
asks others for fonts, examples and newer versions. Here it gets a Content-Security-Policy on its way, by which browsers
refuse to ask anyone else, and loses its links to others, whom they would call beforehand.
"""

import http.client
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

LOCAL = "127.0.0.1"
_ELSEWHERE = re.compile(rb"<link[^>]*https://[^>]*>")
_OWN = {"connection", "content-length", "content-security-policy", "date", "server", "transfer-encoding"}
"""Headers that are not passed on."""


@contextmanager
def served(behind: int, data: int) -> Iterator[int]:
    """Serve the page as long as the block lasts, at the port that is given.

    Args:
        behind: port of the viewer's own page.
        data: port of the recording.
    """
    policy = f"default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob: http://{LOCAL}:{data}"

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            with suppress(OSError):  # the browser, or the viewer, has gone
                self._pass_on()

        def _pass_on(self) -> None:
            connection = http.client.HTTPConnection(LOCAL, behind, timeout=30)
            connection.request("GET", self.path, headers={"Accept-Encoding": "gzip"})
            answer = connection.getresponse()
            content = answer.read()
            if answer.headers.get_content_type() == "text/html":
                content = _ELSEWHERE.sub(b"", content)
            self.send_response(answer.status)
            for name, value in answer.getheaders():
                if name.lower() not in _OWN:
                    self.send_header(name, value)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Content-Security-Policy", policy)
            self.end_headers()
            self.wfile.write(content)
            connection.close()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer((LOCAL, 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
