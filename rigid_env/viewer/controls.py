"""Controls by which a user acts in a run: drag, kick, and sliders."""

from __future__ import annotations

from rigid_env.viewer.hand import checked_body, checked_vector
from rigid_env.viewer.interface import Can, Subject
from rigid_env.viewer.run import Run


class Controls:
    """Part of `session.Session`: all that becomes an input of its run.

    Attributes
    ----------
    subject : Subject
    """

    subject: Subject
    _run: Run
    _sliders: dict[str, float]  # as they were set

    @property
    def can(self) -> Can:
        """Controls that the subject allows."""
        return self.subject.can

    def _needs(self, control: str) -> None:
        if not getattr(self.can, control):
            allowed = ", ".join(name for name, is_on in vars(self.can).items() if is_on) or "none"
            raise ValueError(f"{control} does not act on {self.subject.name}; allowed controls are {allowed}")

    # --- the user's hand ---------------------------------------------------------------------------------------

    def drag(self, body: int, point_body, target) -> None:
        """Drag a body by a spring until `release`.

        Parameters
        ----------
        body : int
        point_body : (3,) array_like
            Point of the body, from its centre of mass, body frame [m].
        target : (3,) array_like
            Where it is pulled to, world frame [m].

        Raises
        ------
        ValueError
            No such body, numbers that are not finite, or a subject that cannot be dragged.
        """
        self._needs("drag")
        body = checked_body(self.subject.world, body)
        self._run.give("drag", body, checked_vector(point_body, "point_body"), checked_vector(target, "target"))

    def release(self) -> None:
        """End a `drag`."""
        if self._run.hand.body is not None:
            self._run.give("release")

    def kick(self, body: int, impulse) -> None:
        """Push a body at its centre of mass in the next step: an impulse (3,), world frame [N s]."""
        self._needs("drag")
        self._run.give("kick", checked_body(self.subject.world, body), checked_vector(impulse, "impulse"))

    # --- sliders -----------------------------------------------------------------------------------------------

    def set_gravity(self, strength: float) -> None:
        """Change the strength of gravity at once, at least 0 [m/s²]; its direction stays."""
        self._slide("gravity", strength)

    def set_friction(self, mu: float) -> None:
        """Change the coefficient of friction of all bodies at once, at least 0."""
        self._slide("friction", mu)

    def set_restitution(self, e: float) -> None:
        """Change the coefficient of restitution of all bodies at once, 0 to 1."""
        self._slide("restitution", e)

    @property
    def settings(self) -> dict[str, float]:
        """Present values of the sliders that the subject allows: gravity [m/s²], friction, restitution of body 0."""
        values = {} if self.subject.world is None else self.subject.settings()
        return {name: value for name, value in values.items() if getattr(self.can, name)}

    def _slide(self, name: str, value: float) -> None:
        self._needs(name)
        self._run.give(name, value)
        self._sliders[name] = value
