"""Hanging beam in MuJoCo flex. Prints one JSON line, with times of the processor. Runs in a separate environment.

usage: mujoco_beam.py SCALE STEP Euler|discrete FRAMES [POSITIONS.npy]     (SCALE 1 -> 1,152 tets, 2 -> 9,216)
"""

import json
import sys
import time

import mujoco
import numpy as np

scale, dt, integrator, frames = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3], int(sys.argv[4])
nx, ny, nz, h = 12 * scale + 1, 4 * scale + 1, 4 * scale + 1, 0.1 / scale
mu = lam = 1e5
youngs, poisson = mu * (3 * lam + 2 * mu) / (lam + mu), lam / 2 / (lam + mu)
xml = f"""<mujoco><option timestep="{dt}" integrator="{integrator}" solver="CG"/><worldbody>
<flexcomp name="beam" type="grid" dim="3" count="{nx} {ny} {nz}" spacing="{h} {h} {h}" mass="{1e3 * 1.2 * 0.4 * 0.4}"
 radius=".001" pos="0 0 1"><pin gridrange="0 0 0 0 {ny - 1} {nz - 1}"/>
<elasticity young="{youngs}" poisson="{poisson}" damping="0"/><contact selfcollide="none"/><edge equality="false"/>
</flexcomp></worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
rest = np.array(data.flexvert_xpos)
start = time.process_time()
while data.time < frames / 60 - 0.5 * dt:
    mujoco.mj_step(model, data)
seconds = time.process_time() - start
x = data.flexvert_xpos
if len(sys.argv) > 5:
    np.save(sys.argv[5], np.column_stack([rest, x]))
print(
    json.dumps(
        {
            "tets": int(model.flex_elemnum[0]),
            "ms_per_frame": 1e3 * seconds / (data.time * 60),
            "finite": bool(np.isfinite(x).all()),
            "lowest": float(x[:, 2].min()),
        }
    )
)
