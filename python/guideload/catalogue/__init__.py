"""Catalogues of carriages: ratings, stiffness, friction and limits of products; and the conditions of use."""

from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.packaged import packaged_catalogue, packaged_product
from guideload.catalogue.product import Product
from guideload.catalogue.rating import Rating

__all__ = ["Catalogue", "LifeConditions", "Product", "Rating", "packaged_catalogue", "packaged_product"]
