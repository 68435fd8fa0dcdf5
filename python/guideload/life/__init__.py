"""Life and static safety of carriages and rails under simulated loads (ISO 14728-1 and -2)."""

from guideload.life.life import Life, life_of

__all__ = ["Life", "life_of"]
