"""Hold the compiled kernel, and the only Python code that calls it.

Read ``kernel.c`` first.  It includes the other files in such an order that each needs only the
files before it.  ``level.c`` is compiled once for each instruction set; ``dispatch.c`` chooses one
when the library is loaded.

- ``data.h``, ``records.h``, ``mumacro.h``: a table in memory, a quantity, what C programs call
- ``lanes.h``, ``arithmetic.c``, ``closed_forms.c``: several points at once, functions, formulas
- ``atlas.c``, ``border.c``, ``charts.c``, ``ball_charts.c``, ``places.c``, ``cells.c``: the list of
  blocks, their coordinates (of a ball), polynomials
- ``quantities.c``, ``records.c``: how each quantity follows from them
- ``points.c``, ``passes.c``: one point, many points
- ``directions.c``, ``contact.c``: along and normal, of one spring and of a ball; the dispatch over
  contact and direction
- ``dimensional.c``, ``interval.c``: cases in SI units, an interval of k
- ``element.c``: steps in time; ``motion.c``, ``motion_slip.c``, ``motion_cycle.c``,
  ``motion_ball.c``: steady cycles of any motion; ``loop.c``: the force over a way, for loops
- ``binding.py``, ``arrays.py``, ``threads.py``, ``quadrature.py``: the shared object from Python,
  long arrays, the quadrature over a ball
"""
