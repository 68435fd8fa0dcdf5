"""A trace as a logger writes it: what is found in it, and the largest load with its band."""

from importlib.resources import files

import numpy as np

from guideload import Inspection, Machine, motion_from_trace, read_trace, simulate
from guideload.plots import encoder, save

time = np.arange(0.0, 2.0, 0.001)
s = np.clip((time - 0.4) / 1.2, 0.0, 1.0)
position = s - np.sin(2 * np.pi * s) / (2 * np.pi)  # 1 m in 1.2 s, acceleration a sine of 4.4 m/s2
counted = np.round(position / 5e-6) * 5e-6  # by an encoder of 5 um
np.savetxt(
    "axis.csv", np.column_stack([time, 1e3 * counted]), delimiter=";", header="t [s];x [mm]", comments=""
)

machine = Machine.from_toml(files("guideload") / "examples" / "machine.toml")
trace = read_trace("axis.csv")
print(trace, f"quantum {1e6 * trace.quantum:.3g} um, {trace.clock} time stamps")
save(encoder(Inspection.of(trace, machine))[0], "axis.png")

motion = motion_from_trace(trace, machine.drive)
true = 2 * np.pi / 1.2**2 * np.sin(2 * np.pi * s)
print(f"acceleration wrong by {np.abs(motion.acceleration[:, 0] - true).max():.3f} m/s2 at most")
peaks = simulate(machine, motion).peaks()
print(peaks[["peak_resultant_N", "peak_lower_N", "peak_upper_N"]].round(0))
