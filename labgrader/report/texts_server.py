"""A server for the page of answers in words, on this machine and for whoever has its address: that holds a secret.

It speaks HTTP to the loopback address alone. A page of another site can neither guess the address nor save: it would
have to come under this server's name, from this server's page.
"""

import json
import secrets
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from labgrader.handin.reading import Lab
from labgrader.report.texts import read_texts, save, texts_page

LONGEST_REQUEST = 100_000  # bytes
NOTHING = "default-src 'none'"
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'nonce-{nonce}'; connect-src 'self'; img-src data:"


class TextsServer(ThreadingHTTPServer):
    """Serves the answers in words of one lab, one request at a time; a browser opens connections that ask for nothing.

    url: of the first question's page. Raises ValueError as `read_texts`.
    """

    def __init__(self, course: Path, lab: Lab, port: int = 0):
        self.course, self.lab, self.token = Path(course), lab, secrets.token_urlsafe(16)
        self.questions, self.lock = list(read_texts(course, lab)), threading.Lock()
        super().__init__(("127.0.0.1", port), Handler)
        self.host = f"127.0.0.1:{self.server_address[1]}"

    @property
    def url(self) -> str:
        """The address of the first question's page."""
        return f"http://{self.host}/{self.token}/{self.questions[0]}"


class Handler(BaseHTTPRequestHandler):
    """Answers requests for a question's page, and those that save points."""

    server: TextsServer

    def question(self) -> str | None:
        """The question that is asked for; None for an address without the secret, and for another host's name."""
        _, token, *rest = (*self.path.split("/"), "")
        is_ours = secrets.compare_digest(token.encode(), self.server.token.encode())
        name = rest[0] if is_ours and self.headers.get("Host") == self.server.host else None
        return name if name in self.server.questions else None

    def do_GET(self) -> None:
        """Send a page, which nothing but its own script may run on."""
        question = self.question()
        if question is None:
            self.reply(HTTPStatus.NOT_FOUND, "There is no such page.")
            return
        nonce = secrets.token_urlsafe(16)
        with self.server.lock:
            texts = read_texts(self.server.course, self.server.lab)[question]
        page = texts_page(self.server.lab, texts, self.server.questions, nonce)
        self.reply(HTTPStatus.OK, page, "text/html", POLICY.format(nonce=nonce))

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

    def reply(self, status: HTTPStatus, text: str, kind: str = "text/plain", policy: str = NOTHING) -> None:
        """Send a text that no browser keeps, frames or takes for something else."""
        content = text.encode()
        headers = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(content))}
        headers |= {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY"}
        headers |= {"Content-Security-Policy": policy, "Referrer-Policy": "same-origin"}
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *words: object) -> None:
        """Say nothing in the terminal: an address holds the secret."""
