"""Detect another module named `physics` in place of the engine, when this package is imported.

Python looks for `physics` first in the working folder (``python -m``, ``python -c``) or in the folder of the script. A
`physics.py` there, or another distribution of that name, hides the engine. The engine is not imported for the check.
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec

ENGINE, MARK, IMPORTED = "physics", "kernels", "physics.world.world"
"""Name of the engine's package, a subpackage that only the engine has, and a module that its ``__init__.py`` imports.
Another distribution installed into the same folder overwrites that file alone."""


def check_engine_is_found() -> None:
    """Raise an error if ``import physics`` would give, or has given, a module other than the engine.

    Raises
    ------
    ImportError
        Naming the file that hides the engine, and what to do.
    """
    spec = _spec_of(ENGINE)
    if spec is None:
        raise ImportError(
            f"rigid_env needs the package {ENGINE!r} of its distribution, which is not found: install rigid-env again, "
            "or put the folder that holds both on the path",
            name=ENGINE,
        )
    folders = spec.submodule_search_locations
    if folders is not None and PathFinder.find_spec(f"{ENGINE}.{MARK}", list(folders)) is not None:
        source = spec.loader.get_source(ENGINE) if hasattr(spec.loader, "get_source") else None
        if source is None or IMPORTED in source:
            return
    raise ImportError(_message(spec), name=ENGINE, path=spec.origin)


def _spec_of(name: str) -> ModuleSpec | None:
    try:
        return find_spec(name)
    except (ImportError, ValueError):  # imported already, without a spec
        module = sys.modules.get(name)
        if module is None:
            return None
        spec = ModuleSpec(name, None, origin=getattr(module, "__file__", None))
        spec.submodule_search_locations = getattr(module, "__path__", None)
        return spec


def _message(spec: ModuleSpec) -> str:
    found = spec.origin or next(iter(spec.submodule_search_locations or ()), "something")
    distribution = _distribution_of(found)
    if distribution is None:
        way_out = (
            "rename it, start Python in another folder, or with `python -P` (3.11 or later; PYTHONSAFEPATH=1 likewise)"
        )
    else:
        way_out = f"it came with {distribution}: pip uninstall {distribution}, then install rigid-env again"
    return f"{found} hides the package {ENGINE!r} that rigid_env is built on: {way_out}"


def _distribution_of(path: str) -> str | None:
    """Name of the other distribution that installed the file `path` as `physics`; None if no distribution did."""
    from importlib.metadata import packages_distributions
    from pathlib import Path

    if not {"site-packages", "dist-packages"} & set(Path(path).parts):
        return None
    names = [name for name in packages_distributions().get(ENGINE, []) if name != "rigid-env"]
    return names[0] if names else None
