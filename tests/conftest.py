"""Shared by all tests.

The installed package is imported first: in a checkout that is itself called ``openphase``
pytest would otherwise take the root's ``__init__.py`` for it.
"""

import openphase  # noqa: F401
