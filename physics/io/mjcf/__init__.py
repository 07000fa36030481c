"""Reading and writing of scenes as MJCF, the format of MuJoCo's models."""
