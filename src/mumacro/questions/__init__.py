"""Questions to a surrogate: the friction law, and the inputs that give a friction."""
