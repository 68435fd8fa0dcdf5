"""Pictures, a function per figure. Each returns its axes, and draws on axes of its own unless it is given some.

They are drawn without pyplot: they need no display and change no setting of the process.
`ax.figure.savefig(path)` saves one; in a notebook `ax.figure` shows it.
"""

import lazy_loader

# With pandas and pyarrow the pictures of studies take half a second to import, so each is imported at its first use.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
