"""Printed stiffnesses of carriages, and what would be estimated in their place."""

from __future__ import annotations

from guideload.catalogue.packaged import packaged_catalogue, packaged_product
from guideload.catalogue.stiffness import StiffnessEstimate

CLASSES = ("Z0", "ZA", "ZB")
# Radial stiffness [N/um] that HIWIN's German edition prints for HG20C, HG25C, HG30C.
GERMAN = {"HGH20CA": (460, 540, 620), "HGH25CA": (520, 630, 730), "HGH30CA": (630, 770, 900)}


def printed() -> list[tuple[str, str, str, float]]:
    """Product, preload class, edition and stiffness [N/m] without load, all that were found."""
    found = [
        (product.name, one.name, "packaged", one.stiffness)
        for product in packaged_catalogue().products
        for one in product.preload_classes
        if isinstance(one.stiffness, float)
    ]
    german = [
        (name, one, "German", 1e6 * k)
        for name, values in GERMAN.items()
        for one, k in zip(CLASSES, values, strict=True)
    ]
    return found + german


def in_place_of_print(name: str, preload_class: str) -> StiffnessEstimate:
    """The estimate of a product as if its catalogue printed no stiffness."""
    product = packaged_product(name)
    classes = [{"name": one.name, "share_of_C": one.share_of_C} for one in product.preload_classes]
    found = product.model_copy(update={"preload_classes": classes}).stiffness_estimate(preload_class)
    assert found is not None
    return found
