"""What is asked and what is answered: every model of the interface, written out once.

``inputs.py``: one case, columns; ``options.py``: contact, direction, table, what is included;
``questions.py``: law, target, stiffness, fit; ``motion.py``; ``answers.py``.
"""
