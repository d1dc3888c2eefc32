"""Convert samples of an oscillation, such as those of a sensor, to the harmonics of a motion."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.carried import carried_unit
from mumacro.inputs.columns import to_si
from mumacro.inputs.fields import Numbers
from mumacro.kernel.arrays import Array
from mumacro.motions.oscillation import MEMBERS, MOST_HARMONIC
from mumacro.results import NOTE, Note, Result, texts_of

# Relative to the largest sample: the rounding error of a term, and of the difference between equal
# samples.
_NOTHING, _SAME = 8.0 * 2.0**-52, 1e-9
# A symmetric oscillation may begin and end with the same value although no sample is repeated.
# Then the residual with all samples is smaller than this fraction of the residual without the last
# one.
_CLEARLY = 1e-3
_REPEATED = "the last sample repeats the first, which begins the next period: it is left out"


@dataclass(frozen=True, repr=False)
class Harmonics(Result):
    """Hold the harmonics of an oscillation, in the unit of its samples."""

    #: (harmonic, amplitude, phase in degrees): amplitude sin(harmonic omega t + phase), with t = 0
    #: at the first sample; harmonics that are 0 are left out
    terms: tuple[tuple[int, float, float], ...]
    mean: float  #: mean of the samples
    rms: float  #: root mean square of the rest after mean and terms
    notes: tuple[Note, ...] = field()  #: what was changed in the samples

    @property
    def columns(self) -> dict[str, Any]:
        """Return the terms as columns: harmonic, amplitude, phase."""
        return {name: np.array([term[i] for term in self.terms]) for i, name in enumerate(MEMBERS)}

    def _members(self) -> dict[str, Any]:
        """Return the terms as dicts, as HTTP takes them, and the root mean square of the rest."""
        return {
            "terms": [dict(zip(MEMBERS, term, strict=True)) for term in self.terms],
            "mean": self.mean,
            "rms": self.rms,
            "notes": texts_of(self.notes, NOTE),
        }

    def _heading(self) -> str:
        return f"<Harmonics: {len(self.terms)}, mean {self.mean:.6g}, rms left out {self.rms:.3g}>"

    def _shown(self) -> dict[str, Any]:
        return self.columns if self.terms else {}


def harmonics(samples: Numbers, periods: int = 1, most: int = 20) -> Harmonics:
    """Return the harmonics of a sampled oscillation, as :func:`mumacro.motion` takes them.

    Parameters
    ----------
    samples : array_like
        Values at equal time steps over whole periods, shape (n,): of x or y [m], or of the normal
        force [N], whose mean is Fz.  A last sample that repeats the first is left out, with a note.
    periods : int
        Number of periods.
    most : int
        The largest harmonic, less than half of the samples of a period.

    Returns
    -------
    Harmonics
        ``terms`` for ``motion``, ``mean``, and ``rms``, the root mean square of the rest: harmonics
        above ``most``, noise, and differences between the periods.

    Raises
    ------
    InputError
        If a sample is not a finite number, or there are too few samples for the harmonics.

    Examples
    --------
    A triangle of 2 um along the drag, from 200 samples:

    >>> from mumacro import motion
    >>> tau = 2 * np.pi * np.arange(200) / 200
    >>> wanted = harmonics(2e-6 * np.arcsin(np.sin(tau)) / (np.pi / 2), most=5)
    >>> [(order, f"{size:.3g}", round(phase) % 360) for order, size, phase in wanted.terms]
    [(1, '1.62e-06', 0), (3, '1.8e-07', 180), (5, '6.5e-08', 0)]
    >>> case = dict(mu0=0.3, Fz=10.0, k=1e6, f=20e3, v0=0.02)
    >>> f"{motion(**case, x=wanted.terms).mu_macro:.4f}, {motion(**case, x=2e-6).mu_macro:.4f}"
    '0.1560, 0.1398'
    """
    values = _samples(samples)
    for name, number, bound in (
        ("periods", periods, "a whole number >= 1"),
        ("most", most, f"a whole number from 1 to {MOST_HARMONIC}"),
    ):
        whole = isinstance(number, (int, np.integer)) and not isinstance(number, bool)
        if not whole or number < 1 or (name == "most" and number > MOST_HARMONIC):
            raise InputError(name, number, bound)
    scale = float(np.abs(values).max()) or 1.0
    scaled = values / scale
    size, swing, notes = scaled.size, float(np.ptp(scaled)), []
    repeats = swing > 0.0 and abs(scaled[-1] - scaled[0]) <= _SAME * swing
    if not 2 * most * periods < size - repeats:
        allowed = (size - repeats - 1) // (2 * periods)
        bound = f"less than half of the samples of a period, {(size - repeats) / periods:g}"
        remedy = f"at most {allowed} here" if allowed else "give more samples"
        raise InputError("most", most, f"{bound}: {remedy}")
    result = _spectrum(scaled, scale, periods, most)
    if repeats:
        shorter = _spectrum(scaled[:-1], scale, periods, most)
        if not result.rms < _CLEARLY * shorter.rms:
            result, notes = shorter, [Note(NOTE, _REPEATED)]
    return replace(result, notes=tuple(notes))


def _samples(samples: Any) -> Array:
    """Return the samples as finite numbers in SI, (n,), n >= 3."""
    has_unit = carried_unit(samples) is not None
    values = np.asarray(_in_si(samples) if has_unit else to_si("samples", samples))
    if values.ndim != 1 or values.size < 3:
        raise InputError("samples", values.shape, "a list of 3 numbers or more")
    if not np.isfinite(values).all():
        index = int(np.argmin(np.isfinite(values)))
        bound = "finite: a sample that is missing cannot be left out, the steps would differ"
        raise InputError("samples", float(values[index]), bound, index)
    return values


def _in_si(samples: Any) -> Any:
    """Return samples with a unit of length or of force in SI."""
    try:
        return to_si("samples", samples, "length")
    except InputError:
        return to_si("samples", samples, "force")


def _spectrum(scaled: Array, scale: float, periods: int, most: int) -> Harmonics:
    """Return the harmonics of samples in units of ``scale``, without a repeated sample."""
    mean = float(scaled.mean())
    spectrum = np.fft.rfft(scaled - mean) / scaled.size
    orders = np.arange(1, most + 1)
    lines = spectrum[orders * periods]
    amplitudes, phases = 2.0 * np.abs(lines), np.degrees(np.angle(1j * lines))
    spectrum[0] = 0.0
    spectrum[orders * periods] = 0.0
    rest = np.fft.irfft(spectrum * scaled.size, scaled.size)
    terms = tuple(
        (order, scale * amplitude, phase)
        for order, amplitude, phase in zip(
            orders.tolist(), amplitudes.tolist(), phases.tolist(), strict=True
        )
        if amplitude > _NOTHING
    )
    return Harmonics(terms, scale * mean, scale * math.sqrt(float(np.mean(rest**2))), ())
