"""Versions of installed packages."""

from functools import cache
from importlib import metadata

# Once for each package: all of its metadata, with its README, is parsed for one line.
version = cache(metadata.version)
