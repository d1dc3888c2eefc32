"""Check the columns of measured points, and evaluate the model at them, for
:mod:`mumacro.fits.fit`."""

from collections.abc import Container, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import check, columns_of, library_of, no_such_input, select
from mumacro.inputs.columns import to_si
from mumacro.inputs.doubts import UNITS, remarks
from mumacro.inputs.fields import AMPLITUDE, MEASURED_AS, NAMES, kind_of
from mumacro.inputs.layout import Dialect
from mumacro.inputs.names import ColumnNames, split_unit, unknown_name
from mumacro.inputs.text_tables import Most
from mumacro.inputs.whole_tables import TableOfNumbers, read_numbers
from mumacro.kernel.arrays import Array, Bools
from mumacro.results import REMARK, Note
from mumacro.surrogate import Surrogate

UNKNOWNS = ("k", "mu0")
STD = "std"  # the column of standard deviations
FORCE = "Ft"  # the mean friction force [N]; divided by Fz it is mu_macro
#: how far a point may be outside of 0 <= mu_macro <= mu0: in standard deviations, or, if the points
#: have none, as a fraction of mu0
_SCATTER, _SHARE = 5.0, 0.05
MOST_POINTS = 10_000  # of a fit
_PERCENT = 1.5  # a larger mu_macro raises the question whether it is in per cent
# limits of friction and std, so that products of their squares stay within double range
_LEAST, _MOST = 1e-20, 1e20


#: columns of a table of points, and the input whose units each column has
COLUMNS = {name: MEASURED_AS.get(name, name) for name in (*NAMES, AMPLITUDE)}
COLUMNS |= {"mu_macro": "mu0", STD: "mu0", FORCE: "Fz"}
_COLUMN_NAMES = ColumnNames(COLUMNS, (("v0",), ("mu_macro", FORCE)))


def read_points(
    source: Path | bytes,
    dialect: Dialect = Dialect(),  # noqa: B008
    most: Most = Most(),  # noqa: B008
) -> TableOfNumbers:
    """Return measured points from a table as text or from a workbook: a file or its bytes.

    Raise TextError with what is wrong, and in which lines.

    >>> read_points(b"v0 [mm/s],mu_macro\\n10,0.2\\n").columns
    {'v0': array([0.01]), 'mu_macro': array([0.2])}
    """
    return read_numbers(source, _COLUMN_NAMES, dialect, most)


def unknowns_beside(columns: Container[str]) -> list[str]:
    """Return the default unknowns: k and mu0, or k alone if mu0 is a column."""
    return [name for name in UNKNOWNS if name != "mu0" or name not in columns]


class Measured:
    """Hold points (n,) with their friction, and evaluate the model at them.  Parameters and errors
    are those of :func:`mumacro.fit`.

    ``columns`` has the known inputs [SI], (n,), by the names that ``evaluate`` takes.  ``mu`` is
    mu_macro [-], ``std`` its standard deviations or None, ``weight`` is 1 / std, or 1.
    ``amplitude`` is the name of the oscillation's input: y0 or Fz_amplitude.
    """

    def __init__(
        self,
        data: Any,
        unknowns: str | Sequence[str] | None,
        contact: str,
        direction: str,
        surrogate: Surrogate,
        fixed: Mapping[str, Any],
    ) -> None:
        if unknowns is None:
            unknowns = unknowns_beside(select("data", data, UNKNOWNS))
        unknowns = (unknowns,) if isinstance(unknowns, str) else tuple(unknowns)
        if not unknowns or len(set(unknowns)) != len(unknowns) or set(unknowns) - set(UNKNOWNS):
            raise InputError("unknowns", unknowns, 'one or both of "k" and "mu0"')
        self.unknowns = tuple(name for name in UNKNOWNS if name in unknowns)
        self.surrogate = surrogate
        self.kind = kind_of(contact, direction)
        self.amplitude = self.kind.amplitude
        self._read(self._inputs(data, fixed))
        self._check()

    def _inputs(self, data: Any, fixed: Mapping[str, Any]) -> dict[str, Any]:
        """Return the columns and the keywords by name.  Raise InputError for one that is fitted,
        unknown, given twice or missing."""
        left_out = (*self.unknowns, self.kind.other_amplitude)
        names = [name for name in (*NAMES, AMPLITUDE) if name not in left_out]
        results = ("mu_macro", FORCE, STD)
        is_fitted = f"left out, or taken from unknowns={self.unknowns}: it is fitted"
        self._refuse_names(fixed, names, results, is_fitted)
        if isinstance(data, Mapping) and not library_of(data):  # a table may have other columns
            members = (*names, *UNKNOWNS, *results)
            for name in data:
                if name not in members and split_unit(str(name))[0] not in members:
                    raise no_such_input(str(name), data[name], members)
        columns = select("data", data, [*names, *results])
        for name in select("data", data, self.unknowns):
            raise InputError(name, "a column", is_fitted)
        for name in sorted(columns.keys() & fixed.keys()):
            raise InputError(name, fixed[name], "given once: as a column or as a keyword")
        inputs = {**columns, **fixed}
        force = inputs.pop(FORCE, None)
        if force is not None and "mu_macro" not in inputs:
            inputs["mu_macro"] = _friction(force, inputs.get("Fz"))
        for name in ("mu_macro", "v0"):
            if name not in inputs:
                raise InputError(
                    name,
                    sorted(columns),
                    f"a column of the data: {name} of each point"
                    + (f", or {FORCE} with Fz" if name == "mu_macro" else ""),
                )
        return inputs

    def _refuse_names(
        self, inputs: Mapping[str, Any], names: list[str], results: Iterable[str], is_fitted: str
    ) -> None:
        """Raise InputError for the name of an input that is fitted or unknown."""
        for name, value in inputs.items():
            if name in self.unknowns:
                raise InputError(name, value, is_fitted)
            if name not in names and name not in results:
                bound = f"one of {', '.join(names)}; {unknown_name(name, names)}"
                raise InputError(name, value, bound)

    def _read(self, data: dict[str, Any]) -> None:
        """Read columns of the same length, (n,), in SI."""
        columns = {name: to_si(name, data.pop(name)) for name in ("mu_macro", STD) if name in data}
        # labels are dropped, since a fit has none
        values = {name: to_si(name, x) for name, x in data.items()}
        inputs = {**values, **dict.fromkeys(self.unknowns, 1.0)}
        self._has_f = inputs.get("f") is not None
        numbers = columns_of(inputs, self.kind)
        check(numbers, inputs.get("f"))
        all_columns = {
            name: np.asarray(x, np.float64) for name, x in {**numbers, **columns}.items()
        }
        lengths = {name: x.shape for name, x in all_columns.items() if x.ndim}
        if len({*lengths.values()}) > 1 or any(x.ndim > 1 for x in all_columns.values()):
            raise InputError("data", lengths, "columns of one length, or single values")
        n = max((x.size for x in all_columns.values() if x.ndim), default=1)
        all_columns = {
            name: np.ascontiguousarray(np.broadcast_to(x, n)) for name, x in all_columns.items()
        }
        self.mu, self.std = all_columns.pop("mu_macro"), all_columns.pop(STD, None)
        self.columns = {name: x for name, x in all_columns.items() if name not in self.unknowns}
        self.n = n

    def _check(self) -> None:
        if self.n > MOST_POINTS:
            bound = (
                f"at most {MOST_POINTS:,}: average them, those at the same inputs to one point "
                "with the std of its mean"
            )
            raise InputError("data", f"{self.n:,} points", bound)
        if "mu0" in self.columns:
            _refuse("mu0", self.columns["mu0"], self.columns["mu0"] <= _MOST, f"<= {_MOST:g}")
        if self.std is not None:
            bound = f"finite and > 0, from {_LEAST:g} to {_MOST:g}"
            _refuse("std", self.std, (self.std >= _LEAST) & (self.std <= _MOST), bound)
        self.weight = np.ones(self.n) if self.std is None else 1.0 / self.std
        top = self.columns.get("mu0", np.full(self.n, np.fmax.reduce(np.abs(self.mu), initial=0.0)))
        scatter, margin = (
            _SHARE * top,
            f"within {100.0 * _SHARE:g} %; give std where the points scatter more",
        )
        if self.std is not None:
            scatter, margin = _SCATTER * self.std, f"within {_SCATTER:g} standard deviations"
        legal = (self.mu <= _MOST) & (self.mu >= -scatter)
        _refuse("mu_macro", self.mu, legal, f"finite and >= 0, <= {_MOST:g}, {margin}")
        settings = len(np.unique(np.column_stack([*self.columns.values()]), axis=0))
        if settings < len(self.unknowns):
            raise InputError(
                "data",
                f"{settings}",
                f"points at {len(self.unknowns)} different inputs or more, one for each unknown "
                f"({', '.join(self.unknowns)}): measure more, or fit k alone with mu0 known",
            )
        if self.mu.max() < _LEAST:
            bound = f"> 0 in at least one point, >= {_LEAST:g}: friction of zero tells nothing"
            raise InputError("mu_macro", float(self.mu.max()), bound)
        oscillates = (self.columns[self.amplitude] > 0.0) & (self.columns["omega"] > 0.0)
        if "k" in self.unknowns and not oscillates.any():
            raise InputError(
                "data",
                f"{self.n} points without oscillation",
                f"points with {self.amplitude} > 0 and omega > 0: without oscillation mu_macro = "
                "mu0 for every k",
            )
        if "mu0" not in self.unknowns:
            bound = (
                f"<= mu0, {margin}: oscillation only lowers friction; or fit mu0, or look at "
                "the units"
            )
            _refuse("mu_macro", self.mu, self.mu <= top + scatter, bound)

    def remarks(self) -> list[Note]:
        """Return remarks where the points probably have a wrong unit."""
        doubts = remarks(self.columns, self._has_f)
        doubtful = self.mu > _PERCENT
        if not doubtful.any():
            return doubts
        largest = float(self.mu.max())
        text = (
            f"mu_macro up to {largest:.4g}, and mu_macro above {_PERCENT:g} is rare: is it in per "
            "cent? Then name the column mu_macro [%], or divide by 100"
        )
        cases = int(np.count_nonzero(doubtful))
        return [Note(REMARK, text, UNITS, "mu_macro", cases=cases), *doubts]

    def elsewhere(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Return the inputs for :meth:`model` at other points: the ones in the call, and for the
        rest the value that all points have."""
        self._refuse_names(inputs, [*self.columns, "f"], (), "left out: it is fitted")
        if not inputs:
            return dict(self.columns)
        values = {name: to_si(name, value) for name, value in inputs.items()}
        replaced = {*values, *(["omega"] if "f" in values else [])}
        for name in [name for name in self.columns if name not in replaced]:
            if np.unique(self.columns[name]).size > 1:
                names = ", ".join(inputs)
                bound = f"given beside {names}: it differs between the points"
                raise InputError(name, f"{names} alone", bound)
            values[name] = float(self.columns[name][0])
        return values

    # --- the model --------------------------------------------------------------------------------

    def model(
        self, values: Mapping[str, Any], columns: Mapping[str, Array], slopes: bool = True
    ) -> tuple[Array, dict[str, Array]]:
        """Return mu_macro, and with ``slopes`` its derivatives with respect to the ``values``."""
        inputs: dict[str, Any] = {**columns, **values, **self.kind.names}
        answer = self.surrogate.evaluate(**inputs, gradient=slopes)
        gradient = answer.gradient if slopes else {}
        names = [name for name in values if name in gradient]
        return answer.mu_macro, {
            name: np.nan_to_num(gradient[name], posinf=0.0, neginf=0.0) for name in names
        }


def _friction(force: Any, load: Any) -> Any:
    """Return mu_macro, the friction force divided by the normal force.  Deviations of the two have
    no meaning here."""
    if load is None:
        raise InputError("Fz", None, f"given beside {FORCE}: mu_macro is {FORCE}/Fz")
    above, below = np.asarray(to_si(FORCE, force)), np.asarray(to_si("Fz", load))
    if above.ndim and below.ndim and above.shape != below.shape:
        raise InputError("data", (above.shape, below.shape), "columns of one length")
    with np.errstate(all="ignore"):  # a load that is not a number is refused later, with its name
        return np.where(below > 0.0, above / below, 0.0)


def _refuse(name: str, column: Array, legal: Bools, bound: str) -> None:
    """Refuse the first value that is not legal."""
    if not legal.all():
        index = int(np.argmin(legal))
        raise InputError(name, float(column[index]), bound, index)
