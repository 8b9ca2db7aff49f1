"""The account of a solver's memory, from the arrays of its workspace."""

from solver import Solver

_HEAD = ("station", "N x T", "variables", "rows", "L entries", "flash const", "flash init", "RAM")
_NOTE = """\
Solver memory by station in bytes, real type {real}, int 4 bytes.
flash const: constant index arrays. flash init: start values of arrays in RAM. RAM: all arrays that are written.
Not counted: some 40 small structures and the table of settings (about 2 KB a station), and code.
"""


def account(solvers: list[Solver], real: str) -> str:
    """The table, as text; only the note on it when there is no solver."""
    rows = [_HEAD, *(_row(solver) for solver in solvers)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    lines = ["  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in rows]
    return _NOTE.format(real=real) + "\n" + "\n".join(lines) + "\n"


def _row(solver: Solver) -> tuple[str, ...]:
    station = solver.station
    const_B = sum(array.size_B(solver.real) for array in solver.arrays if array.is_const)
    ram = [array for array in solver.arrays if not array.is_const]
    init_B = sum(array.size_B(solver.real) for array in ram if array.values is not None)
    return (
        station.name,
        f"{len(station.connectors)} x {station.steps}",
        *(str(solver.length(f"{name}")) for name in ("work_x_val", "work_z_val", "linsys_L_i")),
        *(f"{size_B:,}" for size_B in (const_B, init_B, sum(array.size_B(solver.real) for array in ram))),
    )
