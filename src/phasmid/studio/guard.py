"""Who may come in: the head of a request is judged before anything else is done with it."""

from __future__ import annotations

import hmac
import re
from dataclasses import dataclass

from phasmid.errors import plain

LARGEST_HEAD = 16_384
"""Bytes of a request's line and headers."""

LARGEST = 10_000_000
"""Bytes of a body or of a message; where it is told, a megabyte is a million of them."""

MOST_HEADERS = 100

NAME = re.compile(rb"[-!#$%&'*+.^_`|~0-9A-Za-z]+")
VALUE = re.compile(rb"[\t\x20-\x7e\x80-\xff]*")
TARGET = re.compile(rb"[\x21-\x7e]+")
LENGTH = re.compile(r"[0-9]{1,18}")


class Refused(Exception):
    """A request that gets no more than a status and a sentence.

    Attributes:
        status: Of HTTP.
        text: What whoever asked is told.
        reason: What the log says; empty where it says nothing.
    """

    def __init__(self, status: int, text: str, *, reason: str = "") -> None:
        super().__init__(text)
        self.status = status
        self.text = text
        self.reason = reason


@dataclass(frozen=True, slots=True)
class Head:
    """The line and the headers of a request.

    Attributes:
        method: In capitals, as ``GET``.
        path: As it was sent: nothing in it is decoded.
        query: What follows the first question mark.
        headers: Names in small letters, and values.
    """

    method: str
    path: str
    query: str
    headers: tuple[tuple[str, str], ...]

    def values(self, name: str) -> list[str]:
        """All values of a header."""
        return [value for key, value in self.headers if key == name]


def read_head(raw: bytes) -> Head:
    """Read the head of a request, which ends with an empty line.

    Raises:
        Refused: It is no HTTP/1.1.
    """
    first, *lines = raw.removesuffix(b"\r\n\r\n").split(b"\r\n")
    parts = first.split(b" ")
    if len(parts) != 3 or not NAME.fullmatch(parts[0]) or not TARGET.fullmatch(parts[1]):
        raise Refused(400, "the request is no HTTP.")
    if parts[2] != b"HTTP/1.1":
        known = re.fullmatch(rb"HTTP/[0-9](\.[0-9])?", parts[2])
        raise Refused(505 if known else 400, "the request must be HTTP/1.1.")
    if len(lines) > MOST_HEADERS:
        raise Refused(431, f"the request has {len(lines)} headers; the limit is {MOST_HEADERS}.")
    headers = []
    for line in lines:
        name, colon, value = line.partition(b":")
        if not colon or not NAME.fullmatch(name) or not VALUE.fullmatch(value):
            raise Refused(400, "a header of the request is none.")
        headers.append((name.decode("ascii").lower(), value.strip(b" \t").decode("latin-1")))
    path, _, query = parts[1].decode("ascii").partition("?")
    return Head(parts[0].decode("ascii"), path, query, tuple(headers))


@dataclass(frozen=True, slots=True)
class Guard:
    """Knows whom the page is for.

    Attributes:
        hosts: What the header Host may be, each with its port: a name that somebody else points
            at this machine is none of them.
        token: Carried by the address that is opened, and by the cookie from then on.
        cookie: Its name.
    """

    hosts: frozenset[str]
    token: str
    cookie: str

    def check(self, head: Head, own: str) -> None:
        """Refuse what was not meant for us, or would come from another page.

        Args:
            head: Head of the request.
            own: The header Host for the address at which the connection arrived.

        Raises:
            Refused: With 403, 405 or 413.
        """
        hosts, origins = head.values("host"), head.values("origin")
        if len(hosts) != 1 or hosts[0] not in self.hosts | {own}:
            raise Refused(403, "forbidden.", reason=f"a request for host {shown(hosts)}")
        if origins and origins != [f"http://{hosts[0]}"]:
            raise Refused(403, "forbidden.", reason=f"a request of origin {shown(origins)}")
        self._check_body(head)
        if head.method not in ("GET", "HEAD"):
            raise Refused(405, "the method must be GET or HEAD.")

    def check_page(self, head: Head) -> None:
        """Refuse a websocket that no page of ours has opened: browsers tell the page's origin.

        Raises:
            Refused: With 403.
        """
        if not head.values("origin"):
            raise Refused(403, "forbidden.", reason="a websocket without an origin")

    def check_known(self, head: Head) -> None:
        """Refuse who has not opened the address with the token.

        Raises:
            Refused: With 401.
        """
        crumbs = [crumb.strip() for value in head.values("cookie") for crumb in value.split(";")]
        prefix = f"{self.cookie}="
        given = [crumb.removeprefix(prefix) for crumb in crumbs if crumb.startswith(prefix)]
        if not any(map(self._is_token, given)):
            raise unknown()

    def check_query(self, head: Head) -> None:
        """Refuse an address with a wrong token, or with anything else.

        Raises:
            Refused: With 401.
        """
        if not self._is_token(head.query.removeprefix("token=")):
            raise unknown()

    def _is_token(self, text: str) -> bool:
        # It takes the same time however much of it is right.
        return hmac.compare_digest(text.encode("latin-1"), self.token.encode("latin-1"))

    def _check_body(self, head: Head) -> None:
        lengths = head.values("content-length")
        if len(set(lengths)) > 1 or not all(LENGTH.fullmatch(text) for text in lengths):
            raise Refused(400, "the length of the request is no number.")
        if lengths and int(lengths[0]) > LARGEST:
            raise Refused(413, too_large("request", int(lengths[0])))
        if (lengths and int(lengths[0]) > 0) or head.values("transfer-encoding"):
            # What changes the robot goes by the websocket.
            raise Refused(405 if head.method != "GET" else 400, "a request must have no body.")


def too_large(what: str, size: int) -> str:
    """What is said of too many bytes."""
    told = size / 1_000_000
    return (
        f"{what} is {told:.{0 if told >= 11 else 1}f} MB; the limit is {LARGEST // 1_000_000} MB."
    )


def unknown() -> Refused:
    """What is said to who brings no token."""
    sentence = "open the address that phasmid studio printed: it carries the token."
    return Refused(401, sentence)


def shown(values: list[str]) -> str:
    """What a header said, fit for one line of a log."""
    return plain(", ".join(values))[:100] or "none"
