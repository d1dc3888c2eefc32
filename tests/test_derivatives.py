"""Derivatives inside JAX and PyTorch: each library's own checker, limits and illegal cases."""

import importlib
import math
import sys
import warnings
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mumacro import SOURCES, InputError, MumacroError, Surrogate
from mumacro.inputs import FIELDS
from tests.cases import CASE
from tests.comparing import close

QUANTITIES = ("mu_ratio", "power", "stick_fraction")
# stick-slip, continuous sliding, creep below y~ = 1, large amplitude
POINTS = np.array([[0.1, 0.5], [2.0, 1.0], [1e-3, 0.7], [0.3, 30.0]])


def loaded(name: str) -> ModuleType:
    """The library, or a skip; warnings during its import are ignored."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pytest.importorskip(name)
        return importlib.import_module(name)


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(1e-10, threads=1)


def partials(table: Surrogate, name: str, v: Any, y: Any) -> Any:
    """d/dv~ and d/dy~ of a quantity, (2, n)."""
    return np.array(table.derivatives(np.asarray(v), np.asarray(y), name))


def bends(table: Surrogate, name: str, v: Any, y: Any) -> Any:
    """d2/dv~2, d2/dv~ dy~, d2/dy~2 of a quantity, (3, n)."""
    return np.array(table.derivatives(np.asarray(v), np.asarray(y), name, 2))


# --- first and second derivatives of the table, for all libraries --------------------------------------


@pytest.mark.parametrize("name", QUANTITIES)
def test_slopes_are_those_of_the_surrogate(table: Surrogate, name: str) -> None:
    v, y = POINTS.T
    _, along_v, along_y = table.slopes(v, y, name)
    np.testing.assert_allclose(partials(table, name, v, y), [along_v / v, along_y / y], rtol=1e-15)


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize(("tolerance", "most"), [(1e-12, 2e-4), (1e-10, 2e-4), (1e-7, 3e-2)])
def test_second_derivatives_are_those_of_the_finest_table(name: str, tolerance: float, most: float) -> None:
    """Everywhere, also beside the border and in the corner; against differences with another step and order."""
    rng = np.random.default_rng(3)
    fine = Surrogate.open(1e-12)
    v, y = 10.0 ** rng.uniform((-4.0, -3.0), (3.0, 3.0), (3000, 2)).T
    y[:500] = 1.0 + rng.normal(size=500) * v[:500] ** (2.0 / 3.0)
    v[500:1000] = fine.v_tilde_crit(y[500:1000]) * (1.0 + 0.02 * rng.normal(size=500))
    y = np.abs(y)
    border = np.log(v / fine.v_tilde_crit(y))
    if name == "stick_fraction":  # a root of the distance to the border, where it has no second derivative
        v, y = v[border < -0.1], y[border < -0.1]
    scale = np.minimum(1.0, np.abs(y - 1.0) + np.cbrt(v * v))
    first = partials(fine, name, v, y)
    found = bends(Surrogate.open(tolerance), name, v, y)
    found[0], found[1], found[2] = found[0] * v * v + first[0] * v, found[1] * v * y, found[2] * y * y + first[1] * y
    below = v < fine.v_tilde_crit(y)

    def along(in_v: float, in_y: Any, of: int) -> Any:
        """A derivative of the logarithmic slopes by seven points; NaN where these lie on both sides of the border."""
        total = np.zeros(v.size)
        for step, weight in zip(range(-3, 4), (-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60), strict=True):
            at = v * np.exp(step * in_v), y * np.exp(step * in_y)
            total += weight * fine.slopes(*at, name)[of]
            total[(at[0] < fine.v_tilde_crit(at[1])) != below] = np.nan
        return total / (in_v + in_y)

    truth = np.array([along(4e-3, 0.0, 1), along(4e-3, 0.0, 2), along(0.0, 4e-3 * scale, 2)])
    largest = np.abs(truth).max(axis=0) + 1e-9 * np.abs(first * (v, y)).max(axis=0) + 1e-12
    clear = ~np.isnan(truth).any(axis=0)
    assert clear.mean() > 0.8
    assert np.all(np.isfinite(found))
    assert np.abs((found - truth) / largest)[:, clear].max() < most


def test_a_quantity_or_an_order_that_is_not_there_is_refused(table: Surrogate) -> None:
    with pytest.raises(InputError, match="of must be one of mu_ratio"):
        table.derivatives(0.1, 0.5, "heat")
    with pytest.raises(InputError, match="order must be 1 or 2"):
        table.derivatives(0.1, 0.5, order=3)


def test_second_derivatives_at_the_ends(table: Surrogate) -> None:
    """Even in y~; NaN at rest, where mu~ has a root or a corner, and for what is no point."""
    v = np.array([0.3, 1.0, 5.0])
    found = bends(table, "mu_ratio", v, np.zeros(3))
    np.testing.assert_array_equal(found[:2], 0.0)
    np.testing.assert_allclose(found[2], -0.5 / (1.0 + v * v), rtol=1e-6)  # eq. (31)
    for point in ((0.0, 0.5), (-1.0, 0.5), (1.0, -0.5), (math.inf, 1.0), (1.0, math.inf), (math.nan, 1.0)):
        assert np.isnan(bends(table, "mu_ratio", [point[0]], [point[1]])).all()


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("y", [0.3, 0.9, 1.2, 5.0])
def test_slopes_at_rest_are_the_limit_of_those_beside_it(table: Surrogate, name: str, y: float) -> None:
    speeds = np.array([0.0, 1e-7, 1e-6])
    order = math.sqrt(10.0) if y < 1.0 else 10.0  # the next term grows with sqrt(speed) or with the speed
    by_speed, by_amplitude = partials(table, name, speeds, np.full(3, y))
    if name == "stick_fraction" and y < 1.0:
        assert by_speed[0] == -math.inf
        assert by_speed[1] == close(order * by_speed[2], rel=0.01)
    else:
        assert by_speed[0] == close((order * by_speed[1] - by_speed[2]) / (order - 1.0), rel=1e-4, abs=1e-5)
    limit = (order * by_amplitude[1] - by_amplitude[2]) / (order - 1.0)
    assert by_amplitude[0] == close(limit, rel=1e-4, abs=1e-5)


def test_slopes_where_nothing_oscillates_are_zero_and_illegal_ones_are_nan(table: Surrogate) -> None:
    v, y = np.array([0.0, 1.0, -1.0, 1.0, math.nan]), np.array([0.0, 0.0, 1.0, -1.0, 1.0])
    for name in QUANTITIES:
        slopes = partials(table, name, v, y)
        np.testing.assert_array_equal(slopes[:, :2], 0.0)
        assert np.isnan(slopes[:, 2:]).all()
    assert partials(table, "mu_ratio", [0.0], [1.0])[0, 0] == math.inf


def test_a_missing_package_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("jax", "torch"):
        with monkeypatch.context() as patched:
            patched.setitem(sys.modules, name, None)
            patched.delitem(sys.modules, f"mumacro.{name}", raising=False)
            with pytest.raises(ModuleNotFoundError) as caught:
                importlib.import_module(f"mumacro.{name}")
        assert str(caught.value).startswith(f"{name} is not installed: pip install 'mumacro[{name}]'")


# --- JAX ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def jax() -> ModuleType:
    module = loaded("jax")
    module.config.update("jax_enable_x64", True)
    return module


@pytest.fixture(scope="module")
def in_jax(jax: ModuleType, table: Surrogate) -> Any:  # noqa: ARG001 (a skip where it is not installed)
    from mumacro.jax import Friction

    return Friction(table)


@pytest.mark.parametrize("name", QUANTITIES)
def test_jax_checks_the_gradients(jax: ModuleType, in_jax: Any, name: str) -> None:
    from jax.test_util import check_grads

    v, y = map(jax.numpy.asarray, POINTS.T)
    for i in range(len(POINTS)):  # steps relative to the speed, which spans decades
        speed, amplitude = v[i], y[i]
        check_grads(
            lambda a, b, v=speed, y=amplitude: getattr(in_jax, name)(v * a, y * b), (1.0, 1.0), order=2,
            modes=("fwd", "rev"), atol=1e-5, rtol=1e-5, eps=1e-5,
        )  # fmt: skip


@pytest.mark.slow
def test_jax_checks_the_gradient_by_the_six_inputs(jax: ModuleType, in_jax: Any) -> None:
    from jax.test_util import check_grads

    given = jax.numpy.array([CASE[name] for name in FIELDS])
    check_grads(lambda x: in_jax.mu_macro(*(x * given)), (jax.numpy.ones(6),), order=2, atol=1e-5, rtol=1e-5, eps=1e-5)
    slopes = jax.jit(jax.jacfwd(lambda x: in_jax.mu_macro(*x)))(given)
    expected = Surrogate.open(1e-10).evaluate(CASE, gradient=True).gradient
    assert expected is not None
    np.testing.assert_allclose(slopes, [expected[name] for name in FIELDS], rtol=1e-14)


def test_jax_transformations_compose(jax: ModuleType, in_jax: Any, table: Surrogate) -> None:
    jnp = jax.numpy
    v, y = jnp.array([0.1, 0.2, 3.0]), jnp.array([0.5, 2.0])
    plane = jax.jit(jax.vmap(jax.vmap(in_jax.mu_ratio, in_axes=(None, 0)), in_axes=(0, None)))(v, y)
    np.testing.assert_array_equal(plane, table.mu_ratio(np.asarray(v)[:, None], np.asarray(y)))
    np.testing.assert_array_equal(jax.vmap(in_jax.mu_ratio, in_axes=(0, None))(v, y), plane)
    assert plane.dtype == jnp.float64

    def settled(start: Any) -> Any:
        return jax.lax.scan(lambda c, _: (0.9 * c + 0.1 * in_jax.mu_ratio(c, 0.5), c), start, None, length=5)[0]

    step = 1e-5
    difference = (settled(0.1 + step) - settled(0.1 - step)) / (2.0 * step)
    assert jax.grad(settled)(0.1) == close(float(difference), rel=1e-7)
    for slopes in (jax.vmap(jax.grad(in_jax.power))(v[:2], y), jax.grad(lambda a: in_jax.power(a, y).sum())(v[:2])):
        np.testing.assert_array_equal(slopes, partials(table, "power", v[:2], y)[0])


def test_jax_in_single_precision_is_refused(jax: ModuleType, in_jax: Any) -> None:
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(MumacroError, match="jax_enable_x64"):
            in_jax.mu_ratio(0.1, 0.5)
    finally:
        jax.config.update("jax_enable_x64", True)


@pytest.mark.parametrize(
    ("attributes", "arguments", "message"),
    [({"table": 5}, 2, "this table is not open here"), ({"order": 3}, 2, "not a call that mumacro.jax makes"),
     ({"order": 2}, 6, "not a call that mumacro.jax makes"),
     ({"quantity": 99}, 2, "not a call that mumacro.jax makes"), ({}, 3, "not a call that mumacro.jax makes")],
)  # fmt: skip
def test_a_jax_program_that_the_kernel_cannot_run_is_an_error_and_no_crash(
    jax: ModuleType, in_jax: Any, table: Surrogate, attributes: dict[str, int], arguments: int, message: str
) -> None:
    assert float(in_jax.mu_ratio(0.1, 0.5)) == table.mu_ratio(0.1, 0.5)
    made = {"table": int(table.checksum[:15], 16), "order": 0, "quantity": 0, **attributes}
    call = jax.ffi.ffi_call("mumacro", [jax.ShapeDtypeStruct((), jax.numpy.float64)])
    with pytest.raises(jax.errors.JaxRuntimeError, match=message):
        call(*[jax.numpy.float64(0.1)] * arguments, **{name: np.int64(x) for name, x in made.items()})


# --- PyTorch --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def torch() -> ModuleType:
    return loaded("torch")


@pytest.fixture(scope="module")
def in_torch(torch: ModuleType, table: Surrogate) -> Any:  # noqa: ARG001 (a skip where it is not installed)
    from mumacro.torch import Friction

    return Friction(table)


def leaves(torch: ModuleType, *values: Any) -> Any:
    return tuple(torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in values)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", QUANTITIES)
def test_torch_checks_the_gradients(torch: ModuleType, in_torch: Any, name: str) -> None:
    v, y = (torch.tensor(column) for column in POINTS.T.copy())
    assert torch.autograd.gradcheck(
        lambda a, b: getattr(in_torch, name)(v * a, y * b), leaves(torch, np.ones(4), np.ones(4)), eps=1e-5, atol=1e-7,
        rtol=1e-6, check_batched_grad=True,
    )  # fmt: skip
    assert torch.autograd.gradgradcheck(
        lambda a, b: getattr(in_torch, name)(v * a, y * b), leaves(torch, np.ones(4), np.ones(4)), eps=1e-5, atol=1e-5,
        rtol=1e-5,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore")
def test_torch_checks_the_gradient_by_the_six_inputs(torch: ModuleType, in_torch: Any) -> None:
    given = torch.tensor([CASE[name] for name in FIELDS], dtype=torch.float64)
    (ones,) = leaves(torch, np.ones(6))
    for check, tolerance in ((torch.autograd.gradcheck, 1e-6), (torch.autograd.gradgradcheck, 1e-5)):
        assert check(lambda x: in_torch.mu_macro(*(x * given)), (ones,), eps=1e-5, atol=1e-6, rtol=tolerance)


@pytest.mark.filterwarnings("ignore")
def test_torch_transformations_compose(torch: ModuleType, in_torch: Any, table: Surrogate) -> None:
    from torch.func import grad, hessian, jacrev, jvp, vmap

    v, y = torch.tensor([0.1, 0.2, 3.0], dtype=torch.float64), torch.tensor([0.5, 2.0], dtype=torch.float64)
    plane = vmap(vmap(in_torch.mu_ratio, in_dims=(None, 0)), in_dims=(0, None))(v, y)
    np.testing.assert_array_equal(plane.numpy(), table.mu_ratio(v.numpy()[:, None], y.numpy()))
    np.testing.assert_array_equal(in_torch.mu_ratio(v[:, None], y).numpy(), plane.numpy())
    speeds = v[:2].clone().requires_grad_()
    expected = partials(table, "power", v[:2], y)[0]
    ways = {
        "autograd": torch.autograd.grad(in_torch.power(speeds, y).sum(), speeds)[0],
        "grad": grad(lambda a: in_torch.power(a, y).sum())(v[:2]),
        "vmap of grad": vmap(grad(in_torch.power))(v[:2], y),
        "grad of vmap": grad(lambda a: vmap(in_torch.power)(a, y).sum())(v[:2]),
        "jacrev": jacrev(in_torch.power)(v[:2], y).diagonal(),
        "compiled": torch.compile(grad(lambda a: in_torch.power(a, y).sum()), backend="aot_eager")(v[:2]),
    }
    for way, slopes in ways.items():
        np.testing.assert_array_equal(slopes.numpy(), expected, err_msg=way)
    batch = torch.autograd.grad(
        in_torch.power(speeds, y), speeds, torch.eye(2, dtype=torch.float64), is_grads_batched=True
    )
    np.testing.assert_array_equal(batch[0].numpy(), np.diag(expected))
    bend = grad(grad(in_torch.power))(v[0], y[0])
    assert bend.item() == bends(table, "power", v[:1], y[:1])[0, 0]
    for forwards in (lambda at: jvp(lambda a: in_torch.power(a, y[0]), (at,), (torch.ones_like(at),)),
                     hessian(lambda a: in_torch.power(a, y[0]))):  # fmt: skip
        with pytest.raises(NotImplementedError, match="jvp"):  # no zero slope
            forwards(v[0])
    single = torch.tensor([0.1, 0.5], requires_grad=True)  # single precision
    ratio = in_torch.mu_ratio(single, 2.0)
    assert ratio.dtype == torch.float64
    ratio.sum().backward()
    assert single.grad.dtype == torch.float32


@pytest.mark.filterwarnings("ignore")
def test_torch_compiles_the_whole_program_with_its_derivatives(torch: ModuleType, in_torch: Any) -> None:
    six = [torch.tensor(CASE[name], dtype=torch.float64) for name in FIELDS]
    expected = Surrogate.open(1e-10).evaluate(CASE, gradient=True)
    assert expected.gradient is not None
    compiled = torch.compile(lambda *x: in_torch.mu_macro(*x).square(), fullgraph=True, backend="aot_eager")
    given = [x.clone().requires_grad_() for x in six]
    found = compiled(*given)
    found.backward()
    assert found.item() == expected.mu_macro**2
    slopes = [2.0 * expected.mu_macro * expected.gradient[name] for name in FIELDS]
    np.testing.assert_allclose([x.grad.item() for x in given], slopes, rtol=1e-14)


# --- both -----------------------------------------------------------------------------------------------


@dataclass
class Inside:
    """Friction in a library, and what this calls arrays, derivatives and compiling."""

    friction: Any
    array: Any
    grad: Any
    compiled: Any


@pytest.fixture(params=["jax", "torch"])
def inside(request: pytest.FixtureRequest) -> Inside:
    library = request.getfixturevalue(request.param)
    friction = request.getfixturevalue(f"in_{request.param}")
    if request.param == "jax":
        return Inside(friction, library.numpy.asarray, library.grad, library.jit)
    array, compiled = partial(library.tensor, dtype=library.float64), partial(library.compile, backend="aot_eager")
    return Inside(friction, array, library.func.grad, compiled)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("v0", [0.01, -1.0, math.nan])
def test_illegal_cases_are_nan_also_when_compiled_and_rigid_contact_is_none(inside: Inside, v0: float) -> None:
    def mu_macro(v: Any) -> Any:
        return inside.friction.mu_macro(**{**CASE, "k": None, "v0": v})

    expected = Surrogate.open(1e-10).evaluate({**CASE, "k": math.inf, "v0": np.array([v0])}, gradient=True)
    assert expected.gradient is not None
    at = inside.array(v0)
    for way in (lambda function: function, inside.compiled):
        found = [float(way(mu_macro)(at)), float(way(inside.grad(mu_macro))(at))]
        np.testing.assert_array_equal(found, [expected.mu_macro[0], expected.gradient["v0"][0]])
    assert expected.source_code.tolist() == [SOURCES.index("rigid") if v0 == 0.01 else -1]


@pytest.mark.filterwarnings("ignore")
def test_edges_of_derivatives_and_arguments(inside: Inside) -> None:
    ratio, array, grad = inside.friction.mu_ratio, inside.array, inside.grad
    # an infinite slope along the speed does not spoil that along the amplitude
    assert [float(grad(ratio, argnums=i)(array(0.0), array(1.0))) for i in (0, 1)] == [math.inf, 0.0]
    with pytest.raises(NotImplementedError, match="third derivatives are not tabulated"):
        grad(grad(grad(lambda v: ratio(v, 0.5))))(array(0.1))
    with pytest.raises((ValueError, RuntimeError), match=r"shapes|size"):
        ratio(array([1.0, 2.0]), array([1.0, 2.0, 3.0]))
    for wrong in ("fast", None, [array(1.0), "x"]):
        with pytest.raises((TypeError, ValueError)):
            ratio(wrong, array(0.5))
