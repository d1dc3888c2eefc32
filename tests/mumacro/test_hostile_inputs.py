"""One policy for bad input: a bad scalar is refused by name, a bad array value gives NaN, and
nothing crashes."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mumacro import InputError, Surrogate
from mumacro.table.atlas import QUANTITY_NAMES
from tests.support.cases import CASE, tables, without
from tests.support.refusals import refused

#: methods of (v~, y~)
PLANE: dict[str, Callable[..., Any]] = {
    **{name: getattr(Surrogate, name) for name in QUANTITY_NAMES},
    **{
        f"{name} with its bound": lambda s, v, y, name=name: s.quantity(name, v, y)
        for name in QUANTITY_NAMES
    },
    **{
        f"slopes of {of}": lambda s, v, y, of=of: s.slopes(v, y, of, bounds=True)
        for of in QUANTITY_NAMES
    },
}
NO_NUMBERS: dict[str, Any] = {
    "text": "fast",
    "complex": 1j,
    "None": None,
    "object": object(),
    "a set": {1.0},
    "ragged": [[1.0], [1.0, 2.0]],
    "too large": 10**400,
    "times": np.array(["2020-01-01"], dtype="datetime64[s]"),
    "objects": np.array([object()]),
    "truth values": [True, False],
    "long": ["x" * 100_000] * 100,
}
OUT_OF_BOUNDS = [-1.0, -1e6, -5e-324, -math.inf, math.nan, -1, np.float32(-1.0), np.int8(-3)]
table = tables(1e-4)


def parts(answer: Any) -> tuple[Any, ...]:
    """A value alone, or with bound or slopes."""
    return answer if isinstance(answer, tuple) else (answer,)


@pytest.mark.parametrize("method", PLANE)
@pytest.mark.parametrize("bad", NO_NUMBERS)
def test_a_value_that_is_not_a_number_is_named(table: Surrogate, method: str, bad: str) -> None:
    for v, y, field in ((NO_NUMBERS[bad], 0.5, "v_tilde"), (0.1, NO_NUMBERS[bad], "y_tilde")):
        with refused(f"{field}[*]") as caught:
            PLANE[method](table, v, y)
        assert len(str(caught.value)) < 400
    with pytest.raises(InputError):
        table.v_tilde_crit(NO_NUMBERS[bad])


@pytest.mark.parametrize("method", PLANE)
@pytest.mark.parametrize("bad", OUT_OF_BOUNDS, ids=repr)
def test_a_scalar_out_of_bounds_is_named_and_in_an_array_nan(
    table: Surrogate, method: str, bad: Any
) -> None:
    ask = PLANE[method]
    for v, y, field in ((bad, 0.5, "v_tilde"), (0.1, bad, "y_tilde")):
        with refused(field):
            ask(table, v, y)
        many = ask(table, np.array([0.1, float(v), 0.1]), np.array([0.5, float(y), 0.5]))
        for one, column in zip(parts(ask(table, 0.1, 0.5)), parts(many), strict=True):
            assert column[0] == column[2] == one
            assert column[1] == -1 if column.dtype == np.int8 else math.isnan(column[1])


@pytest.mark.parametrize("method", PLANE)
def test_numbers_of_every_kind_and_layout_agree(table: Surrogate, method: str) -> None:
    ask = PLANE[method]
    rng = np.random.default_rng(3)
    # exact in half precision
    v = np.round(10.0 ** rng.uniform(-2.0, 2.0, (6, 10)) * 64.0) / 64.0 + 1.0 / 64.0
    v = v.astype(np.float16).astype(np.float64)
    y = 10.0 ** rng.uniform(-2.0, 2.0, (6, 10))
    expected = ask(table, v, y)
    read_only = v.copy()
    read_only.flags.writeable = False
    spread = np.zeros((12, 30))
    spread[::2, ::3] = v
    unaligned = (
        np.frombuffer(b"x" + v.tobytes(), dtype=np.uint8)[1:].view(np.float64).reshape(v.shape)
    )
    layouts: dict[str, Any] = {
        "order": np.asfortranarray(v),
        "read only": read_only,
        "strided": spread[::2, ::3],
        "list": v.tolist(),
        "big endian": v.astype(">f8"),
        "half": v.astype(np.float16),
        "single": v.astype(np.float32),
        "long": v.astype(np.longdouble),
        "objects": v.astype(object),
        "reversed": v[::-1][::-1],
        "unaligned": unaligned,
        "tuple": tuple(map(tuple, v)),
        "masked": np.ma.masked_array(v, mask=False),
        "memory": memoryview(v.data),
    }
    for name, layout in layouts.items():
        for one, two in zip(parts(ask(table, layout, y)), parts(expected), strict=True):
            np.testing.assert_array_equal(one, two, err_msg=name)
    assert np.array_equal(spread[::2, ::3], v)
    for one in (np.float16(1), np.longdouble(1), np.uint64(1), np.array(1), 1):
        assert parts(ask(table, one, 0.5))[0] == parts(ask(table, 1.0, 0.5))[0]
    empty: Any
    for empty in (np.empty(0), [], np.empty((0, 3))):
        assert np.shape(parts(ask(table, empty, 0.5))[0]) == np.shape(empty)
    assert isinstance(parts(ask(table, np.array(0.1), np.array(0.5)))[0], float)
    assert parts(ask(table, np.broadcast_to(0.1, (3, 4)), 0.5))[0].shape == (3, 4)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_masked_cases_have_no_answer(table: Surrogate, kind: type) -> None:
    """A masked value is unknown: the value under the mask is not evaluated."""
    masked: Any = np.ma.masked_array([1, 2, 3], mask=[False, True, False], dtype=kind)
    ratio = table.mu_ratio(masked, 0.5)
    assert np.isnan(ratio).tolist() == [False, True, False]
    assert table.evaluate({**CASE, "v0": masked}).source_code.tolist()[1] == -1
    assert masked.data.tolist() == [1, 2, 3]
    for v, y, field in ((np.ma.masked, 0.5, "v_tilde"), (1.0, math.inf, "y_tilde")):
        with refused(field):
            table.mu_ratio(v, y)


def test_the_callers_floating_point_settings_are_unchanged(table: Surrogate) -> None:
    with np.errstate(all="raise"):
        table.mu_ratio(np.array([1e-304, math.nan, 0.1]), np.array([1.4e5, 0.5, 0.5]))
        columns = {
            "mu0": [1e-300, 0.3],
            "Fz": 1e-300,
            "k": [math.inf, 1.0],
            "y0": 1e-300,
            "omega": 1e-300,
        }
        answer = table.evaluate({**columns, "v0": [1e-310, -1.0]}, gradient=True)
        assert answer.regime_certain.shape == (2,)
        assert np.geterr()["under"] == "raise"


@pytest.mark.parametrize("method", PLANE)
def test_shapes_that_do_not_broadcast_are_told(table: Surrogate, method: str) -> None:
    with refused("y_tilde"):
        PLANE[method](table, np.ones(3), np.ones(2))


def test_of_must_be_a_quantity(table: Surrogate) -> None:
    bad: Any
    for bad in ("mu", "", None, 3, ["power"]):
        with refused("of"):
            table.slopes(0.1, 0.5, of=bad)


@pytest.mark.parametrize("bad", [bad for bad in NO_NUMBERS if bad != "None"])
@pytest.mark.parametrize("field", ["mu0", "k", "omega", "f", "v0"])
def test_evaluate_names_a_value_that_is_not_a_number(
    table: Surrogate, field: str, bad: str
) -> None:
    case = {**without(CASE, "omega" if field == "f" else field), field: NO_NUMBERS[bad]}
    for request in ({}, {"gradient": True}, {"illegal": "raise"}):
        with refused(f"{field}[*]"):
            table.evaluate(**case, **request)
    with pytest.raises(InputError):
        table.evaluate(case)


#: zero, the ends of double range, seams, and what is illegal
EXTREMES = [
    *(0.0, -0.0, 5e-324, 1e-310, 1e-200, 1e-150, 1e-100, 1e-15),
    *(0.75, 1.0, 1.5, 3.0, 32.0, 2.0**17),
    *(1e100, 1e150, 1e200, 1.7976931348623157e308, math.inf),
    *(-math.inf, math.nan, -1.0, -1e300, -5e-324),
]


@pytest.mark.parametrize("method", PLANE)
def test_any_bits_have_an_answer_if_they_are_legal_alone_as_in_an_array(
    table: Surrogate, method: str
) -> None:
    rng, pairs = np.random.default_rng(0), np.array(list(itertools.product(EXTREMES, EXTREMES)))
    bits = rng.integers(0, 2**64, 200_000, dtype=np.uint64).view(np.float64).reshape(-1, 2)
    v, y = np.concatenate([pairs, bits]).T
    result = parts(PLANE[method](table, v, y))
    value = result[0]
    legal = (v >= 0.0) & (y >= 0.0)
    assert np.isnan(value[~legal]).all()
    assert not np.isnan(value[legal & np.isfinite(y)]).any()
    for i, pair in enumerate(pairs.tolist()):
        try:
            alone = parts(PLANE[method](table, *pair))
        except InputError:
            assert math.isnan(value[i]), pair
        else:
            np.testing.assert_array_equal(
                alone, [column[i] for column in result], err_msg=str(pair)
            )
    np.testing.assert_array_equal(np.isnan(table.v_tilde_crit(y)), ~(y >= 0.0))


def test_six_inputs_of_any_bits_are_answered_alone_as_in_an_array(table: Surrogate) -> None:
    rng = np.random.default_rng(0)
    six = rng.integers(0, 2**64, (6, 2000), dtype=np.uint64).view(np.float64)
    six[:, :1000] = rng.choice(EXTREMES, (6, 1000))
    six[:, ::3] = np.abs(six[:, ::3])
    answer = table.evaluate(dict(zip(CASE, six, strict=True)), gradient=True)
    legal = answer.source_code >= 0
    assert legal.any()
    assert not legal.all()
    assert np.array_equal(np.isnan(answer.mu_macro), ~legal)
    assert np.all(answer.error_bound[legal] >= 0.0)
    for i, case in enumerate(six.T.tolist()):
        assert table.tabulated.one(case).source == answer.source_code[i]
        try:
            one = table.evaluate(dict(zip(CASE, case, strict=True)), gradient=True)
        except InputError:
            assert not legal[i]
            continue
        assert (one.mu_macro, one.error_bound) == (answer.mu_macro[i], answer.error_bound[i])
        np.testing.assert_array_equal(
            [*one.gradient.values()], [column[i] for column in answer.gradient.values()]
        )
