"""Keys of a section in the text of a problem."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np

from .errors import InputError

HeldOut: TypeAlias = "Literal['none'] | float | str"
"""Rows that judge and are not fitted: none, their fraction, or the name of a session."""


def toml_number(name: str, value: float, zero: bool = False) -> str:
    """A number above 0, or at ``zero`` also 0, as TOML."""
    number = float(value)
    if not (math.isfinite(number) and (number > 0.0 or (zero and number == 0.0))):
        raise InputError(f"{name}: {value!r} is {'below' if zero else 'not above'} 0", key=name)
    return repr(number)


def toml_held_out(held_out: HeldOut) -> str:
    """The value of ``held_out``, as docs/problem.md has it."""
    if isinstance(held_out, str):
        if held_out == "none":
            return '"none"'
        if held_out and not re.search(r'["\\\x00-\x1f]', held_out):
            return f'{{ session = "{held_out}" }}'
    elif isinstance(held_out, (int, float)) and not isinstance(held_out, bool) and 0.0 < held_out < 1.0:
        return f"{{ fraction = {float(held_out)!r}, seed = 1 }}"
    hint = ""
    if isinstance(held_out, (int, float)) and not isinstance(held_out, bool) and 1 <= held_out < 100:
        hint = f"; write {held_out / 100:g} for {held_out} %"
    raise InputError(
        f"held_out: {held_out!r} is neither \"none\" nor a fraction between 0 and 1 nor the name of a session{hint}", key="held_out"
    )


def toml_point(name: str, point: Sequence[float]) -> str:
    """Three coordinates as TOML."""
    try:
        values = np.asarray(point, dtype=float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(f"{name}: three finite numbers are needed, x, y, z, not {point!r}", key=name)
    return repr(values.tolist())


def with_keys(text: str, section: str, values: dict[str, str]) -> str:
    """The text of a problem with other values of keys of a section, each of which stands on one line or is added."""
    for key, value in values.items():
        head = re.search(rf"^[ \t]*\[[ \t]*{section}[ \t]*\][ \t]*(#.*)?\r?$", text, re.MULTILINE)
        if re.search(rf"^[ \t]*\[[ \t]*{section}[ \t]*\.[ \t]*\"?{key}\"?[ \t]*\]", text, re.MULTILINE):
            raise InputError(f"{key}: the problem has a section [{section}.{key}]; change it there", key=key)
        dotted = re.search(rf"^[ \t]*{section}\.{key}[ \t]*=", text, re.MULTILINE)
        if dotted:
            start, end = dotted.start(), len(text)
        elif head:
            after = re.search(r"^[ \t]*\[", text[head.end() :], re.MULTILINE)
            start, end = head.end(), head.end() + after.start() if after else len(text)
        else:
            raise InputError(f"{key}: the problem has no section [{section}] in which it could be written", key=key)
        part = text[start:end]
        line = rf"^([ \t]*(?:{section}\.)?\"?{key}\"?[ \t]*=[ \t]*)[^#\n]*?([ \t]*(?:#.*)?\r?)$"
        part, count = re.subn(line, lambda found: found[1] + value + found[2], part, count=1, flags=re.MULTILINE)
        if count == 0:
            part = f"\n{key} = {value}{part}"
        text = text[:start] + part + text[end:]
    return text
