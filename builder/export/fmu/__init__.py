"""Export a table as Functional Mock-up Units."""
