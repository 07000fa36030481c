"""Viewer in the browser: a `Look` at a moment, drawn by `stage.Stage` with viser; extra ``view``.

`stage` draws, `export` writes a motion into one file that plays offline, `notebook` embeds it. viser is imported when
one of them is, and `physics` knows nothing of it.
"""
