"""Compute tangential contact stiffness from materials and geometry: the input k that every
evaluation needs.

The theory is half-space elasticity: two smooth elastic bodies, small strains::

    1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2
    1/G* = (2 - nu1)/G1 + (2 - nu2)/G2,   G = E / (2 (1 + nu))

    circular contact of radius a      k = 8 a G*  (tangential),    2 a E*  (normal)
    ball of radius R under Fz         a = (3 Fz R / (4 E*))^(1/3)
    rigid flat punch                  a is its radius
    cylinder of length L lying        half width b = sqrt(4 Fz R / (pi L E*)),
                                      k of an elliptic contact: two values

k is the stiffness of a contact that sticks everywhere.  Under a ball the rim slips first, and gross
slip begins at the displacement 3/2 mu0 Fz/k.  No single spring can represent this: use
``contact="ball"``.  Under a flat punch with full contact the whole contact slips at once, and one
spring is exact.  A result holds both k and the contact::

    ball = ball_on_flat(5e-3, 10.0, steel, steel)
    surrogate.evaluate(**ball, mu0=0.3, Fz=10.0, y0=2e-6, f=20e3, v0=0.01)

Every function raises :class:`mumacro.InputError` for a value that is out of bounds or not a number,
for two rigid bodies, and if Hertz's theory has no meaning because the contact is wider than the
ball.  Above a tenth of the ball's radius it warns.

Not included are: roughness and the holder, whose compliances are in series (:func:`in_series`);
layers; and plastic flow, which begins below the surface at a Hertz pressure of about 1.6 times the
yield strength.

Command, service and page derive their fields from :data:`GEOMETRIES` and :data:`ARGUMENTS`.

References
----------
R. D. Mindlin, "Compliance of elastic bodies in contact", J. Appl. Mech. 16 (1949) 259.
K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985), Secs. 4.2 (Hertz),
7.2 (tangential loading).
V. L. Popov, "Contact Mechanics and Friction", Springer (2010), Secs. 5.2, 8.2; its G* is four
times the one here.
"""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from mumacro.errors import InputError
from mumacro.inputs.cases import real
from mumacro.inputs.doubts import UNITS
from mumacro.inputs.names import unknown_name
from mumacro.results import REMARK, WARNING, Note, Result, Rows

# limits of numbers in SI, so that every product of them below is a double
SMALLEST, LARGEST = 1e-60, 1e60
AXES = ("across", "along")  # directions of oscillation relative to the axis of a cylinder
# the half width of a contact, divided by the radius of ball or cylinder, above which Hertz's theory
# is inaccurate
WIDE = 0.1
#: members of a contact: the unit of each number
NUMBERS = {"k": "N/m", "k_normal": "N/m", "half_width": "m", "pressure": "Pa"}
SOFT = 1e6  # [Pa]; a smaller modulus was perhaps meant in GPa


def _number(name: str, value: Any) -> float:
    number = real(name, value)
    if number.ndim:
        raise InputError(name, value, "one number")
    return float(number)


def _positive(**values: Any) -> list[float]:
    """Return the values as numbers in SI."""
    numbers = {name: _number(name, value) for name, value in values.items()}
    for name, number in numbers.items():
        if not SMALLEST <= number <= LARGEST:
            raise InputError(name, number, f"finite and > 0, from {SMALLEST:g} to {LARGEST:g}")
    return [*numbers.values()]


#: E [Pa] and nu of common materials: the middle of the ranges that Gere prints.  For steel the
#: values of EN 1993-1-1, which are within these ranges
MATERIALS = {
    "steel": (210e9, 0.3),
    "aluminium alloy": (70e9, 0.33),
    "titanium alloy": (110e9, 0.33),
    "brass": (103e9, 0.34),
    "bronze": (108e9, 0.34),
    "copper": (115e9, 0.35),
    "nickel alloy": (210e9, 0.31),
    "tungsten": (360e9, 0.2),
    "glass": (70e9, 0.2),
    "nylon": (2.8e9, 0.4),
    "polyethylene": (1e9, 0.4),
}
SOURCE_OF_MATERIALS = "typical values after Gere, Mechanics of Materials, 5th edition"


def _named(name: str) -> tuple[float, float] | None:
    """Return E and nu of a common material, or None for another text.  Case and spaces in the name
    do not matter, and the word alloy may be missing."""
    words = name.lower().replace("-", " ").replace("_", " ").split()
    for known, numbers in MATERIALS.items():
        if words in (known.split(), known.removesuffix(" alloy").split()):
            return numbers
    return None


@dataclass(frozen=True)
class Material:
    """Hold an isotropic elastic body: Young's modulus E [Pa] > 0, ``math.inf`` if rigid; Poisson's
    ratio -1 < nu <= 0.5.

    A common material is known by its name alone, see :data:`MATERIALS`.

    >>> steel = Material(E=210e9, nu=0.3)
    >>> round(steel.G / 1e9, 2), Material("steel") == steel
    (80.77, True)
    """

    E: float
    nu: float

    def __init__(self, E: Any, nu: Any = None) -> None:
        named = _named(E) if isinstance(E, str) else None
        if named is not None and nu is not None:
            raise InputError("nu", nu, f"left out beside {E}, which has one")
        if named is None and nu is None:
            if isinstance(E, str):
                bound = f"one of {', '.join(MATERIALS)}; or E is a modulus [Pa], and beside it nu"
                raise InputError("material", E, bound)
            raise InputError("nu", None, "given: Poisson's ratio, beside E")
        E, nu = named or (_number("E", E), _number("nu", nu))
        _positive(E=LARGEST if math.inf == E else E)
        if not -1.0 < nu <= 0.5:
            raise InputError("nu", nu, "> -1 and <= 0.5")
        self.__dict__.update(E=E, nu=nu)

    @property
    def G(self) -> float:
        """Return the shear modulus [Pa]."""
        return self.E / (2.0 * (1.0 + self.nu))


@dataclass(frozen=True, repr=False)
class Contact(Result):
    """Hold the contact of two bodies; ``evaluate(**contact, ...)`` takes its ``k`` and its
    ``contact``."""

    k: float  #: tangential stiffness [N/m] while it sticks everywhere: the input of the model
    k_normal: float  #: normal stiffness [N/m]
    half_width: float  #: radius of a circular contact, half width of a line contact [m]
    #: the largest pressure [Pa]: Hertz's; under a flat punch the mean one, since the pressure is
    #: singular at the edge
    pressure: float
    #: the contact that ``evaluate`` computes with this k: "spring" or "ball"
    contact: str = "spring"
    #: warnings if the theory of k is inaccurate (``warnings`` issues them, too), and remarks on the
    #: geometry
    notes: tuple[Note, ...] = ()

    def keys(self) -> tuple[str, ...]:
        """Return the keywords for ``evaluate``: k, and the contact if it is not one spring."""
        return ("k",) if self.contact == "spring" else ("k", "contact")

    def __getitem__(self, name: str) -> Any:
        if name not in self.keys():
            raise KeyError(name)
        return getattr(self, name)

    @property
    def columns(self) -> dict[str, float]:
        """Return the numbers by name."""
        return {name: getattr(self, name) for name in NUMBERS}

    def _members(self) -> dict[str, Any]:
        remarks = {"remarks": self.remarks} if self.remarks else {}
        return {**self.columns, "contact": self.contact, "warnings": self.warnings, **remarks}

    def _heading(self) -> str:
        return f"<Contact: {self.contact}>"

    def _rows(self) -> Rows:
        return [(name, f"{x:.4g}", f"[{NUMBERS[name]}]") for name, x in self.columns.items()]

    def length_scale(self, mu0: float, Fz: float) -> float:
        """Return l0 = mu0 Fz / k [m], eq. (5): the elongation at which the contact slips."""
        mu0, Fz = _positive(mu0=mu0, Fz=Fz)
        return mu0 * (Fz / self.k)


def _moduli(first: Material, second: Material) -> tuple[float, float]:
    """Return E* and G* [Pa]."""
    for name, body in (("first", first), ("second", second)):
        if not isinstance(body, Material):
            raise InputError(
                name, body, 'a Material, such as Material("steel") or Material(E=210e9, nu=0.3)'
            )
    compliance = (1.0 - first.nu**2) / first.E + (1.0 - second.nu**2) / second.E
    shear = (2.0 - first.nu) / first.G + (2.0 - second.nu) / second.G
    if not compliance > 0.0:
        raise InputError("E", math.inf, "finite in at least one of the two bodies")
    return 1.0 / compliance, 1.0 / shear


def _hertz_cautions(
    half_width: float, radius: float, first: Material, second: Material, power: float
) -> tuple[Note, ...]:
    """Return warnings of a Hertzian contact that is wide compared with the radius of the body.
    Raise InputError if it is wider than the body.

    The half width is proportional to E* to the power -``power``.
    """
    share = half_width / radius
    if share <= WIDE:
        return ()
    if share <= 1.0:
        text = (
            f"the contact's half width {half_width:.3g} m is {share:.2g} of the radius: "
            f"Hertz's theory holds well below {WIDE:g}, k is rough"
        )
        return (Note(WARNING, text),)
    soft = [body for body in (first, second) if body.E < SOFT]
    if soft:
        in_gpa = (
            Material(1e9 * body.E, body.nu) if body in soft else body for body in (first, second)
        )
        share_in_gpa = share * (_moduli(first, second)[0] / _moduli(*in_gpa)[0]) ** power
        if share_in_gpa <= WIDE:
            modulus = soft[0].E
            bound = (
                f"in pascals: did you mean {modulus:g} GPa? With {modulus:g} Pa the contact is "
                f"{share:.3g} radii wide"
            )
            raise InputError("E", modulus, bound)
    bound = (
        f">= {half_width:.3g}, the half width of the contact: Hertz's theory holds for a small "
        "contact only"
    )
    raise InputError("radius", radius, bound)


def _issue_warnings(contact: Contact) -> Contact:
    """Return the contact after its warnings were issued to the caller of the caller."""
    for text in contact.warnings:
        warnings.warn(text, stacklevel=3)
    return contact


def ball_on_flat(radius: float, Fz: float, first: Material, second: Material) -> Contact:
    """Compute the contact of a ball on a flat, or of two balls: Hertz's radius, Mindlin's
    stiffness.

    Parameters
    ----------
    radius : float
        Radius of the ball [m]; for two balls 1/(1/R1 + 1/R2).
    Fz : float
        Normal force [N]; k grows with Fz^(1/3), so that l0 grows with Fz^(2/3).
    first, second : Material
        The two bodies.

    Notes
    -----
    See Johnson (1985), eqs. (4.22), (7.42).  The result holds for half_width << radius: above 0.1
    of the radius there is a warning, above the radius an error.  The normal stiffness is the
    tangent dFz/dz.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3)
    >>> contact = ball_on_flat(radius=5e-3, Fz=10.0, first=steel, second=steel)
    >>> f"{contact.k:.3g} N/m, {1e6 * contact.half_width:.1f} um, {contact.pressure / 1e9:.2f} GPa"
    '1.31e+07 N/m, 68.8 um, 1.01 GPa'
    >>> f"{1e6 * contact.length_scale(mu0=0.3, Fz=10.0):.2f} um"
    '0.23 um'
    """
    return _issue_warnings(hertz_ball(radius, Fz, first, second))


def hertz_ball(radius: float, Fz: float, first: Material, second: Material) -> Contact:
    """Return :func:`ball_on_flat`, but with warnings only in the result."""
    radius, Fz = _positive(radius=radius, Fz=Fz)
    modulus, shear = _moduli(first, second)
    a = (0.75 * (Fz / modulus) * radius) ** (1.0 / 3.0)
    cautions = _hertz_cautions(a, radius, first, second, 1.0 / 3.0)
    return Contact(
        8.0 * a * shear, 2.0 * a * modulus, a, 1.5 * Fz / (math.pi * a * a), "ball", cautions
    )


def flat_punch(radius: float, Fz: float, first: Material, second: Material) -> Contact:
    """Compute the contact of a flat circular end in full contact, such as a pin after running in.

    Parameters
    ----------
    radius : float
        Radius of the face [m].
    Fz : float
        Normal force [N]; it sets only the pressure, k does not depend on it.
    first, second : Material
        The two bodies; the result is exact for a rigid punch on a half-space.

    Examples
    --------
    >>> steel, rigid = Material(E=210e9, nu=0.3), Material(E=float("inf"), nu=0.3)
    >>> contact = flat_punch(radius=1e-3, Fz=10.0, first=rigid, second=steel)
    >>> f"{contact.k:.3g} N/m"
    '3.8e+08 N/m'
    """
    radius, Fz = _positive(radius=radius, Fz=Fz)
    modulus, shear = _moduli(first, second)
    return Contact(
        8.0 * radius * shear, 2.0 * radius * modulus, radius, Fz / (math.pi * radius * radius)
    )


def cylinder_on_flat(
    radius: float, length: float, Fz: float, first: Material, second: Material, oscillation: str
) -> Contact:
    """Compute the contact of a cylinder lying on a flat: Hertz's half width, the stiffness of an
    elongated contact in one of two directions.

    With nu > 0, k across the axis is the larger one, by up to 1/(1 - nu); the model has one k.
    **The direction of the oscillation decides.** If the two k differ by a factor of 1.3, mu~ with
    the k of the oscillation is right to 0.02, with the other k only to 0.13 (y~ from 0.3 to 10, v~
    from 0.2 to 2).

    A line contact of infinite length has no stiffness.  Here the length is finite.  The contact is
    replaced by the ellipse of the same area and proportions, which moves as a whole under a
    tangential force.  This is right to about 10 % if the bodies are large compared with ``length``.

    Parameters
    ----------
    radius, length : float
        Radius and length of the cylinder [m].
    Fz : float
        Normal force [N].
    first, second : Material
        The two bodies.
    oscillation : str
        "across" or "along" the cylinder's axis: the direction of the oscillation, whatever the
        sliding direction is.

    Raises
    ------
    InputError
        Also if the contact is wider than long, because then it is not a line contact.

    Notes
    -----
    Half width: Johnson (1985), eq. (4.43).  Stiffness: Mindlin (1949), by integrating Cerruti's
    solution under the traction that moves an ellipse as a whole.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3)
    >>> for oscillation in AXES:
    ...     contact = cylinder_on_flat(5e-3, 5e-3, 100.0, steel, steel, oscillation)
    ...     print(f"{oscillation} {contact.k:.3g} N/m, {1e6 * contact.half_width:.1f} um")
    across 1.67e+08 N/m, 33.2 um
    along 1.32e+08 N/m, 33.2 um
    """
    return _issue_warnings(hertz_cylinder(radius, length, Fz, first, second, oscillation))


def hertz_cylinder(
    radius: float, length: float, Fz: float, first: Material, second: Material, oscillation: str
) -> Contact:
    """Return :func:`cylinder_on_flat`, but with warnings only in the result."""
    if oscillation not in AXES:
        raise InputError(
            "oscillation",
            oscillation,
            f"{' or '.join(AXES)} the axis: its k is the one of the model",
        )
    along = oscillation == "along"
    radius, length, Fz = _positive(radius=radius, length=length, Fz=Fz)
    modulus, _ = _moduli(first, second)
    b = math.sqrt(4.0 * (Fz / length) * radius / (math.pi * modulus))
    cautions = _hertz_cautions(b, radius, first, second, 0.5)
    if 2.0 * b > length:
        raise InputError(
            "length",
            length,
            f">= {2.0 * b:.3g}, the width of the contact; a shorter one is a punch",
        )
    scale = 2.0 / math.sqrt(math.pi)  # of the ellipse that has the area of the rectangle
    narrow, wide = scale * b, scale * 0.5 * length
    shear = 1.0 / sum(_ellipse_compliance(narrow, wide, body, along) for body in (first, second))
    normal = 1.0 / sum(
        _ellipse_compliance(narrow, wide, Material(body.E, 0.0), along) * (1.0 - body.nu**2)
        for body in (first, second)
    )
    return Contact(shear, normal, b, 2.0 * Fz / (math.pi * b * length), notes=cautions)


def _ellipse_compliance(narrow: float, wide: float, body: Material, along: bool) -> float:
    """Return tangential displacement over force [m/N] of a half-space under q ~ (1 - x^2/narrow^2 -
    y^2/wide^2)^(-1/2).

    At the middle it is (1/(8 pi G narrow wide)) times the integral over all directions of R ((1 -
    nu) + nu c^2), where R is half of the chord and c the cosine of the angle to the force.  With
    the complete elliptic integrals of modulus m = sqrt(1 - (narrow/wide)^2) this is K ((1 - nu) +
    nu s) / (2 pi G wide), with s = (K - E)/(m^2 K) along the wide axis, otherwise 1 - s.
    """
    a, g = 1.0, narrow / wide  # K = pi / (2 agm(1, narrow/wide)), and s is a sum of the same means
    share = term = 0.5
    while a - g > 1e-15 * a:
        term *= 0.5 * (a - g) / (a + g)
        share += term
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    bend = (1.0 - body.nu) + body.nu * (share if along else 1.0 - share)
    return bend / (4.0 * a * body.G * wide)


def in_series(*stiffnesses: float) -> float:
    """Return the stiffness [N/m] > 0 of springs in series, such as contact, roughness and holder;
    ``math.inf`` is a rigid part.

    >>> round(in_series(3e6, 6e6))
    2000000
    """
    if not stiffnesses:
        raise InputError("stiffnesses", stiffnesses, "at least one")
    numbers = [_number("stiffness", value) for value in stiffnesses]
    for number in numbers:
        if not number > 0.0:
            raise InputError("stiffness", number, "> 0")
    total = sum(1.0 / number for number in numbers)
    return math.inf if total == 0.0 else 1.0 / total


# --- geometries by name ---------------------------------------------------------------------------


class Argument(NamedTuple):
    """Describe one argument: SI unit, meaning, an example as a person writes it; for a choice its
    only values."""

    unit: str
    meaning: str
    example: str
    choices: tuple[str, ...] = ()


class Geometry(NamedTuple):
    """Describe one geometry: its function, its meaning, and its own arguments (apart from those of
    the two bodies)."""

    function: Callable[..., Contact]
    meaning: str
    arguments: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all arguments that it takes, including alternatives."""
        instead = (INSTEAD[name] for name in self.arguments if name in INSTEAD)
        return (*self.arguments, *instead, *BODIES)


ARGUMENTS = {
    "radius": Argument("m", "radius of ball, pin or cylinder; of two balls 1/(1/R1 + 1/R2)", "5mm"),
    "diameter": Argument("m", "in place of the radius: twice as much", "10mm"),
    "length": Argument("m", "length of the cylinder", "10mm"),
    "Fz": Argument("N", "normal force", "10N"),
    "oscillation": Argument(
        "", "how the contact oscillates beside the axis of the cylinder", AXES[0], AXES
    ),
    "E": Argument("Pa", "Young's modulus of the first body; rigid, or a number", "210GPa"),
    "nu": Argument("-", "its Poisson's ratio", "0.3"),
    "E2": Argument(
        "Pa",
        "Young's modulus of the second body; left out, the bodies are of one material",
        "70GPa",
    ),
    "nu2": Argument("-", "its Poisson's ratio; left out, that of the first body", "0.33"),
}
#: arguments of every geometry; the first two are required
BODIES = ("E", "nu", "E2", "nu2")
#: pairs of arguments of which one replaces the other
INSTEAD = {"radius": "diameter"}
#: lengths that bodies usually have [m]
_USUAL = 1e-6, 0.5
GEOMETRIES = {
    "ball": Geometry(hertz_ball, "a ball on a flat, or two balls", ("radius", "Fz")),
    "flat": Geometry(
        flat_punch,
        "a flat circular end in full contact, such as a pin that has run in",
        ("radius", "Fz"),
    ),
    "cylinder": Geometry(
        hertz_cylinder, "a lying cylinder", ("radius", "length", "Fz", "oscillation")
    ),
}


def contact_of(geometry: str, /, **arguments: Any) -> Contact:
    """Return the contact of one of :data:`GEOMETRIES`, from its arguments and those of the bodies
    in SI.

    Its notes have the warnings, and remarks on lengths that are unusual for a body.  Raise
    InputError for an unknown geometry, and for an argument that is missing, unknown, not a number
    or out of bounds.

    >>> contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3).contact
    'ball'
    """
    if geometry not in GEOMETRIES:
        raise InputError("geometry", geometry, f"one of {', '.join(GEOMETRIES)}")
    entry, values = GEOMETRIES[geometry], dict(arguments)
    for name, value in arguments.items():
        if name not in entry.names:
            raise InputError(name, value, f"left out: {unknown_name(name, entry.names)}")
        if not ARGUMENTS[name].choices:
            _number(name, value)
    if "diameter" in values:
        if "radius" in values:
            raise InputError("diameter", values["diameter"], "left out beside radius")
        values["radius"] = 0.5 * values.pop("diameter")
    for name in (*entry.arguments, "E", "nu"):
        if name not in values:
            unit, meaning, *_ = ARGUMENTS[name]
            words = f"{meaning}; or {INSTEAD[name]}" if name in INSTEAD else meaning
            raise InputError(name, None, f"given{f' [{unit}]' if unit else ''}: {words}")
    first = Material(values["E"], values["nu"])
    second = Material(values.get("E2", first.E), values.get("nu2", first.nu))
    lengths_and_load = {name: values[name] for name in entry.arguments}
    try:
        contact = entry.function(first=first, second=second, **lengths_and_load)
    except InputError as error:
        if error.field != "radius" or "diameter" not in arguments:
            raise
        bound = f"twice a radius that is {error.bound}"
        raise InputError("diameter", arguments["diameter"], bound) from None
    return replace(contact, notes=(*contact.notes, *_doubts_of(arguments)))


def _doubts_of(arguments: Mapping[str, Any]) -> list[Note]:
    """Return a question for each length of a geometry that is unusual for a body."""
    least, most = _USUAL
    remarks: list[Note] = []
    for name in ("radius", "diameter", "length"):
        value = arguments.get(name)
        if value is None or least <= value <= most:
            continue
        question = f"is it {value:.6g} mm?" if value > most else "is it in metres?"
        text = f"{name} = {value:.6g} m: {question} Usual is {least:g} to {most:g} m"
        remarks.append(Note(REMARK, text, UNITS, name))
    return remarks
