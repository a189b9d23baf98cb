"""Parts of JSON results as DataFrames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd


def named_frame(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.json_normalize(entries, sep="_").set_index("name")


def parameters_frame(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    numbers = ["nominal", "estimate", "std_error", "identified"]
    return pd.DataFrame(entries).set_index("name").astype(dict.fromkeys(numbers, np.float64))


def judging(parts: dict[str, Any]) -> str:
    """The rows that judge a fit: those held out, or without such rows those left out in turn."""
    return "left_out" if parts.get("held_out") is None and "left_out" in parts else "held_out"


def compared_frame(entries: list[dict[str, Any]], *first: str) -> pd.DataFrame:
    import pandas as pd

    names = [*first, "strategy", "solver"]
    parts = ("identification", judging(entries[0]) if entries else "held_out")
    rest = ["iterations", "evaluations", "seconds", "termination", "trusted", "reduced_chi2", "condition_number"]
    rows = [
        [entry[name] for name in names]
        + [_norm(entry[part], "mean_mm") for part in parts]
        + [entry[name] for name in rest]
        for entry in entries
    ]
    return pd.DataFrame(rows, columns=[*names, *(f"{part}_mean_mm" for part in parts), *rest])


def residuals_frame(columns: dict[str, bytearray | tuple[bytearray, list[str]]]) -> pd.DataFrame:
    import pandas as pd

    frame: dict[str, Any] = {}
    for name, values in columns.items():
        if isinstance(values, tuple):
            codes, words = values
            frame[name] = pd.Categorical.from_codes(np.frombuffer(codes, dtype=np.int64), pd.Index(words))
        elif name in ("line", "outlier", "held_out"):
            whole = np.frombuffer(values, dtype=np.int64)
            frame[name] = whole if name == "line" else whole.astype(np.bool_)
        else:
            frame[name] = np.frombuffer(values, dtype=np.float64)
    return pd.DataFrame(frame, copy=False)


def errors_frame(document: dict[str, Any]) -> pd.DataFrame:
    import pandas as pd

    stages = {"registered": document["registered"]}
    if "before" in document:
        stages |= {"declared": document["before"], "closed": document["after"]}
    else:
        stages["identified"] = document
    rows = []
    for stage, parts in stages.items():
        for part in ("identification", judging(parts)):
            rows.append(error_row(stage, parts[part]) | {"rows": part})
    return pd.DataFrame(rows).set_index(["arm", "rows"])


def error_row(arm: str, own: dict[str, Any]) -> dict[str, Any]:
    return {"arm": arm, "n": own["n"]} | {of: _norm(own, of) for of in ("mean_mm", "rms_mm", "max_mm")}


def _norm(errors: dict[str, Any], statistic: str) -> float:
    """A statistic of the lengths of errors; NaN where rows measure no lengths."""
    return float((errors.get(statistic) or {}).get("norm", np.nan))


def effects_frame(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    claims = ("place", "depends_on", "law")
    names = ["effect", "status", "description", "declaration", "p_value"]
    names += [name for claim in claims for name in (claim, f"{claim}_probability")] + ["stability"]
    rows = []
    for entry in entries:
        row = [entry[name] for name in ("effect", "status", "description", "declaration", "p_value")]
        for claim in claims:
            said = (entry.get("claims") or {}).get(claim) or {}
            row += [said.get("value"), said.get("probability")]
        rows.append([*row, entry.get("stability")])
    return pd.DataFrame(rows, columns=names)
