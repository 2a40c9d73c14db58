"""What is wrong with a page, by reading it as a browser would have to."""

from collections import Counter
from html.parser import HTMLParser

VOID = {"meta", "link", "img", "br", "hr", "input", "source"}


class Reader(HTMLParser):
    """Reads a whole page; keeps its elements and what is wrong with them."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.wrong, self.elements, self.texts = [], [], [], []
        self.feed(text)
        self.close()
        self.wrong += [f"<{tag}> is never closed" for tag in self.open]
        ids = Counter(given["id"] for _, given in self.elements if "id" in given)
        self.wrong += [f"id {name} is given {count} times" for name, count in ids.items() if count > 1]
        self.ids = set(ids)
        self.wrong += [f"{link} leads nowhere" for link in self.links if link.startswith("#") and link[1:] not in ids]

    @property
    def links(self):
        return [given["href"] for tag, given in self.elements if tag == "a"]

    @property
    def text(self):
        return " ".join("".join(self.texts).split())

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if len(dict(attrs)) < len(attrs):
            self.wrong.append(f"an attribute of <{tag}> is given twice")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> closes something else")
        if tag in ("td", "th", "p", "li", "caption", "summary"):
            self.texts.append(" ")

    def handle_data(self, data):
        if self.open[-1:] not in (["style"], ["script"]):
            self.texts.append(data)
