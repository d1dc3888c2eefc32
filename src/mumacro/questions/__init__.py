"""Answer questions about a table: the friction law, and the inputs that give a wanted friction."""
