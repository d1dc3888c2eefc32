"""Make a verified table from solved points."""
