"""Hard cases, one file per subject."""
