"""Files of scenes (TOML, MJCF) and recordings of steps."""
