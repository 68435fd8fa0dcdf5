"""A body on two carriages: loads at rest and under m a by hand, and simulated."""

from guideload import Body, Carriage, Machine, Motion, Rail, simulate

mass, height, wide, long = (
    1000.0,
    0.4,
    0.8,
    0.6,
)  # kg, m: centre of mass above the rails, rails apart, links apart
body = Body(mass=mass, center_of_mass=[0, height, 0], inertia=[[90, 0, 0], [0, 120, 0], [0, 0, 75]])
rails = [Rail(name=name, position=[0, z]) for name, z in (("left", -wide / 2), ("right", wide / 2))]
spring = dict(x=0, length=long, stiffness_y="300 N/um", stiffness_z="300 N/um", damping_y=8e3, damping_z=8e3)
carriages = [Carriage(name=rail.name, rail=rail.name, **spring) for rail in rails]
machine = Machine(body=body, rails=rails, carriages=carriages)

a = 3.0  # m/s2 along x, from 1 s on: at once, or over half a second
sudden = Motion.along_x(time=[0, 1, 1, 3], acceleration=[0, 0, a, a])
gentle = Motion.along_x(time=[0, 1, 1.5, 3], acceleration=[0, 0, a, a])
times = [k / 2000 for k in range(6000)]

static = -mass * 9.80665 / 2  # of each carriage
pitch = mass * a * height / 2  # m a h, shared by the two carriages
print(f"by hand:   {static:8.1f} N at rest, {pitch:6.1f} N m pitch under m a")
for name, motion in (("gentle", gentle), ("sudden", sudden)):
    result = simulate(machine, motion, times=times)
    force, moment = result.data["force"], result.data["moment"]
    at_rest = float(force.sel(carriage="left", axis="y")[0])
    largest = float(abs(moment.sel(carriage="left", axis="z")).max())
    print(f"{name}:    {at_rest:8.1f} N at rest, {largest:6.1f} N m largest, {largest / pitch:.2f} times m a")
    assert abs(at_rest - static) < 1e-6 * abs(static)
    if name == "gentle":
        assert abs(largest - pitch) < 0.02 * pitch
