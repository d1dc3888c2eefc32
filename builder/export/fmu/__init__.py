"""Functional Mock-up Units of a table."""
