"""Monte Carlo: how the peak load scatters where the stiffness of each carriage is known to 20 %."""

from importlib.resources import files

from guideload import Machine, Study, motion_from_trace, plots, read_trace, run_study

folder = files("guideload") / "examples"
machine = Machine.from_toml(folder / "manipulator.toml")
motion = motion_from_trace(read_trace(folder / "manipulator.csv"), machine.drive)
stiffness = {
    "name": "k",
    "path": ["carriages.*.stiffness_y", "carriages.*.stiffness_z"],
    "each": "carriage",
    "distribution": "lognormal",
    "sigma": 0.2,
}
study = Study(machine=machine, motion=motion, samples=4096, seed=1, vary=[stiffness])
result = run_study(study)

name = "peak_resultant_N[2b]"
print(result.quantiles(name, [0.05, 0.5, 0.95, 0.99]))
print("above 6 kN:", result.probability_above(name, "6 kN"))
print(result.rank_correlation(name))
plots.save(plots.exceedance(result), "exceedance.png")
