"""Thin endpoints: read the request, ask, write the answer."""
