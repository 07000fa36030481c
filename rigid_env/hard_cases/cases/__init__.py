"""The hard cases, one file per subject."""
