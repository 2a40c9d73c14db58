"""What is wrong with a page, by reading it as a browser would have to."""

from collections import Counter
from html.parser import HTMLParser

VOID = {"meta", "link", "img", "br", "input"}


class Reader(HTMLParser):
    """Reads a whole page; keeps its elements and text, and what is wrong with them."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.wrong, self.elements, self.texts = [], [], [], []
        self.feed(text)
        ids = Counter(given["id"] for _, given in self.elements if "id" in given)
        links = [given["href"] for tag, given in self.elements if tag == "a"]
        self.wrong += [f"<{tag}> is never closed" for tag in self.open]
        self.wrong += [f"id {name} is given {count} times" for name, count in ids.items() if count > 1]
        self.wrong += [f"{link} leads nowhere" for link in links if link[1:] not in ids]
        self.text = " ".join("".join(self.texts).split())

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> closes something else")
        self.texts.append(" ")

    def handle_data(self, data):
        if self.open[-1:] not in (["style"], ["script"]):
            self.texts.append(data)
