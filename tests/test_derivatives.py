"""Derivatives inside JAX and PyTorch: each library's own checker, limits and illegal cases."""

import importlib
import math
import sys
import warnings
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from comparing import close
from mumacro import MumacroError, Surrogate
from mumacro.inputs import FIELDS
from mumacro.interop.derivatives import quantities

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
QUANTITIES = ("mu_ratio", "power", "stick_fraction")
# stick-slip, continuous sliding, creep below y~ = 1, large amplitude
POINTS = np.array([[0.1, 0.5], [2.0, 1.0], [1e-3, 0.7], [0.3, 30.0]])


def loaded(name: str) -> ModuleType:
    """The library, or a skip; warnings during its import are ignored."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name)


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(1e-10, threads=1)


# --- slopes of the table, for all libraries ------------------------------------------------------------


def test_slopes_are_those_of_the_surrogate(table: Surrogate) -> None:
    v, y = POINTS.T
    for name in QUANTITIES:
        _, along_v, along_y = table.slopes(v, y, name)
        np.testing.assert_allclose(quantities(table)[name].slopes(v, y), [along_v / v, along_y / y], rtol=1e-15)
    gradient = table.evaluate({**CASE, "v0": np.array([0.01, 0.0])}, gradient=True).gradient
    assert gradient is not None
    six = [np.array([CASE[name], CASE[name] if name != "v0" else 0.0]) for name in FIELDS]
    np.testing.assert_array_equal(quantities(table)["mu_macro"].slopes(*six), [gradient[name] for name in FIELDS])


@pytest.mark.parametrize("shape", [(), (1,), (0,), (2, 2), (0, 3)])
def test_values_and_slopes_have_the_shape_of_their_arguments(table: Surrogate, shape: tuple[int, ...]) -> None:
    for name, quantity in quantities(table).items():
        point = [CASE[field] for field in FIELDS] if name == "mu_macro" else [0.1, 0.5]
        arrays = [np.full(shape, value) for value in point]
        found, slopes = quantity.value(*arrays), quantity.slopes(*arrays)
        assert found.shape == shape
        assert slopes.shape == (len(quantity.inputs), *shape)
        one = [np.array([value]) for value in point]
        np.testing.assert_array_equal(found, np.full(shape, quantity.value(*one)[0]))
        np.testing.assert_array_equal(np.moveaxis(slopes, 0, -1), np.full((*shape, 1), 1) * quantity.slopes(*one)[:, 0])
        assert np.isnan(quantity.value(*(np.full(shape, -1.0) for _ in point))).all()


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("y", [0.3, 0.9, 1.2, 5.0])
def test_slopes_at_rest_are_the_limit_of_those_beside_it(table: Surrogate, name: str, y: float) -> None:
    speeds = np.array([0.0, 1e-7, 1e-6])
    order = math.sqrt(10.0) if y < 1.0 else 10.0  # the next term grows with sqrt(speed) or with the speed
    by_speed, by_amplitude = quantities(table)[name].slopes(speeds, np.full(3, y))
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
        slopes = quantities(table)[name].slopes(v, y)
        np.testing.assert_array_equal(slopes[:, :2], 0.0)
        assert np.isnan(slopes[:, 2:]).all()
    assert quantities(table)["mu_ratio"].slopes(np.array([0.0]), np.array([1.0]))[0, 0] == math.inf


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
            lambda a, b, v=speed, y=amplitude: getattr(in_jax, name)(v * a, y * b), (1.0, 1.0), order=1,
            modes=("fwd", "rev"), atol=1e-7, rtol=1e-6, eps=1e-5,
        )  # fmt: skip


def test_jax_checks_the_gradient_by_the_six_inputs(jax: ModuleType, in_jax: Any) -> None:
    from jax.test_util import check_grads

    given = jax.numpy.array([CASE[name] for name in FIELDS])
    check_grads(lambda x: in_jax.mu_macro(*(x * given)), (jax.numpy.ones(6),), order=1, atol=1e-7, rtol=1e-6, eps=1e-5)
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
        np.testing.assert_array_equal(slopes, quantities(table)["power"].slopes(np.asarray(v[:2]), np.asarray(y))[0])


def test_jax_gets_nan_for_illegal_cases_and_rigid_contact_for_none(jax: ModuleType, in_jax: Any) -> None:
    v0 = jax.numpy.array([0.01, -1.0, math.nan])
    case = {**CASE, "k": None}
    found = jax.vmap(jax.value_and_grad(lambda v: in_jax.mu_macro(**{**case, "v0": v})))(v0)
    expected = Surrogate.open(1e-10).evaluate({**CASE, "k": math.inf}, gradient=True)
    assert expected.gradient is not None
    assert float(found[0][0]) == expected.mu_macro
    assert float(found[1][0]) == expected.gradient["v0"]
    assert np.isnan(np.asarray(found)[:, 1:]).all()
    # an infinite slope along the speed does not spoil that along the amplitude
    assert jax.grad(in_jax.mu_ratio, argnums=1)(0.0, 1.0) == 0.0
    assert jax.grad(in_jax.mu_ratio, argnums=0)(0.0, 1.0) == math.inf


def test_jax_raises_for_second_derivatives_and_float32(jax: ModuleType, in_jax: Any) -> None:
    with pytest.raises(NotImplementedError, match="second derivatives are not tabulated"):
        jax.hessian(lambda v: in_jax.mu_ratio(v, 0.5))(0.1)
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(MumacroError, match="jax_enable_x64"):
            in_jax.mu_ratio(0.1, 0.5)
    finally:
        jax.config.update("jax_enable_x64", True)


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
        rtol=1e-6, check_forward_ad=True, check_batched_grad=True, check_batched_forward_grad=True,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore")
def test_torch_checks_the_gradient_by_the_six_inputs(torch: ModuleType, in_torch: Any) -> None:
    given = torch.tensor([CASE[name] for name in FIELDS], dtype=torch.float64)
    (ones,) = leaves(torch, np.ones(6))
    assert torch.autograd.gradcheck(
        lambda x: in_torch.mu_macro(*(x * given)), (ones,), eps=1e-5, atol=1e-7, rtol=1e-6, check_forward_ad=True
    )
    expected = Surrogate.open(1e-10).evaluate(CASE, gradient=True).gradient
    assert expected is not None
    for jacobian in (torch.func.jacfwd, torch.func.jacrev):
        slopes = jacobian(lambda x: in_torch.mu_macro(*x))(given)
        np.testing.assert_allclose(slopes.numpy(), [expected[name] for name in FIELDS], rtol=1e-14)


@pytest.mark.filterwarnings("ignore")
def test_torch_transformations_compose(torch: ModuleType, in_torch: Any, table: Surrogate) -> None:
    from torch.func import grad, vmap

    v, y = torch.tensor([0.1, 0.2, 3.0], dtype=torch.float64), torch.tensor([0.5, 2.0], dtype=torch.float64)
    plane = vmap(vmap(in_torch.mu_ratio, in_dims=(None, 0)), in_dims=(0, None))(v, y)
    np.testing.assert_array_equal(plane.numpy(), table.mu_ratio(v.numpy()[:, None], y.numpy()))
    np.testing.assert_array_equal(in_torch.mu_ratio(v[:, None], y).numpy(), plane.numpy())
    slopes = vmap(grad(in_torch.power))(v[:2], y)
    np.testing.assert_array_equal(slopes.numpy(), quantities(table)["power"].slopes(v.numpy()[:2], y.numpy())[0])
    single = torch.tensor([0.1, 0.5], requires_grad=True)  # single precision
    ratio = in_torch.mu_ratio(single, 2.0)
    assert ratio.dtype == torch.float64
    ratio.sum().backward()
    assert single.grad.dtype == torch.float32


@pytest.mark.filterwarnings("ignore")
def test_torch_gets_nan_for_illegal_cases_and_rigid_contact_for_none(torch: ModuleType, in_torch: Any) -> None:
    (v0,) = leaves(torch, [0.01, -1.0, math.nan])
    found = in_torch.mu_macro(**{**CASE, "k": None, "v0": v0})
    found.sum().backward()
    expected = Surrogate.open(1e-10).evaluate({**CASE, "k": math.inf}, gradient=True)
    assert expected.gradient is not None
    assert found[0].item() == expected.mu_macro
    assert v0.grad[0].item() == expected.gradient["v0"]
    assert torch.isnan(found[1:]).all()
    assert torch.isnan(v0.grad[1:]).all()
    speed, amplitude = leaves(torch, 0.0, 1.0)
    in_torch.mu_ratio(speed, amplitude).backward()
    assert (speed.grad.item(), amplitude.grad.item()) == (math.inf, 0.0)


@pytest.mark.filterwarnings("ignore")
def test_torch_raises_for_what_is_not_supported(torch: ModuleType, in_torch: Any) -> None:
    (v,) = leaves(torch, 0.1)
    (slope,) = torch.autograd.grad(in_torch.mu_ratio(v, 0.5), v, create_graph=True)
    with pytest.raises(NotImplementedError, match="second derivatives are not tabulated"):
        torch.autograd.grad(slope, v)
    with pytest.raises(NotImplementedError, match="second derivatives are not tabulated"):
        torch.func.hessian(lambda a: in_torch.mu_ratio(a, 0.5))(v.detach())
