"""Published measured friction: what docs/measured.md says of it is what the scripts print."""

import re
from pathlib import Path

import numpy as np
import pytest

from mumacro import Surrogate, closed_forms
from tests.support.comparing import close, title_of
from tests.support.scripts import script

pytest.importorskip("scipy")
pyplot = pytest.importorskip("matplotlib.pyplot")
friction_models, measured, validation = (
    script(f"benchmarks.{name}") for name in ("friction_models", "measured", "validation")
)


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Each section's text, without a picture in docs."""
    with pytest.MonkeyPatch.context() as patch:
        images = tmp_path_factory.mktemp("img")
        patch.setattr(measured, "IMAGES", images)
        result = {name: section() for name, section in measured.SECTIONS.items()}
        assert (images / "measured.png").read_bytes().startswith(b"\x89PNG")
    return {**result, "normal": validation.normal_oscillation()}


def test_every_row_of_the_scripts_stands_on_the_page(
    repository: Path, printed: dict[str, str]
) -> None:
    docs = repository / "docs"
    pages = (docs / name for name in ("measured.md", "validation.md"))
    page = [line for page in pages for line in page.read_text("utf-8").splitlines()]
    rows = [line for text in printed.values() for line in text.splitlines() if line[:1] == "|"]
    assert len(rows) > 20
    assert [row for row in rows if row not in page] == []


def test_the_sentences_have_the_figures_of_the_scripts(
    repository: Path, printed: dict[str, str]
) -> None:
    page = (repository / "docs" / "measured.md").read_text("utf-8")
    matches = re.findall(r"\d+\.\d+ to \d+\.\d+ N|k = [^:]*: \d+ % and \d+ %", printed["trends"])
    assert len(matches) == 2
    assert [text for text in matches if text not in page] == []
    assert "k has only an upper bound" in printed["trends"]
    oiled = re.search("The k that fits best is .*", printed["oiled"])
    assert oiled is not None
    assert oiled[0] in page


def test_friction_elements_on_their_page_are_those_of_the_script(repository: Path) -> None:
    page = (repository / "docs" / "how-to" / "friction-models.md").read_text("utf-8")
    assert friction_models.elements() in page
    # sliding all the time, or slipping far, all elements are alike
    for v_tilde, y_tilde in ((1.0, 0.3), (0.3, 30.0)):
        mu = friction_models.table().evaluate(
            mu0=1.0, Fz=1.0, k=1.0, omega=1.0, y0=y_tilde, v0=v_tilde, direction="along"
        )
        assert friction_models.dahl(v_tilde, y_tilde) == close(mu.mu_macro, abs=2e-3)


def test_no_single_stiffness_describes_the_oiled_contact() -> None:
    p = measured.points("oil")
    for contact in ("spring", "ball"):
        k = measured.fitted(contact, surface="oil").values["k"]
        model = measured.force(contact, k, p.without / measured.FZ, p.v0)
        assert np.abs(model - p.shaken).max() > 0.9
        alone = measured.each_alone(contact, "oil")
        assert alone.max() > 10.0 * alone.min()


def test_one_stiffness_serves_five_speeds_where_rigid_contact_is_far_off() -> None:
    p = measured.points()
    assert p.v0.size == 5
    for contact, off in (("spring", 0.06), ("ball", 0.05)):
        k = measured.fitted(contact).values["k"]
        model = measured.force(contact, k, p.without / measured.FZ, p.v0)
        assert np.abs(model - p.shaken).max() < off
    rigid = measured.force("spring", "rigid", p.without / measured.FZ, p.v0)
    factors = p.shaken / rigid
    assert factors.min() == close(9.3, abs=0.05)
    assert factors.max() == close(276.3, abs=0.05)
    # with one mu0 the model's friction rises with speed, the measured one falls
    mean = np.full(5, p.without.mean() / measured.FZ)
    one = measured.force("spring", measured.fitted("spring", mean).values["k"], mean, p.v0)
    assert (np.diff(one) > 0.0).all()
    assert (np.diff(p.shaken) < 0.0).all()


def test_the_stiffness_does_not_depend_on_the_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    k = measured.fitted("ball").values["k"]
    monkeypatch.setattr(measured, "FZ", 20.0)
    monkeypatch.setattr(measured, "RIG", {**measured.RIG, "Fz": 20.0})
    assert measured.fitted("ball").values["k"] == close(k, rel=1e-6)


@pytest.mark.parametrize("alpha", [0.01, 0.3, 0.99])
def test_the_normal_force_obeys_the_published_form(surrogate: Surrogate, alpha: float) -> None:
    # M. Popov 2020, (33) to (38): one function of beta, of which the fit is too high by 0.0144
    beta = 2.0 * np.pi * np.linspace(0.0, 1.5, 301)
    mu0, force, k, f = 0.4, 7.0, 3e6, 17e3
    v0 = beta * mu0 * alpha * force * f / k
    mu = surrogate.evaluate(
        mu0=mu0, Fz=force, k=k, Fz_amplitude=alpha * force, f=f, v0=v0, direction="normal"
    ).mu_macro
    psi = (1.0 - mu / mu0) / alpha
    b = np.minimum(beta / (2.0 * np.pi), 1.0)
    assert psi == close(1.0 - closed_forms.master_curve_limit(b), abs=1e-12)
    off = 0.75 * (1.0 - b) ** 2 + 0.25 * (1.0 - b) ** 4 - psi
    assert off.min() > -1e-12
    assert off.max() == close(0.01436, abs=1e-4)


def test_the_plot_of_points_with_their_own_mu0_is_one_smooth_curve_through_the_fit() -> None:
    result = measured.fitted("ball")
    axes = result.plot()
    assert title_of(axes).endswith(" N/m; ball, along")
    x, y = axes.get_lines()[-1].get_data()
    at_points = np.isin(x, measured.points().v0)
    assert y[at_points] == close(result.predict()[0], rel=1e-12)
    # no kink at a point: between two places the curve bends as little there as elsewhere
    bends = np.abs(np.diff(np.diff(y) / np.diff(np.log(x))))
    assert bends.max() < 0.2 * np.ptp(np.diff(y) / np.diff(np.log(x)))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "fit",
        "95 % band of the fit",
        "measured",
    ]
    pyplot.close("all")
