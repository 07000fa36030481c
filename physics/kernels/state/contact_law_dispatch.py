"""Contact laws beyond Coulomb's, which only some scenes declare: dispatch by the type of a body's record.

As with force fields (`fields.terms`): the record of a body has a member `law_rolling` where the scene declares rolling
friction, its numbers stand in `body.laws`, and a kernel that asks for them is compiled per type of the record. Where
none is declared nothing of it is compiled, stored or passed on.
"""

from __future__ import annotations

from physics.compiler.decorators import backend, by_type, members, when

# Names of the laws, in the order of their numbers in `body.laws` and of their columns, the last of `params`.
LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY = "tangential", "rolling", "spin", "anisotropy"
LAW_STIFFNESS, LAW_DAMPING = "stiffness", "damping"
LAWS = (LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY, LAW_STIFFNESS, LAW_DAMPING)
_PREFIX = "law_"


def law_members(laws: tuple[str, ...]) -> list[tuple]:
    """Members of a body's record for these laws; none without laws."""
    if not laws:
        return []
    numbers = [("laws", float, (len(laws),)), *((_PREFIX + name, float) for name in laws)]
    return numbers + [("give", float)] * (LAW_STIFFNESS in laws)  # γ of a stage [1/kg], see `compliance`


def _declared(record) -> list[str]:
    """Laws in the record of a body, in a workspace with one, or in the type of either."""
    body = backend.member(record, "body") if "body" in members(record) else record
    return [name[len(_PREFIX) :] for name in members(body) if name.startswith(_PREFIX)]


def if_law(laws: tuple[str, ...], instead):
    """Make a kernel of a function whose last argument is a body's record or the workspace.

    Without such laws `instead` takes its place: it takes the same arguments and is inlined.
    """
    return when(lambda *types: bool(set(laws) & set(_declared(types[-1]))), instead)


def law_parameter(law: str, otherwise: float = 0.0):
    """Make a kernel (body) that returns a law's number for a body; `otherwise` if undeclared."""

    def chosen(body):
        declared = _declared(body)
        if law not in declared:
            return lambda body: otherwise
        place = declared.index(law)
        return lambda body: body.laws[place]

    return by_type(chosen)


def _nothing(params, i, body):
    return None


@if_law(LAWS, _nothing)
def bind_laws(params, i, body):
    """Store the laws' numbers of body i in `body`."""
    count = body.laws.shape[0]
    for k in range(count):
        body.laws[k] = params[i, params.shape[1] - count + k]
