"""A page as its reader sees it: tags and words."""

import html.parser
import re


class Outline(html.parser.HTMLParser):
    """Open tags, attributes and visible words of a page; refuses tags closed in a wrong order."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.words = [], [], []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if "style" not in self.open:
            self.words.append(text)

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.words))

    def outside(self, figures):
        """What the page takes from elsewhere, but for links to numbers in its folder of figures."""
        found = [
            a[name]
            for tag, a in self.tags
            for name in ("src", "href", "srcset", "data", "action")
            if name in a and not (tag == "a" and re.fullmatch(rf"{figures}/\w+\.csv", a[name]))
        ]
        return [one for one in found if not one.startswith(("data:", "#"))]
