"""Instruments: benchmarks, hard cases, measured tosses, demonstrations."""
