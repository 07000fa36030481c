"""Viewer in the browser: a `Look` at a moment, drawn by `stage.Stage` with viser; extra ``view``.

`stage` draws, `export` makes a motion one page that plays offline, in a file or a notebook. viser is imported when a
server is started, and `physics` knows nothing of it.
"""
