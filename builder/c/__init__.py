"""The table and the evaluation as C, and what is compiled of them."""
