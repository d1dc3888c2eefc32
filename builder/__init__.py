"""Solve the full model, lay the blocks, write and verify the table: the offline part of the
project."""

import mumacro as _mumacro  # noqa: F401 (it reports in one line what to install)
