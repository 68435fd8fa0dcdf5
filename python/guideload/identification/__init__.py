"""Which numbers a machine really has: stiffness, damping and mass from measured data, with their uncertainty.

Kinds of measured data: `modal_test`, `frequency_responses`, `deflections`; what a kind offers is in `measured`.
"""

from guideload.identification.cross_validation import compare as compare
from guideload.identification.deflections import Deflection as Deflection
from guideload.identification.deflections import Deflections as Deflections
from guideload.identification.description import identify_file as identify_file
from guideload.identification.figure import Figure as Figure
from guideload.identification.figure import Run as Run
from guideload.identification.figure import figure_of as figure_of
from guideload.identification.frequency_responses import Curve as Curve
from guideload.identification.frequency_responses import FrequencyResponses as FrequencyResponses
from guideload.identification.modal_test import MeasuredMode as MeasuredMode
from guideload.identification.modal_test import ModalTest as ModalTest
from guideload.identification.next_measurement import ranked as ranked
from guideload.identification.places import place_of as place_of
from guideload.identification.result import Identification as Identification
from guideload.identification.result import identify as identify
from guideload.identification.unknowns import UnknownTable as UnknownTable
