"""Fails where a page below a folder links to a file, or to a part of a page, that is not there. Reads what was built: links in the sources
are others, as mdBook renames pages and makes their headings' names. Addresses of other sites are left alone."""
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links of a page, and the names one can link to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.names = [], {""}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.links += [attributes[key] for key in ("href", "src") if attributes.get(key) and tag != "base"]
        self.names |= {attributes[key] for key in ("id", "name") if attributes.get(key)}


root = Path(sys.argv[1]).resolve()
pages = {path: Page(path) for path in root.rglob("*.html")}
# Every chapter once more, one after the other, for printing; and what is shown for any address, whose links start at the site's top.
own = {path: page for path, page in pages.items() if path.name not in ("print.html", "404.html")}
dead, count = set(), 0
for path, page in own.items():
    for link in page.links:
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            continue
        count += 1
        target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
        if target.is_dir():
            target /= "index.html"
        there = target.is_relative_to(root) and target.is_file()
        if not there or target in pages and unquote(parts.fragment) not in pages[target].names:
            dead.add(f"{path.relative_to(root)}: {link}")
print(*sorted(dead), f"book: {len(own)} pages, {count} links, {len(dead)} dead", sep="\n")
sys.exit(1 if dead else 0)
