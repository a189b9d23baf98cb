"""What a notebook shows."""

from __future__ import annotations

from html.parser import HTMLParser
from typing import Any

import flexcal
import pytest


class Tags(HTMLParser):
    """Reads a page and keeps its text; every tag has to be closed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.pictures = 0
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "img":
            self.pictures += 1
            assert (dict(attrs)["src"] or "").startswith("data:image/svg+xml;base64,")
        elif tag != "br":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def change(result: flexcal.Identification | flexcal.ClosedLoop, *arms: str) -> str:
    means: dict[Any, float] = result.errors["mean_mm"].to_dict()
    return " → ".join(f"{means[arm, 'held_out']:.4f} mm" for arm in arms)


def test_pages(lunar: flexcal.Problem, identified: flexcal.Identification, closed: flexcal.ClosedLoop) -> None:
    page = Tags(identified._repr_html_())
    assert change(identified, "registered", "identified") in page.text and "joint2.stiffness" in page.text and page.pictures == 1
    page = Tags(closed._repr_html_())
    assert change(closed, "declared", "closed") in page.text and "link A bows with temperature" in page.text and page.pictures == 1
    trace = lunar.trace()
    assert trace.ranking["description"][0] in Tags(trace._repr_html_()).text
    assert trace.residuals.equals(identified.residuals)
    hostile = flexcal.Problem(lunar.text.replace("Surface sampling arm", "<script>alert(1)</script>"))
    result = hostile.identify(lunar.files)
    assert "<script>" not in result._repr_html_()
    for shown in (identified, closed, trace):
        assert shown.summary() == str(shown) and "lunar-sampler" in repr(shown)


def test_verdict_and_statuses(closed: flexcal.ClosedLoop) -> None:
    text, page = " ".join(closed.summary().split()), Tags(closed._repr_html_()).text
    verdicts = {"explained": "Explained: ", "unexplained": "Unexplained: ", "nothing-found": "Nothing found: "}
    assert "probable" in set(closed.effects["status"]) or "Probably explained: " not in text
    text = text.replace("Probably explained: ", "Unexplained: ")
    assert [verdict for verdict, words in verdicts.items() if words in text] == [closed.verdict]
    assert closed.verdict in page
    for status, description in zip(closed.effects["status"], closed.effects["description"], strict=True):
        # Effects whose status is "found" stand in the list of what was found, without that word.
        words = description if status == "found" else f"{status}: {description}"
        assert words in text and words in page


def test_designs(lunar: flexcal.Problem) -> None:
    check = lunar.check()
    assert check.suffices and len(check.parameters) == 32
    assert check.summary().splitlines()[0] in Tags(check._repr_html_()).text
