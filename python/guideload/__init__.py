"""Dynamic load of linear rolling guides: from a machine and a measured motion to the load of every carriage.

    from guideload import Machine, motion_from_trace, read_trace, simulate

The public names stand in `__init__.pyi`. Each is imported when it is first used, so that `import guideload` takes no
time.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
