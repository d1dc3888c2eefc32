"""UM-Bridge 1.0: two models, reading of requests, answers and errors.  Routes are in :mod:`service.routes.umbridge`.

Rules of the protocol that are easily missed:

- An error is ``{"error": {"type", "message"}}`` with 400 or 500 and nothing else; a reply has no keys beyond its own.
- The model's name is checked first.
- ``config`` may be missing, null, or an empty list (that is how R writes an empty one).  These models have no options.
- Clients that unbox vectors of one element send a scalar ``sens``.  A scalar ``vec`` is used for every component.
- An answer is never NaN or infinite: JSON has no such numbers, and clients would read them as friction.

``mu_macro_log10`` takes the decimal logarithms of the inputs: one client rounds inputs to four decimals, which would
make an amplitude of a micrometre zero.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from mumacro import InputError, Surrogate

from .errors import safe_value
from .kernel import FIELDS

__all__ = ["INFO", "MODELS", "OPERATIONS", "UmBridgeError", "model_of"]

PROTOCOL_VERSION = 1.0
MODELS = ("mu_macro", "mu_macro_log10")
INFO: dict[str, Any] = {"protocolVersion": PROTOCOL_VERSION, "models": list(MODELS)}

_SUPPORT = {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}
_STATUS = {"ModelNotFound": 400, "UnsupportedFeature": 400, "InvalidInput": 400, "InvalidOutput": 500}
_N = len(FIELDS)
_LN10 = math.log(10.0)

Reply = dict[str, Any]


class UmBridgeError(Exception):
    """A request that has no answer; ``kind`` is the protocol's name of the error."""

    def __init__(self, kind: str, message: str) -> None:
        self.kind = kind
        self.message = message
        super().__init__(f"{kind}: {message}")

    @property
    def status(self) -> int:
        """The HTTP status that goes with the type."""
        return _STATUS[self.kind]

    def as_json(self) -> Reply:
        """The reply."""
        return {"error": {"type": self.kind, "message": self.message}}


def _invalid(message: str) -> UmBridgeError:
    return UmBridgeError("InvalidInput", message)


# --- reading a request --------------------------------------------------------------------------------


def model_of(body: Any) -> str:
    """The model's name.

    Raises
    ------
    UmBridgeError
        InvalidInput: the body is not an object.  ModelNotFound: no such model.
    """
    if not isinstance(body, dict):
        raise _invalid("the body must be a JSON object")
    name = body.get("name")
    if not isinstance(name, str) or name not in MODELS:
        raise UmBridgeError("ModelNotFound", f"Model {safe_value(name)} not found! Available: {', '.join(MODELS)}.")
    return name


def _numbers(value: Any, name: str, size: int, scalar: bool = False) -> list[float]:
    """``value`` as ``size`` finite numbers; with ``scalar``, one number may replace the list."""
    if scalar and not isinstance(value, list):
        value = [value] * size
    if not isinstance(value, list):
        raise _invalid(f"{name} must be a list of {size} numbers")
    if len(value) != size:
        raise _invalid(f"{name} has invalid length! Expected {size} but got {len(value)}.")
    out = []
    for i, entry in enumerate(value):
        if type(entry) not in (int, float):
            raise _invalid(f"{name}[{i}] must be a number")
        try:
            number = float(entry)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise _invalid(f"{name}[{i}] must be finite")
        out.append(number)
    return out


def _index(body: Mapping[str, Any], name: str) -> None:
    """Check an index of an input or output vector: there is one of each, so it must be 0."""
    value = body.get(name)
    if type(value) not in (int, float) or value != 0:
        raise _invalid(f"Invalid {name} index! Expected 0, got {safe_value(value)}.")


def _case(model: str, body: Mapping[str, Any]) -> list[float]:
    """The six inputs in SI units."""
    vectors = body.get("input")
    if not isinstance(vectors, list) or len(vectors) != 1:
        raise _invalid(f"input must be a list of one vector: [[{', '.join(FIELDS)}]]")
    values = _numbers(vectors[0], "input[0]", _N)
    if model == "mu_macro":
        return values
    # 10.0**x overflows as an exception from 308.26 on; too small an exponent gives 0, which the model refuses.
    if any(value > 308.25 for value in values):
        raise _invalid("input[0] holds a logarithm beyond 308.25, the end of double precision")
    return [10.0**value for value in values]


# --- answering ----------------------------------------------------------------------------------------


def _evaluate(surrogate: Surrogate, values: list[float], gradient: bool) -> Any:
    try:
        case: dict[str, Any] = dict(zip(FIELDS, values, strict=True))
        return surrogate.evaluate(case, gradient=gradient)
    except InputError as error:
        raise _invalid(str(error)) from None


def _finite(values: list[float], what: str) -> list[float]:
    if not all(math.isfinite(value) for value in values):
        raise UmBridgeError("InvalidOutput", f"{what} is not finite here")
    return values


def _slopes(surrogate: Surrogate, model: str, values: list[float]) -> list[float]:
    """d mu_macro / d input, of the model's own inputs."""
    gradient = _evaluate(surrogate, values, gradient=True).gradient
    slopes = [float(gradient[name]) for name in FIELDS]
    if model == "mu_macro_log10":
        slopes = [slope * value * _LN10 for slope, value in zip(slopes, values, strict=True)]
    return _finite(slopes, "the gradient")


def model_info(_surrogate: Surrogate, _model: str, _body: Mapping[str, Any]) -> Reply:
    """The features of a model."""
    return {"support": dict(_SUPPORT)}


def input_sizes(_surrogate: Surrogate, _model: str, _body: Mapping[str, Any]) -> Reply:
    """One vector of six inputs."""
    return {"inputSizes": [_N]}


def output_sizes(_surrogate: Surrogate, _model: str, _body: Mapping[str, Any]) -> Reply:
    """One vector of one output."""
    return {"outputSizes": [1]}


def evaluate(surrogate: Surrogate, model: str, body: Mapping[str, Any]) -> Reply:
    """mu_macro."""
    answer = _evaluate(surrogate, _case(model, body), gradient=False)
    return {"output": [_finite([float(answer.mu_macro)], "mu_macro")]}


def gradient(surrogate: Surrogate, model: str, body: Mapping[str, Any]) -> Reply:
    """``sens`` times the Jacobian."""
    _index(body, "outWrt")
    _index(body, "inWrt")
    values = _case(model, body)
    (sens,) = _numbers(body.get("sens"), "sens", 1, scalar=True)
    return {"output": _finite([sens * slope for slope in _slopes(surrogate, model, values)], "the gradient")}


def apply_jacobian(surrogate: Surrogate, model: str, body: Mapping[str, Any]) -> Reply:
    """The Jacobian times ``vec``."""
    _index(body, "outWrt")
    _index(body, "inWrt")
    values = _case(model, body)
    vec = _numbers(body.get("vec"), "vec", _N, scalar=True)
    product = math.fsum(a * b for a, b in zip(_slopes(surrogate, model, values), vec, strict=True))
    return {"output": _finite([product], "the action of the Jacobian")}


def apply_hessian(_surrogate: Surrogate, _model: str, _body: Mapping[str, Any]) -> Reply:
    """Not offered."""
    raise UmBridgeError("UnsupportedFeature", "ApplyHessian not supported by model!")


#: POST endpoint -> what answers it
OPERATIONS: dict[str, Callable[[Surrogate, str, Mapping[str, Any]], Reply]] = {
    "ModelInfo": model_info,
    "InputSizes": input_sizes,
    "OutputSizes": output_sizes,
    "Evaluate": evaluate,
    "Gradient": gradient,
    "ApplyJacobian": apply_jacobian,
    "ApplyHessian": apply_hessian,
}
