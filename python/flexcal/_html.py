"""Results as a notebook shows them: the headline, what was found, and the main figure."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING, Any

from ._frames import judging

if TYPE_CHECKING:
    from ._fits import ClosedLoop, Identification, Trace


def identification(result: Identification) -> str:
    """Of an identification."""
    document = result.to_dict()
    facts = _facts(document["reduced_chi2"], f"{len(result.parameters)} parameters", document["strategy"], document["solver"])
    return _card(
        _headline(result.problem.title, document["registered"], document, facts),
        _note(result.why_not_trusted),
        _figure(result.figures, "held-out-errors"),
        _folded("parameters", result.parameters),
    )


def closed_loop(result: ClosedLoop) -> str:
    """Of a loop."""
    document = result.to_dict()
    facts = _facts(document["after"]["reduced_chi2"], result.verdict)
    found = [_effect(entry) for entry in document["effects"]]
    if result.unexplained is not None:
        found.append(f"structure without a known law at {escape(str(result.unexplained['where']))}")
    main = "effect-1" if "effect-1" in result.figures else "held-out-errors"
    return _card(
        _headline(result.problem.title, document["before"], document["after"], facts),
        _note(result.why_not_trusted),
        _list(found) if found else "<p>No effect was found.</p>",
        _figure(result.figures, main),
        _folded("parameters", result.parameters),
    )


def _gain(entry: dict[str, Any]) -> str:
    """Return what an effect takes off the error: a length, an angle of tilts, or pixels."""
    for key, unit, decimals in [("mm", " mm", 4), ("deg", "°", 5), ("px", " px", 4)]:
        gain = entry.get(f"expected_gain_{key}")
        if gain is not None:
            return f"{gain:.{decimals}f}{unit}"
    return ""


def trace(result: Trace) -> str:
    """Of a trace."""
    document = result.to_dict()
    facts = _facts(document["reduced_chi2"], f"{document['tried']} candidates tried")
    rows = judging(document)
    mean = _mm(document[rows])
    ranked = [
        f"{escape(entry['description'])}: p {_probability(entry['p_value'])}, takes {_gain(entry)} off the rms error"
        for entry in document["ranking"][:5]
    ]
    return _card(
        f"<p><b>{escape(result.fit.problem.title)}</b><br>mean error of the {rows.replace('_', '-')} poses {mean}{facts}</p>",
        _list(ranked),
        _folded("parameters", result.parameters),
    )


def words(text: str) -> str:
    """Of words alone."""
    return f"<pre>{escape(text)}</pre>"


def _card(*parts: str) -> str:
    return f'<div style="max-width: 52em">{"".join(parts)}</div>'


def _headline(title: str, before: dict[str, Any], after: dict[str, Any], facts: str) -> str:
    rows = judging(after)
    change = f'<span style="font-size: 1.6em">{_mm(before[rows])} → <b>{_mm(after[rows])}</b></span>'
    return f"<p><b>{escape(title)}</b><br>{change}<br>mean error of {after[rows]['n']} {rows.replace('_', '-')} poses{facts}</p>"


def _facts(chi2: float | None, *facts: str) -> str:
    shown = ([] if chi2 is None else [f"χ²/ν {chi2:.2f}"]) + [escape(fact) for fact in facts]
    return "".join(f" · {fact}" for fact in shown)


def _mm(errors: dict[str, Any]) -> str:
    mean = (errors.get("mean_mm") or {}).get("norm")
    return "–" if mean is None else f"{mean:.4f} mm"


def _effect(entry: dict[str, Any]) -> str:
    law = ((entry.get("claims") or {}).get("law") or {}).get("probability")
    sure = "" if law is None else f" (law {100 * law:.0f} %)"
    sizes = [
        f"{escape(own['name'])} = {own['estimate']:.4g}"
        + ("" if own["std_error"] is None else f" ± {own['std_error']:.2g}")
        + f" {escape(own['unit'])}"
        for own in entry["parameters"]
    ]
    return f"{escape(entry['status'])}: <b>{escape(entry['description'])}</b>{sure}<br><small>{'; '.join(sizes)}</small>"


def _probability(p: float) -> str:
    return "below 1e-16" if p < 1e-16 else f"{p:.2g}"


def _note(reason: str | None) -> str:
    return "" if reason is None else f'<p style="color: #b4540a">{escape(reason)}</p>'


def _list(points: list[str]) -> str:
    return "<ol>" + "".join(f"<li>{point}</li>" for point in points) + "</ol>"


def _figure(figures: dict[str, str], name: str) -> str:
    # As a picture, so that its styles stay its own.
    if name not in figures:
        return ""
    data = base64.b64encode(figures[name].encode()).decode()
    return f'<img style="max-width: 100%" alt="{escape(name)}" src="data:image/svg+xml;base64,{data}">'


def _folded(title: str, table: Any) -> str:
    return f"<details><summary>{escape(title)}</summary>{table.to_html(border=0)}</details>"
