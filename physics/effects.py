"""What acts in a scene: one small frozen dataclass per effect.

A scene declares its effects; what it does not declare is not compiled into its
kernel. The gyroscopic torque declares itself where a body's moments differ.
Force fields (drag, springs, your own) stand in `physics.fields`.
"""

from __future__ import annotations

from dataclasses import dataclass

from physics import checks
from physics.field import Field


@dataclass(frozen=True)
class Gravity:
    """A uniform force field: every body accelerates by the same vector, and it exerts no torque.

    Parameters
    ----------
    acceleration : (3,) array_like
        World frame [m/s²].
    """

    acceleration: tuple = (0.0, -9.81, 0.0)

    def __post_init__(self):
        value = checks.finite(self.acceleration, (3,), "Gravity.acceleration")
        object.__setattr__(self, "acceleration", tuple(value.tolist()))


@dataclass(frozen=True)
class Contact:
    """Bodies do not pass through walls, nor through each other.

    Parameters
    ----------
    restitution : float, optional
        Newton's coefficient e in [0, 1]: the normal velocity after an impact is -e times that before. None:
        impacts are plastic and the kernel holds no restitution.
    between_bodies : bool, optional
        False: bodies meet walls only, and pass through each other.
    """

    restitution: float | None = None
    between_bodies: bool = True

    def __post_init__(self):
        if not isinstance(self.between_bodies, bool):
            raise ValueError(f"Contact.between_bodies is {self.between_bodies!r}; allowed are True and False")
        if self.restitution is not None:
            value = float(checks.share(self.restitution, (), "Contact.restitution"))
            object.__setattr__(self, "restitution", value)


@dataclass(frozen=True)
class Friction:
    """Coulomb friction with the exact circular cone: |f_t| <= μ f_n, opposed to sliding.

    Parameters
    ----------
    coefficient : float
        μ, the same for sticking and sliding; at least 0.
    """

    coefficient: float = 0.5

    def __post_init__(self):
        value = float(checks.non_negative(self.coefficient, (), "Friction.coefficient"))
        object.__setattr__(self, "coefficient", value)


EFFECTS = (Gravity, Contact, Friction, Field)
