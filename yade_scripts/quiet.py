"""Keeping YADE from spending time on a log that nobody reads."""

import ctypes


def silence_log():
    """Switch YADE's log off where that is possible: it looks at every grain near a facet.

    That takes a tenth of a run (benchmarks/runs/dem_cost.py), and Python has no switch for it.
    What goes wrong raises exceptions, which are kept in the record.
    """
    try:
        library, core = ctypes.CDLL(None), (ctypes.c_void_p * 2)()
        library._ZN5boost3log11v2_mt_posix4core3getEv(ctypes.byref(core))
        library._ZN5boost3log11v2_mt_posix4core19set_logging_enabledEb(
            ctypes.c_void_p(core[0]), ctypes.c_bool(False)
        )
    except AttributeError:
        pass  # another build of YADE, with another log
