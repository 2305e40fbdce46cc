"""A server for the page of answers in words, on this machine and for whoever has its address: that holds a secret.

It speaks HTTP to the loopback address alone. A page of another site can neither guess the address nor save: it would
have to come under this server's name, from this server's page.
"""

import base64
import errno
import importlib.util
import json
import os
import secrets
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from labgrader.handin.reading import Lab
from labgrader.report.texts import MATHJAX_FILES, PICTURES, read_texts, save, texts_page

LONGEST_REQUEST = 100_000  # bytes
NOTHING = "default-src 'none'"
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'self' 'nonce-{nonce}'; connect-src 'self'; "
    "img-src 'self' data:; font-src 'self'"
)
KINDS = {".js": "text/javascript", ".woff": "font/woff"}  # of MathJax's files that a page loads


class TextsServer(ThreadingHTTPServer):
    """Serves the answers in words of one lab, one request at a time; a browser opens connections that ask for nothing.

    url: of the first question's page. Raises ValueError as `read_texts`.
    """

    def __init__(self, course: Path, lab: Lab, port: int = 0):
        self.course, self.lab, self.token = Path(course), lab, secrets.token_urlsafe(16)
        self.questions, self.lock = list(read_texts(course, lab)), threading.Lock()
        self.pictures: dict[tuple[str, str], tuple[str, str]] = {}  # kind and base64 of what the pages show
        try:
            super().__init__(("127.0.0.1", port), Handler)
        except OSError as error:
            what = "is in use by another program" if error.errno == errno.EADDRINUSE else f"cannot be used ({error})"
            raise ValueError(f"port: {port} {what}; choose another one, or leave --port out for a free one") from error
        self.host = f"127.0.0.1:{self.server_address[1]}"

    @property
    def url(self) -> str:
        """The address of the first question's page."""
        return f"http://{self.host}/{self.token}/{self.questions[0]}"


class Handler(BaseHTTPRequestHandler):
    """Answers requests for a question's page, and those that save points."""

    server: TextsServer

    def asked_for(self) -> list[str]:
        """The parts of the address below the secret; none without it, and for another host's name."""
        _, token, *rest = (*self.path.partition("?")[0].split("/"), "")
        is_ours = secrets.compare_digest(token.encode(), self.server.token.encode())
        return rest[:-1] if is_ours and self.headers.get("Host") == self.server.host else []

    def question(self) -> str | None:
        """The question that is asked for, None for what is none."""
        name = "/".join(self.asked_for())
        return name if name in self.server.questions else None

    def do_GET(self) -> None:
        """Send a page, which nothing but its own script may run on."""
        question, place = self.question(), self.asked_for()
        if question is None:
            kind, content = self.picture(*place[1:]) if place[:1] == [PICTURES] else self.mathjax(place)
            status = HTTPStatus.OK if kind else HTTPStatus.NOT_FOUND
            self.reply(status, content or b"There is no such page.", kind or "text/plain")
            return
        nonce = secrets.token_urlsafe(16)
        with self.server.lock:
            texts = read_texts(self.server.course, self.server.lab)[question]
            for text in texts.answers:
                both = {(text.key, name): next(iter(one.items())) for name, one in text.pictures.items()}
                self.server.pictures |= both
        page = texts_page(self.server.lab, texts, self.server.questions, nonce)
        self.reply(HTTPStatus.OK, page, "text/html", POLICY.format(nonce=nonce))

    def picture(self, key: str = "", name: str = "") -> tuple[str, bytes]:
        """The kind and the bytes of a picture on a page; "" if there is none."""
        kind, data = self.server.pictures.get((key, name), ("", ""))
        return kind, base64.b64decode(data)

    def mathjax(self, place: list[str]) -> tuple[str, bytes]:
        """The kind and the bytes of a file of MathJax's, which formgrader brings along; "" if there is none."""
        found = importlib.util.find_spec("jupyter_server_mathjax")
        root = Path(found.origin).resolve().parent / "static" if found else Path(os.devnull)
        path = root.joinpath(*place[1:]).resolve()
        if (
            place[:1] != [MATHJAX_FILES]
            or not path.is_relative_to(root)
            or path.suffix not in KINDS
            or not path.is_file()
        ):
            return "", b""
        return KINDS[path.suffix], path.read_bytes()

    def do_POST(self) -> None:
        """Save points and a comment."""
        question, size = self.question(), self.headers.get("Content-Length", "")
        is_own = self.headers.get("Origin") == f"http://{self.server.host}"
        if question is None or not is_own or not size.isdecimal() or int(size) > LONGEST_REQUEST:
            self.reply(HTTPStatus.FORBIDDEN, "This comes from another page.")
            return
        try:
            data = json.loads(self.rfile.read(int(size)))
            with self.server.lock:
                left = save(self.server.course, self.server.lab, question, data if isinstance(data, dict) else {})
        except ValueError as error:
            self.reply(HTTPStatus.BAD_REQUEST, str(error))
            return
        self.reply(HTTPStatus.OK, str(left))

    def reply(self, status: HTTPStatus, text: str | bytes, kind: str = "text/plain", policy: str = NOTHING) -> None:
        """Send what no browser keeps, frames or takes for something else."""
        content = text.encode() if isinstance(text, str) else text
        kind = f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
        headers = {"Content-Type": kind, "Content-Length": str(len(content))}
        headers |= {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY"}
        headers |= {"Content-Security-Policy": policy, "Referrer-Policy": "same-origin"}
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *words: object) -> None:
        """Say nothing in the terminal: an address holds the secret."""
