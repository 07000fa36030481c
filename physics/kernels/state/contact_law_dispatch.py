"""Contact laws beyond Coulomb's, which only some scenes declare: dispatch by the type of the workspace.

As with force fields (`fields.terms`): the workspace has a member `law_rolling` where the scene declares rolling
friction, its numbers stand in `work.laws`, and a kernel that asks for them is compiled per type of the
workspace. Where none is declared nothing of it is compiled, stored or passed on.
"""

from __future__ import annotations

from physics.compiler.decorators import by_type, members, when

# Names of the laws, in the order of their numbers in `work.laws` and of their columns, the last of `params`.
LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY = "tangential", "rolling", "spin", "anisotropy"
LAW_STIFFNESS, LAW_DAMPING = "stiffness", "damping"
LAWS = (LAW_TANGENTIAL, LAW_ROLLING, LAW_SPIN, LAW_ANISOTROPY, LAW_STIFFNESS, LAW_DAMPING)
_PREFIX = "law_"


def law_members(laws: tuple[str, ...]) -> list[tuple]:
    """Members of a workspace for these laws; none without laws."""
    if not laws:
        return []
    numbers = [("laws", float, (len(laws),)), *((_PREFIX + name, float) for name in laws)]
    return numbers + [("give", float)] * (LAW_STIFFNESS in laws)  # γ of a stage [1/kg], see `compliance`


def _declared(work) -> list[str]:
    """Laws of a workspace, or of the type of one."""
    return [name[len(_PREFIX) :] for name in members(work) if name.startswith(_PREFIX)]


def if_law(laws: tuple[str, ...], instead):
    """Make a kernel of a function whose last argument is the workspace; `instead` takes its place without such laws.

    `instead` takes the same arguments and is inlined.
    """
    return when(lambda *types: bool(set(laws) & set(_declared(types[-1]))), instead)


def law_parameter(law: str, otherwise: float = 0.0):
    """Make a kernel (work) that returns a law's number for the body in the workspace; `otherwise` if undeclared."""

    def chosen(work):
        declared = _declared(work)
        if law not in declared:
            return lambda work: otherwise
        place = declared.index(law)
        return lambda work: work.laws[place]

    return by_type(chosen)


def _nothing(params, i, work):
    return None


@if_law(LAWS, _nothing)
def bind_laws(params, i, work):
    """Store the laws' numbers of body i in `work`."""
    count = work.laws.shape[0]
    for k in range(count):
        work.laws[k] = params[i, params.shape[1] - count + k]
