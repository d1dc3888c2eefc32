"""Questions to a surrogate: friction law, inverse problem, settling, validity, fit to points."""
