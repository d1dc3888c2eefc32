"""Contact stiffness: the textbook's relations, the ellipse by brute force, bounds, the list of
geometries."""

import functools
import inspect
import itertools
import math
from typing import Any

import numpy as np
import pytest

from mumacro import InputError, Surrogate, stiffness
from mumacro.cli.main import main
from mumacro.inputs.case import read_one
from mumacro.stiffness import (
    ARGUMENTS,
    AXES,
    BODIES,
    GEOMETRIES,
    INSTEAD,
    MATERIALS,
    Contact,
    Material,
    ball_on_flat,
    contact_of,
    cylinder_on_flat,
    flat_punch,
    in_series,
)
from tests.support.cases import Capture, Case
from tests.support.comparing import close
from tests.support.refusals import refused

STEEL, RUBBER, RIGID = Material(210e9, 0.3), Material(5e6, 0.5), Material(math.inf, 0.3)


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.3, 0.5])
def test_equal_bodies_have_mindlins_ratio(nu: float) -> None:
    body = Material(1e9, nu)
    for contact in (ball_on_flat(1e-2, 5.0, body, body), flat_punch(1e-3, 5.0, body, body)):
        assert contact.k / contact.k_normal == close(2.0 * (1.0 - nu) / (2.0 - nu), rel=1e-14)


def test_the_ball_follows_hertz() -> None:
    result = ball_on_flat(5e-3, 10.0, STEEL, RIGID)
    modulus = 210e9 / (1.0 - 0.09)
    depth = result.half_width**2 / 5e-3
    assert 4.0 / 3.0 * modulus * math.sqrt(5e-3) * depth**1.5 == close(10.0, rel=1e-13)
    # the normal stiffness is the tangent of that law
    assert result.k_normal == close(2.0 * modulus * math.sqrt(5e-3 * depth), rel=1e-13)
    assert result.pressure * 2.0 / 3.0 * math.pi * result.half_width**2 == close(10.0, rel=1e-13)
    assert ball_on_flat(5e-3, 80.0, STEEL, RIGID).k == close(2.0 * result.k, rel=1e-13)
    soft, alone = (ball_on_flat(1e-2, 0.5, RUBBER, other).k for other in (STEEL, RIGID))
    assert soft == close(alone, rel=1e-3)  # the soft body decides


@pytest.mark.parametrize("width", [0.33, 0.02, 1e-4])
@pytest.mark.parametrize("axis", AXES)
def test_a_cylinder_touches_in_an_ellipse_whose_compliance_is_an_integral_over_all_directions(
    width: float, axis: str
) -> None:
    """The ellipse has the area of the rectangle; the integral is by brute force."""
    radius, length = 100.0, 1.0
    half = length * width
    Fz = math.pi * half**2 * length * 210e9 / (1.0 - 0.09) / (4.0 * radius)
    contact = cylinder_on_flat(radius, length, Fz, STEEL, RIGID, axis)
    assert contact.half_width == close(half, rel=1e-13)
    narrow, wide = (2.0 / math.sqrt(math.pi) * x for x in (half, 0.5 * length))
    phi = (np.arange(4_000_000) + 0.5) * (2.0 * math.pi / 4_000_000)  # smooth and periodic
    chord = 1.0 / np.hypot(np.cos(phi) / narrow, np.sin(phi) / wide)
    cosine = (np.sin(phi) if axis == "along" else np.cos(phi)) ** 2
    brute = (chord * ((1.0 - 0.3) + 0.3 * cosine)).mean() / (4.0 * STEEL.G * narrow * wide)
    assert 1.0 / contact.k == close(brute, rel=1e-10)


def test_a_lying_cylinder_is_stiffer_across_its_axis_and_hardly_depends_on_the_load() -> None:
    across, along = (cylinder_on_flat(5e-3, 5e-3, 100.0, STEEL, STEEL, axis) for axis in AXES)
    assert 1.0 < across.k / along.k < 1.0 / (1.0 - 0.3)
    assert 1.0 < cylinder_on_flat(5e-3, 5e-3, 400.0, STEEL, STEEL, "across").k / across.k < 1.3
    assert across.pressure == close(2.0 * 100.0 / (math.pi * across.half_width * 5e-3), rel=1e-14)
    incompressible = Material(1e9, 0.0)
    same = cylinder_on_flat(1e-2, 1e-2, 10.0, incompressible, incompressible, "along")
    assert same.k == close(same.k_normal, rel=1e-14)


@pytest.mark.parametrize(("across", "along"), [(1.3, 1.0), (1.0, 1.3)])
def test_of_two_stiffnesses_the_oscillations_is_the_models(
    surrogate: Surrogate, across: Any, along: Any
) -> None:
    """Eqs. (9) to (12) with two springs, marched: ``across`` along the sliding, ``along`` along the
    oscillation."""
    v, y = (
        x.ravel() for x in np.meshgrid([0.2, 0.6, 2.0], [0.3, 0.8, 1.2, 3.0, 10.0], indexing="ij")
    )
    steps, springs = 1000, np.array([[across], [along]])
    path = np.sin(np.linspace(0.0, 2.0 * math.pi, steps + 1))
    force = np.zeros((2, v.size))
    for _ in range(15):
        total = np.zeros(v.size)
        for rise in np.diff(path):
            free = force + springs * np.array([v * (2.0 * math.pi / steps), y * rise])
            # slip along the force by as much as brings it back to 1: Newton's method for its length
            slip = np.zeros(v.size)
            for _ in range(3):
                force = free / (1.0 + springs * slip)
                excess = (force * force).sum(axis=0) - 1.0
                slope = 2.0 * (force * force * springs / (1.0 + springs * slip)).sum(axis=0)
                slip = np.maximum(slip + excess / slope, 0.0)
            force = free / (1.0 + springs * slip)
            total += force[0]
    off = [np.abs(surrogate.mu_ratio(v * k, y * k) - total / steps).max() for k in (along, across)]
    assert off[0] < 0.02
    assert 0.12 < off[1] < 0.13


def test_stiffness_has_its_scaling_laws_and_adds_in_series() -> None:
    # lengths times 2, forces times 4: the same strains, k twice
    small, large = (
        cylinder_on_flat(x, x, 4e6 * x * x, STEEL, STEEL, "across") for x in (5e-3, 1e-2)
    )
    assert (large.k, large.pressure) == (
        close(2.0 * small.k, rel=1e-13),
        close(small.pressure, rel=1e-13),
    )
    assert (in_series(4.0), in_series(4.0, math.inf), in_series(4.0, 4.0), in_series(math.inf)) == (
        4,
        4,
        2,
        math.inf,
    )
    assert Contact(2.0, 1.0, 1.0, 1.0).length_scale(0.5, 8.0) == 2.0


@pytest.mark.parametrize(
    ("field", "function", "arguments"),
    [
        ("E", Material, (0.0, 0.3)),
        ("E", Material, (math.nan, 0.3)),
        ("nu", Material, (1e9, 0.6)),
        ("nu", Material, (1e9, math.nan)),
        ("radius", ball_on_flat, (-1.0, 1.0, STEEL, STEEL)),
        ("Fz", ball_on_flat, (1.0, math.inf, STEEL, STEEL)),
        ("E", ball_on_flat, (1.0, 1.0, RIGID, RIGID)),
        ("radius", ball_on_flat, (1e-300, 1.0, STEEL, STEEL)),
        ("Fz", cylinder_on_flat, (1.0, 1.0, 1e-300, STEEL, STEEL, "across")),
        ("oscillation", cylinder_on_flat, (1.0, 1.0, 1.0, STEEL, STEEL, "axial")),
        ("length", cylinder_on_flat, (1.0, 1e-6, 1e3, STEEL, STEEL, "across")),
        ("radius", flat_punch, (0.0, 1.0, STEEL, STEEL)),
        ("stiffness", in_series, (1.0, -1.0)),
        ("stiffnesses", in_series, ()),
        ("stiffness", in_series, ("soft",)),
        ("E", Material, ("210 N", 0.3)),
        ("nu", Material, (1e9, "steel")),
        ("radius", ball_on_flat, ("5N", 1.0, STEEL, STEEL)),
        ("Fz", flat_punch, (1.0, "10mm", STEEL, STEEL)),
        ("second", ball_on_flat, (1.0, 1.0, STEEL, "steel")),
        ("mu0", Contact(1.0, 1.0, 1.0, 1.0).length_scale, (0.0, 1.0)),
    ],
)
def test_a_bad_value_is_named(field: str, function: Any, arguments: Any) -> None:
    with refused(field):
        function(*arguments)


def test_hertz_wants_a_small_contact() -> None:
    shapes: list[tuple[Any, Any]] = [(ball_on_flat, ()), (cylinder_on_flat, ("across",))]
    for function, more in shapes:
        length = (1.0,) if more else ()
        for share in (0.099, 0.101, 0.99, 1.01):
            # of a half width that is proportional to a power of Fz
            one: Any = function(5e-3, *length, 1e-4, RUBBER, RIGID, *more)
            Fz = 1e-4 * (share * 5e-3 / one.half_width) ** (2 if more else 3)
            ask = functools.partial(function, 5e-3, *length, Fz, RUBBER, RIGID, *more)
            if share > 1.0:
                with pytest.raises(
                    InputError, match=r"radius must be >= 0.00505, the half width of the contact"
                ):
                    ask()
            elif share > 0.1:
                with pytest.warns(
                    UserWarning,
                    match=f"is {share:.2g} of the radius: Hertz's theory holds well below",
                ):
                    assert len(ask().warnings) == 1
            else:
                assert ask().warnings == []


@pytest.mark.parametrize("second", [{}, {"E2": math.inf}])
@pytest.mark.parametrize(
    "shape", [("ball", {}), ("cylinder", {"length": 5e-3, "oscillation": "across"})]
)
def test_forgotten_gigapascals_are_told(second: Any, shape: tuple[str, Any]) -> None:
    inputs = {"radius": 5e-3, "Fz": 10.0, "E": 210, "nu": 0.3, **second, **shape[1]}
    with pytest.raises(InputError, match=r"^E must be in pascals: did you mean 210 GPa\?"):
        contact_of(shape[0], **inputs)
    assert contact_of(shape[0], **{**inputs, "E": 210e9}).warnings == []
    with refused("radius"):  # GPa do not explain it
        contact_of(shape[0], **{**inputs, "E": 210, "Fz": 1e12})


# --- geometries by name ---------------------------------------------------------------------------


def test_the_list_has_the_arguments_of_the_functions() -> None:
    used = {name for geometry in GEOMETRIES.values() for name in geometry.arguments}
    assert used | {*BODIES} == {*ARGUMENTS} - {*INSTEAD.values()}
    for geometry in GEOMETRIES.values():
        named = [
            name
            for name in inspect.signature(geometry.function).parameters
            if name not in ("first", "second")
        ]
        assert named == list(geometry.arguments)


def test_a_named_geometry_is_its_function() -> None:
    steel = {"E": 210e9, "nu": 0.3}
    assert contact_of("ball", radius=5e-3, Fz=10.0, **steel) == ball_on_flat(
        5e-3, 10.0, STEEL, STEEL
    )
    assert contact_of("flat", radius=1e-3, Fz=10.0, **steel, E2=5e6, nu2=0.5) == flat_punch(
        1e-3, 10.0, STEEL, RUBBER
    )
    for axis in AXES:
        contact = contact_of(
            "cylinder", radius=5e-3, length=5e-3, Fz=1e2, oscillation=axis, E2=math.inf, **steel
        )
        assert contact == cylinder_on_flat(5e-3, 5e-3, 1e2, STEEL, RIGID, axis)


@pytest.mark.parametrize(
    ("geometry", "arguments", "message"),
    [
        ("cone", {}, "geometry must be one of ball, flat, cylinder, got 'cone'"),
        ("ball", {"radius": 1.0, "E": 1e9, "nu": 0.3}, r"Fz must be given \[N\]: normal force"),
        (
            "cylinder",
            {"radius": 1.0, "length": 1.0, "Fz": 1.0, "E": 1e9, "nu": 0.3},
            "oscillation must be given: how",
        ),
        ("ball", {"length": 1.0}, "length must be left out: unknown field"),
        ("ball", {"radius": "5N", "Fz": 1.0, "E": 1e9, "nu": 0.3}, "radius must be "),
        ("ball", {"radius": [1.0, 2.0]}, "radius must be one number"),
        ("ball", {"radius": 1.0, "Fz": 1.0, "E": math.nan, "nu": 0.3}, "E must be finite and > 0"),
    ],
)
def test_a_bad_argument_is_named_with_the_remedy(
    geometry: Any, arguments: Any, message: Any
) -> None:
    with pytest.raises(InputError, match=message):
        contact_of(geometry, **arguments)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_numbers_of_any_size_give_a_contact_or_a_reason(geometry: str) -> None:
    sizes = [5e-324, stiffness.SMALLEST, 1.0, stiffness.LARGEST, 1.7e308]
    names = [name for name in GEOMETRIES[geometry].arguments if name != "oscillation"]
    rest: Case = {"nu": 0.3, "E2": math.inf, "nu2": 0.5} | (
        {"oscillation": "along"} if geometry == "cylinder" else {}
    )
    for numbers in itertools.product(sizes, repeat=len(names) + 1):
        inputs = dict(zip([*names, "E"], numbers, strict=True))
        try:
            contact = contact_of(geometry, **inputs, **rest)
        except InputError:
            continue
        stated = (contact.k, contact.k_normal, contact.half_width, contact.pressure)
        assert all(0.0 < value < math.inf for value in stated), (inputs, contact)


def test_arguments_are_read_with_units() -> None:
    read = {
        "E": ("210 GPa", 210e9),
        "radius": ("5mm", 5e-3),
        "Fz": ("10N", 10.0),
        "nu": ("0.3", 0.3),
    }
    for name, (text, value) in {**read, "E2": ("Rigid", math.inf)}.items():
        assert read_one(name, text) == value
    with refused("E"):
        read_one("E", "210 N")
    assert read_one("nu", "0,3") == 0.3


def test_a_result_can_be_passed_on(surrogate: Surrogate) -> None:
    case: Case = {"mu0": 0.3, "Fz": 10.0, "y0": 2e-6, "f": 20e3, "v0": 0.01}
    punch, ball = flat_punch(1e-3, 10.0, STEEL, STEEL), ball_on_flat(5e-3, 10.0, STEEL, STEEL)
    assert (
        surrogate.evaluate(**punch, **case).mu_macro
        == surrogate.evaluate(k=punch.k, **case).mu_macro
    )
    assert dict(ball) == {"k": ball.k, "contact": "ball"}
    with pytest.raises(KeyError):
        ball["pressure"]


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_a_diameter_is_twice_a_radius(geometry: str) -> None:
    more = {"length": 5e-3, "oscillation": "along"} if geometry == "cylinder" else {}
    bodies = {"Fz": 10.0, "E": 210e9, "nu": 0.3, **more}
    assert contact_of(geometry, diameter=8e-3, **bodies) == contact_of(
        geometry, radius=4e-3, **bodies
    )
    for wrong in (0.0, -1e-3, math.nan, math.inf):
        with refused("diameter"):
            contact_of(geometry, diameter=wrong, **bodies)
    with refused("diameter"):
        contact_of(geometry, diameter=8e-3, radius=4e-3, **bodies)
    with pytest.raises(InputError, match="diameter"):  # which is offered
        contact_of(geometry, **bodies)


@pytest.mark.parametrize("name", ["radius", "diameter", "length"])
def test_lengths_that_bodies_do_not_have_are_doubted(name: str) -> None:
    others: Case = {"radius": 5e-3, "oscillation": "along"} if name == "length" else {}
    geometry = "cylinder" if others else "flat"
    for value, doubted in ((1e-9, True), (1e-6, False), (5e-3, False), (0.5, False), (5.0, True)):
        arguments: Case = {"Fz": 1e-20, "E": 210e9, "nu": 0.3, **others, name: value}
        assert [one.field for one in contact_of(geometry, **arguments).notes] == [name] * doubted


def test_materials_have_a_name(capsys: Capture) -> None:
    for name, (modulus, ratio) in MATERIALS.items():
        assert Material(name) == Material(modulus, ratio)
    assert Material("Steel") == STEEL
    assert Material("Aluminium-Alloy") == Material("aluminium") == Material(70e9, 0.33)
    with refused("material"):
        Material("cheese")
    with refused("nu"):
        Material("steel", 0.3)
    with refused("nu"):
        Material(210e9)
    words = ["stiffness", "ball", "--radius", "5mm", "--Fz", "10N"]
    outputs = []
    for numbers in (
        ["--E", "210GPa", "--nu", "0.3", "--E2", "70GPa", "--nu2", "0.2"],
        ["--material", "steel", "--material2", "glass"],
    ):
        assert main([*words, *numbers]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]
    assert main([*words, "--material", "cheese"]) == 2
    assert "steel" in capsys.readouterr().err
    assert main([*words, "--material", "steel", "--nu", "0.3"]) == 2
    assert "leave it out beside --material" in capsys.readouterr().err
