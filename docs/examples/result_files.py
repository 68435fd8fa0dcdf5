"""Results in files: netCDF and Parquet, which are read back, and CSV for other programs."""

from importlib.resources import files

import numpy as np
import pandas as pd
import xarray as xr

from guideload import Machine, Motion, Result, simulate

machine = Machine.from_toml(files("guideload") / "examples" / "manipulator.toml")
move = Motion.along_x(time=[0, 0.5, 0.6, 1.2, 1.3, 2], acceleration=[0, 0, 2, 2, 0, 0])
result = simulate(machine, move, times=np.linspace(0, 2, 2001))

result.to_netcdf("loads.nc")
result.to_parquet("loads.parquet")
result.to_csv("loads.csv")  # and loads.json: what is not a history
for name in ("loads.nc", "loads.parquet"):
    again = Result.load(name)
    assert np.allclose(again.carriage_loads, result.carriage_loads, rtol=1e-12)
    print(name, again.peaks()["peak_resultant_N"].round(1).to_dict())

dataset = xr.open_dataset("loads.nc", engine="h5netcdf")  # any netCDF reader
print(dict(dataset["force"].sizes), dataset["force"].attrs["units"])
print(pd.read_parquet("loads.parquet").columns[:4].tolist())
