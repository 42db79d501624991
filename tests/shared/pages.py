"""A page as tests read it: its tags, its values, and the planes that it holds."""

import base64
import zlib
from html.parser import HTMLParser

import numpy as np

HOSTILE = "../\"><script>alert('x')</script><img src=http://example.org/x onerror=alert(1)>"


class Page(HTMLParser):
    """Start tags with attributes, text, and the values of <data> elements with their text."""

    def __init__(self, html):
        super().__init__(convert_charrefs=True)
        self.tags, self.text, self.values, self.open = [], "", [], None
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "data":
            self.open = dict(attrs)["value"]

    def handle_data(self, data):
        self.text += data
        if self.open is not None:
            self.values.append((float(self.open), data))
            self.open = None


def codes(embedded):
    """The planes of 16 bits and their names, from their differences."""
    raw = zlib.decompress(base64.b64decode(embedded.data))
    low, high = np.frombuffer(raw, np.uint8).reshape(2, -1).astype(int)
    signed = low + 256 * high
    steps = np.where(signed % 2, -(signed + 1) // 2, signed // 2)
    found = np.cumsum(steps).reshape(len(embedded.names), embedded.height, embedded.width)
    for place, name in enumerate(embedded.names):
        if name.split(".")[-1] in ("G", "B"):
            found[place] += found[place - 1]
    return dict(zip(embedded.names, (found % 2**16).astype(np.uint16), strict=True))
