"""Which numbers a machine really has: stiffness, damping and mass from measured data, with their uncertainty.

Kinds of measured data: `modal_test`, `responses`, `motor_force`, `sensor_log`; what a kind offers is in `measured`.
"""

from guideload.identification.description import identify_file as identify_file
from guideload.identification.modal_test import MeasuredMode as MeasuredMode
from guideload.identification.modal_test import ModalTest as ModalTest
from guideload.identification.model import parse_place as parse_place
from guideload.identification.model_comparison import compare as compare
from guideload.identification.next_measurement import TargetQuantity as TargetQuantity
from guideload.identification.next_measurement import carriage_target as carriage_target
from guideload.identification.next_measurement import rank_measurements as rank_measurements
from guideload.identification.responses import Deflection as Deflection
from guideload.identification.responses import Deflections as Deflections
from guideload.identification.responses import FrequencyResponses as FrequencyResponses
from guideload.identification.responses import ResponseCurve as ResponseCurve
from guideload.identification.result import Identification as Identification
from guideload.identification.result import identify as identify
from guideload.identification.unknowns import UnknownTable as UnknownTable
