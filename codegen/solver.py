"""Generates the solver of one station: OSQP set up for its structure, as C with all memory static."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import osqp
from scipy import sparse

import qp
import workspace
from osqp_sources import shared_sources
from station import Station
from workspace import Array, OsqpChanged, Real, Struct

SETTINGS: dict[str, float | int] = {
    "scaling": 0,  # qp.py scales the rows; scaling in OSQP would be redone with every update of the matrices
    "rho": 0.3,
    "eps_abs": 1e-3,  # the planner sets its own tolerance
    "eps_rel": 1e-3,
    "max_iter": 500,
    "check_termination": 10,
    "adaptive_rho": 0,  # the planner does it, so that a solve in slices takes the same steps as one in one piece
    "polishing": 0,
    "warm_starting": 1,
    "verbose": 0,
}


@dataclass(frozen=True)
class Solver:
    """All about one station's solver. `parts` are its working memory."""

    station: Station
    real: Real
    parts: list[Array | Struct]
    osqp_files: dict[str, str]

    @property
    def arrays(self) -> list[Array]:
        return [part for part in self.parts if isinstance(part, Array)]

    def length(self, name: str) -> int:
        return next(array.length for array in self.arrays if array.name == name)


def generate_solver(station: Station, real: Real) -> Solver:
    """Takes a second or two for 130 connectors and 24 steps."""
    a_matrix, p_matrix = qp.constraint_matrix(station), qp.cost_matrix(station)
    low, high = qp.neutral_bounds(station)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        problem = osqp.OSQP()
        problem.setup(p_matrix, np.zeros(p_matrix.shape[0]), a_matrix, low, high, **SETTINGS)
        problem.codegen(
            folder,
            parameters="matrices",
            extension_name=None,
            force_rewrite=True,
            use_float=real == "float",
            prefix=workspace.PREFIX,
        )
        files = shared_sources(out)
        text = (out / f"{workspace.PREFIX}workspace.c").read_text()
    parts = workspace.parse(text)
    _check_settings(parts, files["inc/public/osqp_api_types.h"])
    exact = {**_csc_arrays("data_P", p_matrix), **_csc_arrays("data_A", a_matrix)}
    parts = [workspace.with_values(part, exact) for part in parts]
    return Solver(station, real, workspace.referenced(parts), files)


def _check_settings(parts: list[Array | Struct], header: str) -> None:
    """OSQP prints settings with 20 decimals: make sure that each one survived that, and that none was ignored."""
    written = _settings(parts, header)
    for name, value in SETTINGS.items():
        if written[name] != value:
            raise OsqpChanged(f"the setting {name} is {written[name]} in the generated code instead of {value}")


def _settings(parts: list[Array | Struct], header: str) -> dict[str, float]:
    """The settings' initialisers by the name of their field; those that are not numbers are left out."""
    body = header.split("} OSQPSettings;")[0].rsplit("typedef struct OSQP_ATTR_PACK {", 1)[1]
    declarations = [line.split(";")[0] for line in body.splitlines() if ";" in line and not line.lstrip().startswith("*")]
    names = [declaration.split()[-1] for declaration in declarations]
    fields = next(part.fields for part in parts if part.name == "settings" and isinstance(part, Struct))
    if len(names) != len(fields):
        raise OsqpChanged(f"OSQPSettings has {len(names)} fields, the generated code {len(fields)}")
    texts = [field.removeprefix("(OSQPFloat)") for field in fields]
    return {name: float(text) for name, text in zip(names, texts, strict=True) if not text[0].isalpha()}


def _csc_arrays(name: str, matrix: sparse.csc_matrix) -> dict[str, tuple[float, ...]]:
    return {
        f"{name}_csc_p": tuple(matrix.indptr.tolist()),
        f"{name}_csc_i": tuple(matrix.indices.tolist()),
        f"{name}_csc_x": tuple(matrix.data.tolist()),
    }


def solver_files(solver: Solver) -> dict[str, str]:
    """Files of solver/ for one station, by name."""
    name = solver.station.name
    return {
        f"{name}_workspace.c": workspace.render(solver.parts, name, solver.real),
        f"{name}_workspace.h": workspace.render_header(solver.parts, name),
        f"{name}_solver.c": _solver_c(solver),
    }


def _solver_c(solver: Solver) -> str:
    name, at = solver.station.name, qp.layout(solver.station)
    return f"""\
/* What the planner needs to know about the solver of station {name}. Generated, see codegen/. */
#include "solver.h"
#include "taper/solvers.h"
#include "{name}_workspace.h"

const taper_solver_t taper_solver_{name} = {{
    .osqp = &{workspace.symbol(name, "solver")},
    .a_values = {workspace.symbol(name, "data_A_csc_x")},
    .a_count = {solver.length("data_A_csc_x")},
    .p_values = {workspace.symbol(name, "data_P_csc_x")},
    .p_count = {solver.length("data_P_csc_x")},
    .variables = {at.variables},
    .rows = {at.rows},
    .connectors = {at.connectors},
    .steps = {at.steps},
    .sums = {at.sums},
}};
"""


def solvers_header(stations: list[Station]) -> str:
    """include/taper/solvers.h."""
    declared = "".join(f"extern const taper_solver_t taper_solver_{station.name};\n" for station in stations)
    return f"""\
/**
 * The solvers that this image holds. Generated, see codegen/.
 *
 * They start without a factorisation, and without what follows from the penalty: before the first osqp_solve(), call
 * osqp_update_rho(), which fails for want of the rest, write all values of A and P, and call osqp_update_data_mat() and
 * osqp_update_data_vec().
 */
#ifndef TAPER_SOLVERS_H
#define TAPER_SOLVERS_H

#include "taper/planner.h"

{declared}
/** Solver of taper_stations[i] (taper/stations.h) at the same i; taper_station_count of them. */
extern const taper_solver_t *const taper_solvers[];

#endif
"""


def solvers_source(stations: list[Station]) -> str:
    """solver/solvers.c."""
    entries = "".join(f"    &taper_solver_{station.name},\n" for station in stations)
    return f"""\
/* Generated, see codegen/. */
#include "taper/solvers.h"

const taper_solver_t *const taper_solvers[] = {{
{entries}}};
"""
