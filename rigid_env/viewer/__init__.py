"""Viewer in the browser: anything that can be played, with its past and the user's hand; extra ``view``.

- Subjects: `subject` makes one behind the `interface`, of `worlds`, `episodes` or `replays`; `copies`, `listening`.
- Session: `session` with its `controls`, a `run` with its `history`, `hand` and `ghost`, the `pace` of real time.
- Picture: `stage` draws a `Look` in `layers` and `marks`, with `scenery`, `bodies`, `shapes` and `arrows`.
- Page: `server` with `panel` and `plots`, `servers` of viser; `show` opens it, `export` makes one that plays offline.

viser is imported when a server is started, and `physics` knows nothing of it.
"""
