"""Shared by all tests.

The installed package is imported first: in a checkout that is itself called ``openphase``
pytest would otherwise take the root's ``__init__.py`` for it.
"""

import os

# before numpy is loaded: thousands of small matrices are many times slower on several threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import openphase  # noqa: F401
