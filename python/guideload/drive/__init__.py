"""The drive that a motion needs: force, power, torque of the motor, and the push of a rack on the guides."""

from guideload.drive.requirements import DriveRequirements, Motor, drive_requirements

__all__ = ["DriveRequirements", "Motor", "drive_requirements"]
