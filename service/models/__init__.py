"""What is asked and what is answered: every model of the interface, written out once."""
