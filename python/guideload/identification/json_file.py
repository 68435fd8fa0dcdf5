"""An identification as JSON."""

from __future__ import annotations

from dataclasses import asdict

from guideload.base.finite import finite_json
from guideload.identification.modal_test import ModalTest
from guideload.identification.own_estimates import own_estimates
from guideload.identification.result import Identification


def json_text(found: Identification) -> str:
    """Estimates, their correlation, and what the report says; a number that the data do not determine is null."""
    modal_tests = [each for each in found.data if isinstance(each, ModalTest)]
    estimates = []
    for one in found.estimates:
        values = asdict(one)
        if not one.is_identified:
            values |= {"value": None, "low": None, "high": None}
        estimates.append(values)
    content = {
        "machine": found.nominal.name,
        "estimates": estimates,
        "correlation": found.correlation.tolist(),
        "own_numbers": [
            {
                "name": one.unknown.name,
                "unit": one.unknown.unit,
                "value": one.value,
                "low": one.low,
                "high": one.high,
            }
            for data in found.data
            for one in own_estimates(found, data)
        ],
        "undetermined": [asdict(one) for one in found.undetermined],
        "modes": {test.name: [asdict(pair) for pair in test.pairs(found.model)] for test in modal_tests},
        "differences": [asdict(one) for one in found.residuals],
        "messages": list(found.messages),
    }
    return finite_json(content, indent=1, ascii_only=False) + "\n"
