"""Short files for kinds of machines, from one skeleton; `guideload init` without --kind writes the long one."""

from __future__ import annotations

from typing import NamedTuple

SKELETON = """\
# {title} for guideload. Replace the values with your own, then run
#   guideload check machine.toml
#
# Axes: {axes}.
# Origin: the point L where the drive acts. Values: SI numbers, or strings with their unit.
# `guideload init` without --kind writes a longer file, which explains every key.

name = "{name}"
gravity = {gravity}

[body]                                  # all that moves with the carriages, payload included
mass = "{mass}"
center_of_mass = {center}    # from L
inertia = {inertia}    # kg m^2, about the centre of mass, from CAD

[drive]                                 # for torques, and for traces of the motor
gear_ratio = {ratio}                        # motor turns per turn of screw or pinion
{drive}

[friction]                              # of the guides; it adds to the drive's force
coefficient = 0.003
seal = "5 N"                            # of one carriage

[carriage_types.wagon]                  # keys of all carriages with this type
length = "{length}"                        # Le/sqrt(3) for rows of balls or rollers of the length Le
{width}stiffness_y = "{stiffness[0]}"                # the catalogue's rigidity; half of it on a soft structure
stiffness_z = "{stiffness[1]}"
damping_y = "{damping[0]}"                 # not in catalogues: `guideload modes` prints damping ratios, mostly near 2 %
damping_z = "{damping[1]}"
"""
WIDTH = 'width = "{}"                         # distance of the rows across the rail: they resist roll\n'
RAIL = '\n[[rails]]\nname = "{}"\nposition = {}        # y, z from L\n'
CARRIAGE = '\n[[carriages]]\nname = "{}"\nrail = "{}"\nx = "{}"\ntype = "wagon"\n'


class Kind(NamedTuple):
    """The values of a kind of machine, as text of its file; rails and carriages by name."""

    title: str
    axes: str
    name: str
    gravity: str
    mass: str
    center: str
    inertia: str
    ratio: str
    drive: str
    length: str
    width: str
    stiffness: tuple[str, str]
    damping: tuple[str, str]
    rails: dict[str, str]
    places: tuple[str, str]  # x of the two carriages of each rail

    @property
    def text(self) -> str:
        """The machine file."""
        width = WIDTH.format(self.width) if self.width else ""
        parts = [SKELETON.format(**{**self._asdict(), "width": width})]
        parts += [RAIL.format(*rail) for rail in self.rails.items()]
        for rail in self.rails:
            lead = f"{rail} " if len(self.rails) > 1 else ""
            parts += [
                CARRIAGE.format(lead + end, rail, x)
                for end, x in zip(("rear", "front"), self.places, strict=True)
            ]
        return "".join(parts)


SCREW = 'screw_lead = "20 mm"                    # travel per turn'
RACK = 'pinion_diameter = "63.66 mm"            # pitch diameter: module x teeth'
KINDS = {
    "one-rail": Kind(
        title="A horizontal axis on one rail",
        axes="x along the rail, y up, z across",
        name="One rail",
        gravity='[0, "-9.80665 m/s^2", 0]',
        mass="40 kg",
        center='["0 mm", "90 mm", "15 mm"]',
        inertia="[[0.28, 0, 0], [0, 0.51, 0], [0, 0, 0.38]]",
        ratio="1.0",
        drive=SCREW,
        length="28 mm",
        width="20 mm",
        stiffness=("200 N/um", "150 N/um"),
        damping=("8 kN s/m", "6 kN s/m"),
        rails={"rail": '["0 mm", "0 mm"]'},
        places=("-70 mm", "70 mm"),
    ),
    "gantry": Kind(
        title="A gantry: a beam on two rails far apart",
        axes="x along the rails, y up, z across",
        name="Gantry",
        gravity='[0, "-9.80665 m/s^2", 0]',
        mass="420 kg",
        center='["0 mm", "-150 mm", "60 mm"]',
        inertia="[[160, 0, 0], [0, 150, 0], [0, 0, 25]]",
        ratio="8.0",
        drive=RACK,
        length="40 mm",
        width="",
        stiffness=("270 N/um", "200 N/um"),
        damping=("9 kN s/m", "8 kN s/m"),
        rails={"left": '["50 mm", "-900 mm"]', "right": '["50 mm", "900 mm"]'},
        places=("-250 mm", "250 mm"),
    ),
    "vertical": Kind(
        title="A vertical axis on one rail",
        axes="x along the rail and up, y away from the rail, z across. The drive holds the weight",
        name="Vertical axis",
        gravity='["-9.80665 m/s^2", 0, 0]',
        mass="52 kg",
        center='["0 mm", "120 mm", "10 mm"]',
        inertia="[[0.6, 0, 0], [0, 0.9, 0], [0, 0, 0.8]]",
        ratio="1.0",
        drive=SCREW,
        length="36 mm",
        width="28 mm",
        stiffness=("300 N/um", "220 N/um"),
        damping=("12 kN s/m", "9 kN s/m"),
        rails={"rail": '["-30 mm", "0 mm"]'},
        places=("-90 mm", "90 mm"),
    ),
}
