"""The physical parameters of each world's episode: drawn, fixed by an option, or held at a value from outside."""

from __future__ import annotations

import numpy as np

from rigid_env.tasks.parameters import DRAW_COUNT, LENGTHS, Parameters


class EpisodeValues:
    """Values of the five parameters in every world of a batch.

    Parameters
    ----------
    parameters : Parameters
    worlds : int

    Attributes
    ----------
    now : dict of str to (worlds,) float64, the size (worlds, 3)
        Of the running episodes; the middles of all ranges before the first.
    varying : set of str
        Fields that the world is told of at the start of an episode; the others never differ from its scene.
    """

    def __init__(self, parameters: Parameters, worlds: int):
        self.parameters = parameters
        self.now = parameters.draw(np.full((worlds, DRAW_COUNT), 0.5))
        self.varying = set(parameters.randomised)
        self._held: dict[str, np.ndarray] = {}

    def draw(self, rows: np.ndarray, shares: np.ndarray, options: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Values of new episodes; nothing is changed.

        Parameters
        ----------
        rows : (n,) int64
            Worlds.
        shares : (n, DRAW_COUNT) float64
            In [0, 1).
        options : dict
            Of `read_options`: its parameters take the place of what is drawn or held.

        Returns
        -------
        dict of str to (n,) or (n, 3) float64
        """
        values = self.parameters.draw(shares)
        for field in LENGTHS:
            if field in options:
                values[field] = options[field].copy()
            elif field in self._held:
                values[field] = self._held[field][rows]
        return values

    def begin(self, rows: np.ndarray, values: dict[str, np.ndarray], options: dict[str, np.ndarray]) -> None:
        """Note the values of new episodes."""
        for field, value in values.items():
            self.now[field][rows] = value
        self.varying.update(LENGTHS.keys() & options.keys())

    def changed(self, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Those of `values` that the world has to be told."""
        return {field: value for field, value in values.items() if field in self.varying}

    def hold(self, field: str, values: np.ndarray | None) -> None:
        """Hold a field at `values`, (worlds,) or (worlds, 3), now and in later episodes; None: draw it again."""
        if values is None:
            self._held.pop(field, None)
            return
        self._held[field] = np.array(values)
        self.now[field][...] = values
        self.varying.add(field)
