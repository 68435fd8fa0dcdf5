"""The loads of the two rows of a preloaded carriage, which the elastic law knows beside the load of the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload.base.arrays import Array
from guideload.life.equivalent_load import PLAIN_SUM, PreloadEffect


def row_loads(force: Array, preload: float, rolling: PreloadEffect) -> tuple[Array, Array]:
    """Loads [N] of the loaded and the other row under a load [N] of the carriage in one direction.

    F = F0 ((1 + e)+^n - (1 - e)+^n), e deflection over that at which a row opens. Both rows carry the preload F0 at no
    load; beyond 2^n F0 the other row is open. n is 3/2 for balls, 10/9 for rollers.
    """
    loaded = replace(PLAIN_SUM, preload=preload, effect=rolling).with_preload(np.abs(force))
    return loaded, loaded - np.abs(force)
