"""The same job by other means: what a competent user of other packages writes, with the package's own strengths.

A peer gets a `Problem` (problem.py) and gives the call to be timed, which takes a tolerance or a step and gives loads
of shape (time, carriage, 2), force along y and z [N], or (time, carriage, 6), force and moment about the carriage
centre [N, N m]. Outside the call lies what guideload keeps from run to run too, the assembled matrices, and what a
compiler does; inside it all that depends on matrices and motion: exponential, eigenvalues, integration,
loads. All peers work, like guideload, with the deviation from static equilibrium, else their tolerances would
drown the motion in the sag. Absolute tolerances are rtol times the sag in each state. With 1e-6 of a metre,
SciPy's default, RK45 is wrong by 5 % and DOP853 by 39 % of the dynamic load on `cycle`, with "success".
roster.py lists all peers and their settings.

Those called batch_* run many scenes (monte_carlo.py). Such a peer gets a `Scatter` (scatter.py), draws of one machine,
and gives the peaks of each scene; all that depends on the draws is inside its call, assembly and position at rest as
well. batch_roster.py lists them.
"""
