"""Define every model of the interface, requests and answers, once.

``inputs.py``: one case, columns; ``options.py``: contact, direction, table, what is included;
``questions.py``: law, target, stiffness, fit; ``motion.py``; ``answers.py``.
"""
