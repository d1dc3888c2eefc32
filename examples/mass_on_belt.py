"""A mass on a belt in MuJoCo: friction that falls with speed makes it stick and slip; a shaker stops that.

    python examples/mass_on_belt.py

The contact is computed by mumacro and applied as a force, since MuJoCo's own contacts know no oscillation: the mean
over a period of the shaker, regularised at rest.  examples/c/mass_on_belt.c is the same in C.
"""

import math

import mujoco

import mumacro

MODEL = """
<mujoco>
  <option timestep="2e-5" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="x" type="slide" axis="1 0 0" stiffness="2e3" damping="0.5"/>
      <geom type="box" size="0.02 0.02 0.02" mass="0.5" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""
BELT, FORCE, STIFFNESS, OMEGA, REST = 0.01, 10.0, 1e6, 1.3e5, 5e-4  # m/s, N, N/m, rad/s, m/s


def swing(table: mumacro.Surrogate, y0: float, until: float = 3.0, watched: float = 1.0) -> float:
    """Peak to peak [m] of the mass during the last ``watched`` seconds; the shaker's amplitude is ``y0`` [m]."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    seen = []
    while data.time < until:
        slip = BELT - data.qvel[0]
        mu0 = 0.3 + 0.1 * math.exp(-abs(slip) / 0.01)  # Coulomb's coefficient falls from 0.4 at rest to 0.3
        speed = max(abs(slip), REST)
        mu_macro, *_ = table.evaluate_case(mu0, FORCE, STIFFNESS, y0, OMEGA, speed)
        data.qfrc_applied[0] = mu_macro * FORCE * slip / speed
        mujoco.mj_step(model, data)
        if data.time > until - watched:
            seen.append(data.qpos[0])
    return float(max(seen) - min(seen))


if __name__ == "__main__":
    opened = mumacro.open(1e-7)
    for y0 in (0.0, 4e-6):
        print(f"y0 = {1e6 * y0:.1f} um: swings by {1e3 * swing(opened, y0):.4f} mm")
