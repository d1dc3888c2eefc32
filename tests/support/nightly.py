"""The longer forms of tests: ``python3 dev.py test --nightly`` runs them, and a release does.

A test that would take long has a smaller form, which every run has, beside the whole one: the same
function with other numbers.  tests/project/test_nightly.py lists them all.
"""

from typing import Any

import pytest

#: file and function of the tests that this run has found, of ordinary and of nightly ones
COLLECTED = pytest.StashKey[dict[bool, set[tuple[str, str]]]]()


def nightly(*values: Any) -> Any:
    """Return a set of parameters that only the nightly run has."""
    return pytest.param(*values, marks=pytest.mark.nightly)
