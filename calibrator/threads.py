"""Linear algebra of small matrices on one thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from threadpoolctl import ThreadpoolController

Verb = TypeVar("Verb", bound=Callable[..., Any])
_THREADS = ThreadpoolController()


def on_one_thread(function: Verb) -> Verb:
    """Keep the linear algebra of function on one thread.

    Matrices of some tens of rows are slower on several, 20 times so on a machine whose cores are
    busy with runs.
    """
    return cast(Verb, _THREADS.wrap(limits=1, user_api="blas")(function))
