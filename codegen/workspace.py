"""Rewrites the workspace that OSQP generates, NAME_workspace.c.

As OSQP writes it, the file carries a date, prints numbers with 20 decimals (which loses small ones), and keeps every
array in RAM. Here it is taken apart into its definitions, and written again:

- Index arrays that nothing writes are `const`, so that they stay in flash. See CONSTANT.
- Arrays of zeros have no initialiser: they cost RAM, but no flash to start it from.
- What the firmware writes before it solves starts as zeros too: it would be that of the generator's example values, of
  no use to anyone. See WRITTEN.
- Vectors that nothing refers to (the scratch of data scaling, which is off) are left out.
- All that the firmware has no business with is `static`.
- Numbers are the shortest text that reads back as the same double or float.
"""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

Real = Literal["double", "float"]

# Index arrays that no function of embedded mode 2 writes, checked in the sources of OSQP 1.1 and QDLDL 0.1.8:
#   data_P_csc_p/_i,    csc_update_values(), csc_scale(), csc_*mult_diag() write the values x only; what changes p or i
#   data_A_csc_p/_i     (csc_utils.c) is compiled out by OSQP_EMBEDDED_MODE, or is csc_cumsum(), which nothing calls
#   linsys_KKT_p/_i     update_KKT_P/_A/_param2() write KKT->x only; QDLDL_factor() takes them as const
#   linsys_PtoKKT, _AtoKKT, _rhotoKKT   read by update_KKT_*()
#   linsys_P            the permutation, read by LDLSolve()
#   linsys_etree, _Lnz  const arguments of QDLDL_factor(); QDLDL_etree(), which fills them, is called at setup only
#   linsys_L_p, _L_i    QDLDL_factor() writes them, but always the same: they depend on the pattern of KKT alone. Its
#                       three stores are removed from our copy (osqp_sources.py), so that they may stay in flash
# Not here, because they do change: work_constr_type (update_rho_vec()), iwork and bwork (scratch).
CONSTANT = (
    *("data_P_csc_p", "data_P_csc_i", "data_A_csc_p", "data_A_csc_i"),
    *("linsys_KKT_p", "linsys_KKT_i", "linsys_PtoKKT", "linsys_AtoKKT", "linsys_rhotoKKT"),
    *("linsys_P", "linsys_etree", "linsys_Lnz", "linsys_L_p", "linsys_L_i"),
)

# Written before the first iteration, in this order:
#   work_rho_vec, work_rho_inv_vec, linsys_rho_inv_vec   by osqp_update_rho(), with the last part of the values of KKT
#   the other values of KKT, and linsys_L_x, _D, _Dinv   by osqp_update_data_mat(), which factorises
#   data_l_val, data_u_val                               by osqp_update_data_vec()
# The values of P and A stay: they are the example that tells their pattern.
WRITTEN = (
    *("work_rho_vec_val", "work_rho_inv_vec_val", "linsys_rho_inv_vec"),
    *("linsys_KKT_x", "linsys_L_x", "linsys_D", "linsys_Dinv"),
    *("data_l_val", "data_u_val"),
)

# The firmware writes these values in place.
SHARED = ("data_P_csc_x", "data_A_csc_x")

# Before every name in OSQP's text; unlike a station's name it cannot be part of a name of OSQP's own.
PREFIX = "TAPER_WORKSPACE_"

_INT_TYPES = ("OSQPInt", "QDLDL_int", "QDLDL_bool")
_ARRAY = re.compile(r"(OSQPInt|OSQPFloat|QDLDL_\w+)\s+(\w+)\[(\d+)\](?: = \{\n(.*?)\n?\})?;", re.DOTALL)
_STRUCT = re.compile(r"(OSQP\w+|qdldl_solver)\s+(\w+) = \{\n(.*?)\n\};", re.DOTALL)
_FLOAT = re.compile(r"\(OSQPFloat\)(-?\d+\.\d+)")
# Last fields that OSQP's generator leaves out, which some compilers warn of: `owned` and `adj`.
_FORGOTTEN_FIELD = {"OSQPCscMatrix": "0", "qdldl_solver": "OSQP_NULL"}
_INDENT = "    "


class OsqpChanged(Exception):
    """OSQP's output is not what this generator was written for: do not guess, look at it again."""


@dataclass(frozen=True)
class Array:
    """An array of the workspace; `name` has no station prefix. Without `values` it is all zeros."""

    name: str
    is_int: bool
    length: int
    values: tuple[float, ...] | None

    @property
    def is_const(self) -> bool:
        return self.name in CONSTANT

    def size_B(self, real: Real) -> int:
        return self.length * (8 if real == "double" and not self.is_int else 4)


@dataclass(frozen=True)
class Struct:
    """A structure of the workspace; `fields` are the initialisers as OSQP wrote them, in order."""

    type: str
    name: str
    fields: tuple[str, ...]


def symbol(station: str, name: str) -> str:
    """The C identifier of a part of a station's workspace."""
    return f"taper_workspace_{station}_{name}"


def number(value: float, real: Real) -> str:
    """The shortest literal that reads back as exactly `value`, or as the float nearest to it."""
    return repr(float(value)) if real == "double" else f"{np.float32(value)!s}F"


def parse(text: str) -> list[Array | Struct]:
    """The definitions in OSQP's workspace, in order; raises OsqpChanged if there is anything else in it."""
    text = re.sub(r"/\*.*?\*/|^#include .*?$", "", text, flags=re.DOTALL | re.MULTILINE)
    arrays = [(found.start(), _array(found)) for found in _ARRAY.finditer(text)]
    structs = [(found.start(), _struct(found)) for found in _STRUCT.finditer(text)]
    rest = _ARRAY.sub("", _STRUCT.sub("", text)).strip()
    if rest:
        raise OsqpChanged(f"unknown text in the workspace: {rest[:60]}")
    return [part for _, part in sorted([*arrays, *structs], key=lambda pair: pair[0])]


def _unprefixed(name: str) -> str:
    if not name.startswith(PREFIX):
        raise OsqpChanged(f"{name} does not begin with {PREFIX}")
    return name.removeprefix(PREFIX)


def _struct(found: re.Match[str]) -> Struct:
    lines = found[3].replace(PREFIX, "").splitlines()
    return Struct(found[1], _unprefixed(found[2]), tuple(line.strip().rstrip(",") for line in lines))


def _array(found: re.Match[str]) -> Array:
    is_int = found[1] in _INT_TYPES
    name = _unprefixed(found[2])
    if found[4] is None or name in WRITTEN:
        return Array(name, is_int, int(found[3]), None)
    texts = [text.strip().removeprefix("(OSQPFloat)") for text in found[4].rstrip(",").split(",")]
    values = tuple(int(text) if is_int else float(text) for text in texts)
    if len(values) != int(found[3]):
        raise OsqpChanged(f"{found[2]} has {len(values)} values instead of {found[3]}")
    return Array(name, is_int, len(values), values if name in CONSTANT or any(values) else None)


def with_values(part: Array | Struct, exact: dict[str, tuple[float, ...]]) -> Array | Struct:
    """`part` with the values that the generator knows exactly, where OSQP's text has them rounded."""
    if not isinstance(part, Array) or part.name not in exact:
        return part
    values = exact[part.name]
    if part.values is None or len(values) != part.length or not np.allclose(values, part.values, rtol=0, atol=1e-19):
        raise OsqpChanged(f"{part.name} does not hold what it was set up with")
    return Array(part.name, part.is_int, part.length, values)


def referenced(parts: list[Array | Struct]) -> list[Array | Struct]:
    """The parts that the solver structure, the last one, leads to."""
    uses = {part.name: _names_in(part) if isinstance(part, Struct) else set() for part in parts}
    wanted, todo = set(), ["solver"]
    while todo:
        name = todo.pop()
        if name in uses and name not in wanted:
            wanted.add(name)
            todo += uses[name]
    return [part for part in parts if part.name in wanted]


def _names_in(struct: Struct) -> set[str]:
    return set(re.findall(r"[A-Za-z_]\w*", " ".join(struct.fields)))


def render(parts: list[Array | Struct], station: str, real: Real) -> str:
    """NAME_workspace.c."""
    head = (
        f"/* Working memory of the solver of station {station}. Generated from what OSQP generates, see codegen/. */\n"
        f'#include "{station}_workspace.h"\n\n'
        '#include "algebra_impl.h"\n#include "qdldl_interface.h"\n#include "types.h"\n'
    )
    names = {part.name: part for part in parts}
    texts = [
        _render_array(part, station, real) if isinstance(part, Array) else _render_struct(part, station, real, names)
        for part in parts
    ]
    return head + "\n" + "\n".join(texts)


def render_header(parts: list[Array | Struct], station: str) -> str:
    """NAME_workspace.h."""
    guard = f"{station.upper()}_WORKSPACE_H"
    lengths = {part.name: part.length for part in parts if isinstance(part, Array)}
    solver = symbol(station, "solver")
    arrays = "".join(f"extern OSQPFloat {symbol(station, name)}[{lengths[name]}];\n" for name in SHARED)
    return (
        f"/** Solver of station {station}. One instance, not re-entrant. Values of A and P: write, then update. */\n"
        f"#ifndef {guard}\n#define {guard}\n\n"
        f'#include "osqp_api_types.h"\n\nextern OSQPSolver {solver};\n{arrays}\n#endif\n'
    )


def _render_array(array: Array, station: str, real: Real) -> str:
    storage = "" if array.name in SHARED else "static const " if array.is_const else "static "
    kind = "OSQPInt" if array.is_int else "OSQPFloat"
    declared = f"{storage}{kind} {symbol(station, array.name)}[{array.length}]"
    if array.values is None:
        return f"{declared};\n"
    texts = [str(value) if array.is_int else number(value, real) for value in array.values]
    return f"{declared} = {{\n{_wrapped(texts)}}};\n"


def _wrapped(texts: list[str], width: int = 110) -> str:
    lines, line = [], ""
    for text in texts:
        if line and len(line) + len(text) + 2 > width - len(_INDENT):
            lines.append(line)
            line = ""
        line += f" {text}," if line else f"{text},"
    return "".join(f"{_INDENT}{line}\n" for line in [*lines, line])


def _render_struct(struct: Struct, station: str, real: Real, names: dict[str, Array | Struct]) -> str:
    storage = "" if struct.name == "solver" else "static "
    fields = [_render_field(field, station, real, names) for field in struct.fields]
    if struct.type in _FORGOTTEN_FIELD:
        fields.append(_FORGOTTEN_FIELD[struct.type])
    body = "".join(f"{_INDENT}{field},\n" for field in fields)
    return f"{storage}{struct.type} {symbol(station, struct.name)} = {{\n{body}}};\n"


def _render_field(field: str, station: str, real: Real, names: dict[str, Array | Struct]) -> str:
    """OSQP's pointers have no const: where one leads to a constant array, the cast says that we know."""
    field = _FLOAT.sub(lambda found: number(float(found[1]), real), field)
    part = names.get(field)
    cast = "(OSQPInt *)" if isinstance(part, Array) and part.is_const else ""
    return cast + re.sub(r"[A-Za-z_]\w*", lambda found: _prefixed(found[0], station, names), field)


def _prefixed(word: str, station: str, names: dict[str, Array | Struct]) -> str:
    return symbol(station, word) if word in names else word
