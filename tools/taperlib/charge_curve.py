"""The power that a vehicle takes over its state of charge: a polyline, as the column `curve` of a sessions CSV has it.

Points "soc:kw soc:kw ...", by ascending SOC within 0..1, with 0 < kW <= MOST_KW; linear in between, and constant before
the first and beyond the last. The same rules hold in host_sim/src/charge_curve.c.
"""

import numpy as np

from .files import InputError, number_at

Point = tuple[float, float]  # SOC, kW
Curve = tuple[Point, ...]
Line = tuple[float, float]  # kW at SOC 0, and its fall until SOC 1

MOST_KW = 655.34  # EV_PARAM_B has 16 bits of 10 W
MOST_POINTS = 32


def _point(word: str, where: str) -> Point:
    soc, colon, kw = word.partition(":")
    if not colon:
        raise InputError(f"{where}: '{word}' is not soc:kw")
    return number_at(soc, where), number_at(kw, where)


def parse_curve(text: str, where: str) -> Curve:
    """The points of a CSV field; `where` names file, line and column. Raises InputError."""
    words = text.split()
    curve = tuple(_point(word, f"{where}, point {number}") for number, word in enumerate(words, start=1))
    check_curve(curve, where)
    return curve


def check_curve(curve: Curve, where: str) -> None:
    """Raises InputError unless it is one."""
    if not 2 <= len(curve) <= MOST_POINTS:
        raise InputError(f"{where}: has {len(curve)} points, not 2 to {MOST_POINTS}")
    before = -1.0
    for number, (soc, kw) in enumerate(curve, start=1):
        at = f"{where}, point {number}"
        if not 0 <= soc <= 1:
            raise InputError(f"{at}: SOC {soc:g} is not between 0 and 1")
        if soc <= before:
            raise InputError(f"{at}: SOC {soc:g} does not ascend")
        if not 0 < kw <= MOST_KW:
            raise InputError(f"{at}: {kw:g} kW is not above 0 and at most {MOST_KW:g}")
        before = soc


def curve_text(curve: Curve) -> str:
    return " ".join(f"{soc:g}:{kw:g}" for soc, kw in curve)


def power_kw(curve: Curve, soc: np.ndarray | float) -> np.ndarray:
    socs, powers = zip(*curve, strict=True)
    return np.interp(soc, socs, powers)


def most_kw(curve: Curve) -> float:
    return max(kw for _, kw in curve)


def capped(curve: Curve, cap_kw: float) -> Curve:
    """The curve behind a connector of `cap_kw`."""
    points: list[Point] = [(curve[0][0], min(curve[0][1], cap_kw))]
    for (soc, kw), (next_soc, next_kw) in zip(curve, curve[1:], strict=False):
        if (kw - cap_kw) * (next_kw - cap_kw) < 0:
            points.append((round(soc + (cap_kw - kw) / (next_kw - kw) * (next_soc - soc), 6), cap_kw))
        points.append((next_soc, min(next_kw, cap_kw)))
    return tuple(points)


def hull_points(curve: Curve) -> list[Point]:
    """Corners of the least concave curve that is nowhere below this one, on SOC 0..1."""
    points = [(0.0, curve[0][1])] * (curve[0][0] > 0) + list(curve) + [(1.0, curve[-1][1])] * (curve[-1][0] < 1)
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _rises(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    return hull


def _rises(a: Point, b: Point, c: Point) -> bool:
    """From a over b to c the slope does not fall: b is no corner of the hull."""
    return (b[1] - a[1]) * (c[0] - b[0]) <= (c[1] - b[1]) * (b[0] - a[0])


def hull_lines(curve: Curve) -> list[Line]:
    """The edges of the concave hull as lines. One that rises with the SOC has a fall below 0."""
    points = hull_points(curve)
    lines = []
    for (soc, kw), (next_soc, next_kw) in zip(points, points[1:], strict=False):
        fall = (kw - next_kw) / (next_soc - soc)
        lines.append((kw + fall * soc, fall))
    return lines
