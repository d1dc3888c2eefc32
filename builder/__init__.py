"""Offline half: solves the full model, lays the blocks, writes and verifies the table."""

import mumacro as _mumacro  # noqa: F401 (it reports in one line what to install)
