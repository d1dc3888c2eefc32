"""``python -m builder``: build, verify, query and export tables offline."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from mumacro import InputError, MumacroError, Surrogate
from mumacro.extras import missing
from mumacro.processors import processors
from mumacro.writing import alone_in

try:
    import typer
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from .assemble import ABS_TO_REL, MAX_TOLERANCE, MIN_TOLERANCE, BuildError, build_table, stages
    from .export import FORMATS, export_table
    from .figures import FiguresError, draw_figures
    from .steady import solve as solve_one
    from .sweep import SolveError, Sweep
    from .verify import uncovered
    from .verify import verify as verify_table
except ModuleNotFoundError as error:
    raise SystemExit(f"python -m builder: {missing('builder', error)}") from None

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__)


def _fail(message: str, code: int = 1) -> typer.Exit:
    print(f"error: {message}", file=sys.stderr)
    return typer.Exit(code)


def _json(value: object) -> str:
    """JSON without NaN: what is not defined is null."""

    def clean(item: Any) -> Any:
        if isinstance(item, dict):
            return {key: clean(entry) for key, entry in item.items()}
        return None if isinstance(item, float) and not math.isfinite(item) else item

    return json.dumps(clean(value), indent=2)


@app.command()
def build(
    out: Annotated[Path, typer.Option(help="The netCDF file to write.")],
    tolerance: Annotated[
        float, typer.Option(help="Largest absolute error of mu_macro/mu0; the relative one may be 10 times it.")
    ] = 1e-8,
    workers: Annotated[int, typer.Option(min=1, max=1024, help="Threads on this machine.")] = processors(),
) -> None:
    """Build a table; a killed build resumes from OUT.checkpoint and gives the same data."""
    if not MIN_TOLERANCE <= tolerance <= MAX_TOLERANCE:
        raise typer.BadParameter(
            f"must be from {MIN_TOLERANCE:g} to {MAX_TOLERANCE:g}, got {tolerance!r}", param_hint="--tolerance"
        )
    if not out.parent.is_dir():
        raise typer.BadParameter(f"folder {str(out.parent)!r} does not exist", param_hint="--out")
    if out.is_dir():
        raise typer.BadParameter(f"{str(out)!r} is a folder", param_hint="--out")
    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    try:
        checkpoint = out.with_name(out.name + ".checkpoint")
        with (
            alone_in(checkpoint),
            Sweep(workers, checkpoint) as sweep,
            Progress(*columns, console=console) as bar,
        ):
            task = bar.add_task("border", total=stages())

            def progress(text: str, done: bool) -> None:
                bar.update(task, description=text, advance=1 if done else 0)

            surrogate = build_table(out, tolerance, sweep, progress)
            solves = sweep.n_solves
    except (MumacroError, BuildError, SolveError) as error:
        raise _fail(str(error)) from error
    except OSError as error:
        raise _fail(f"{error.filename or out}: {error.strerror or error}") from error
    print(
        _json(
            {
                "table": str(out),
                "tolerance": tolerance,
                "verified_max_abs_error": surrogate.max_abs_error,
                "verified_max_rel_error": surrogate.max_rel_error,
                "n_solves": solves,
                "bytes": out.stat().st_size,
                "content_sha256": surrogate.checksum,
            }
        )
    )


@app.command()
def solve(
    v: Annotated[float, typer.Option("--v", help="Dimensionless speed v~, from 1e-60 to 1e10.")],
    y: Annotated[float, typer.Option("--y", help="Dimensionless amplitude y~, from 1e-15 to 1e14.")],
) -> None:
    """Solve the full model once and print the steady cycle as JSON."""
    try:
        steady = solve_one(v, y)
    except InputError as error:
        option = {"v_tilde": "--v", "y_tilde": "--y"}[error.field]
        raise typer.BadParameter(f"must be {error.bound}, got {error.value!r}", param_hint=option) from None
    print(_json({"v_tilde": v, "y_tilde": y, **asdict(steady)}))
    if not steady.ok:
        raise typer.Exit(1)


@app.command()
def verify(
    table: Annotated[Path, typer.Argument(help="A table file.")],
    points: Annotated[int, typer.Option(min=100, max=10_000_000, help="Fresh solves to compare with.")] = 20_000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the drawn points.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=1024, help="Threads on this machine.")] = processors(),
) -> None:
    """Compare a table with fresh solves; exit code 1 when it misses its own tolerance."""
    try:
        surrogate = Surrogate.open(table)
        with Sweep(workers) as sweep:
            report = verify_table(surrogate, sweep, points, seed)
    except (MumacroError, SolveError, OSError) as error:
        raise _fail(str(error)) from error
    report["tolerance"] = surrogate.tolerance
    report["holds"] = (
        report["max_abs_error"] <= surrogate.tolerance
        and report["max_rel_error"] <= ABS_TO_REL * surrogate.tolerance
        and not any(uncovered(report).values())
    )
    print(_json(report))
    if not report["holds"]:
        raise _fail(f"{table} misses its tolerance of {surrogate.tolerance:g} or a bound")


@app.command()
def export(
    table: Annotated[Path, typer.Argument(help="A table file.")],
    kind: Annotated[str, typer.Option("--format", help=f"One of {', '.join(FORMATS)}.")],
    out: Annotated[
        Path | None,
        typer.Option(help="The file to write, for c also a folder; left out: the table's name with another suffix."),
    ] = None,
) -> None:
    """Write the table for other tools; print what was written as JSON."""
    if kind not in FORMATS:
        raise typer.BadParameter(f"must be one of {', '.join(FORMATS)}, got {kind!r}", param_hint="--format")
    target = Path(FORMATS[kind][0].format(table.stem)) if out is None else out
    if target.is_dir() and kind != "c":
        raise typer.BadParameter(f"{str(target)!r} is a folder", param_hint="--out")
    try:
        found = export_table(table, kind, target)
    except (MumacroError, OSError) as error:
        raise _fail(str(error)) from error
    shape = list(found.mu_ratio.shape)
    print(_json({"table": str(table), "format": kind, "out": str(target), "shape": shape}))


@app.command()
def figures(
    out: Annotated[Path, typer.Option(help="The folder to write to.")],
    table: Annotated[Path | None, typer.Option(help="The table that lines come from; left out: the tightest.")] = None,
) -> None:
    """Draw the paper's Fig. 4 to 11 from the solver and a table, as PNG; print what was written as JSON."""
    if not out.is_dir():
        raise typer.BadParameter(f"folder {str(out)!r} does not exist", param_hint="--out")
    try:
        surrogate = Surrogate.open(table)
        written = draw_figures(surrogate, out)
    except FiguresError as error:
        raise _fail(str(error), 2) from error
    except (MumacroError, OSError) as error:
        raise _fail(str(error)) from error
    print(_json({"table": str(surrogate.path), "figures": [str(path) for path in written]}))


if __name__ == "__main__":
    app()
