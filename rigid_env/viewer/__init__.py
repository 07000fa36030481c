"""Viewer in the browser: plays worlds, environments, recordings and trajectories; it needs the extra ``view``.

- Subjects, things that can be played: `subject` makes one of the classes in `worlds`, `episodes` and `replays`, which
  share the base class in `interface`; `copies` and `listening` help them.
- Session, a subject that is being played: `session` with its `controls`, a `run` with its `history`, the user's `hand`,
  a `ghost` for comparison, and the `pace` of real time.
- Picture: `stage` draws a `Look` in `layers` and `marks`, with `scenery`, `bodies`, `shapes` and `arrows`.
- Page: `server` with `panel` and `plots`, on a server of viser from `servers`. `show` opens the page, and `export`
makes
  one that plays offline.

viser is imported when a server is started; `physics` does not depend on it.
"""
