"""From solved points to a verified table."""
