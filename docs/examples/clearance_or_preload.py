"""One machine with clearance, without, and with preload: what the guides' fit does to the peak load."""

from importlib.resources import files

from guideload import Machine, motion_from_trace, read_trace, simulate

folder = files("guideload") / "examples"
machine = Machine.from_toml(folder / "manipulator.toml")
motion = motion_from_trace(read_trace(folder / "manipulator.csv"), machine.drive)

fits = {
    "10 um clearance": dict(clearance_y="10 um", clearance_z="10 um"),
    "no clearance": {},
    "2 kN preload": dict(preload_y="2 kN", preload_z="2 kN", rolling="ball"),
}
for name, keys in fits.items():
    carriages = [carriage.model_copy(update=keys) for carriage in machine.carriages]
    result = simulate(machine.model_copy(update={"carriages": carriages}), motion)
    peak = result.peaks()["peak_resultant_N"]
    print(f"{name:16} {result.method:6} largest peak {peak.max():5.0f} N in carriage {peak.idxmax()}")
