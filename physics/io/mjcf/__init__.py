"""Scenes as MJCF, the format of MuJoCo."""
